#!/bin/bash
# Anti-aliased stills through psrd and psr: passes of ever finer sub-pixels.
. "$(dirname "$0")/lib.sh"

still() {
	psr shot --server "$server" --model wheel --size 160x120 --no-smooth --codec lossless --depth "$work/depth.pfm" -o "$work/$1.png" --hash "${@:2}" >"$work/$1"
}

start_psrd --models tests/golden --threads 1 --isa c
still plain
still pass0 --passes 0
still pass2 --passes 2
still pass4 --passes 4
check "psrd stops cleanly" stop_psrd
start_psrd --models tests/golden --threads 3
still other2 --passes 2
check "0 passes are the plain frame" diff -u "$work/plain" "$work/pass0"
check "a pass changes the frame" test "$(cat "$work/plain")" != "$(cat "$work/pass2")"
check "the next passes change it again" test "$(cat "$work/pass2")" != "$(cat "$work/pass4")"
refuses "more passes than there are" 2 "--passes: '9' is out of range; it takes 0 to 4" still pass9 --passes 9
check "threads and instructions change no byte" diff -u "$work/pass2" "$work/other2"
refuses "other planes are not refined" 4 "refines colour and depth" \
	psr shot --server "$server" --model wheel --size 64x64 --passes 1 --plane normal -o "$work/normal.png"
check "psrd stops cleanly" stop_psrd
