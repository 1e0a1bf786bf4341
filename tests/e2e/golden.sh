#!/bin/bash
# not for threads
# The frames of tests/golden through psrd and psr: what tests/golden/frames draws without sockets, with what instructions
# and by how many threads ever.
. "$(dirname "$0")/lib.sh"
hashes=tests/golden/hashes

shots() {
	while read -r name options; do
		case $name in '' | '#'*) continue ;; esac
		case " $options " in *" --smooth "*) ;; *) options="$options --no-smooth" ;; esac
		# shellcheck disable=SC2086
		hash=$(psr shot --server "$server" $options --codec lossless --depth "$work/depth.pfm" -o "$work/frame.png" --hash |
			tr '\n' ' ')
		echo "$name ${hash% }"
	done <tests/golden/shots
}

for way in "--threads 3" "--threads 1 --isa c"; do
	# shellcheck disable=SC2086
	start_psrd --models tests/golden --verbose $way
	shots >"$work/got"
	check "psrd $way stops cleanly" stop_psrd
	check "psrd $way draws frames of the golden hashes" diff -u $hashes "$work/got"
done
check "psrd --isa c draws with c" grep -q "with 1 threads and c$" "$work/psrd.log"
