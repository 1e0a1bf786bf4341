#!/bin/bash
# Frames of small committed models: their hashes, whatever the machine, the number of threads and the run.
# `PSR_GOLDEN=write` rewrites tests/golden/hashes after a change that is meant to change frames: look at them first.
. "$(dirname "$0")/lib.sh"
hashes=tests/golden/hashes
new=$work/hashes

shots() { # threads
	while read -r name options; do
		case $name in '' | '#'*) continue ;; esac
		# shellcheck disable=SC2086
		hash=$(psr shot --server "$server" $options --codec lossless --depth "$work/depth.pfm" -o "$work/frame.png" --hash |
			tr '\n' ' ')
		echo "$name ${hash% }"
	done <tests/golden/shots
}

for threads in 1 2 3; do
	start_psrd --models tests/golden --threads $threads
	shots >"$work/hashes.$threads"
	check "psrd of $threads threads stops cleanly" stop_psrd
done
cp "$work/hashes.1" "$new"
[ "${PSR_GOLDEN:-}" = write ] && cp "$new" $hashes

check "two threads draw the same bytes as one" cmp "$work/hashes.1" "$work/hashes.2"
check "three threads draw the same bytes as one" cmp "$work/hashes.1" "$work/hashes.3"
while read -r name expected; do
	got=$(sed -n "s/^$name //p" "$new")
	if [ "$got" = "$expected" ]; then
		ok "frame '$name' has its golden hash"
	else
		not_ok "frame '$name' has its golden hash" "got '$got', expected '$expected'"
	fi
done <$hashes
[ "$(wc -l <"$new")" -eq "$(wc -l <$hashes)" ] || not_ok "every shot has a golden hash" "$(wc -l <"$new") shots"
