#!/bin/bash
# needs: psr-model
# The same bytes every time: models whatever the number of threads and the run, frames whatever the threads, the run, the
# codec, the listener and what else the daemon does.
. "$(dirname "$0")/lib.sh"
models=$work/models
mkdir "$models"

build() { psr-model build "$work/$1.glb" -r 96 -o "$2" --quiet "${@:3}"; }

# --- models ---
for name in teapot top; do
	check "$name is generated" psr-model make $name -o "$work/$name.glb"
	check "$name is generated again" psr-model make $name -o "$work/again.glb"
	check "$name: two meshes are the same" cmp "$work/$name.glb" "$work/again.glb"
	check "$name is built" build $name "$models/$name.psr"
	check "$name is built again" build $name "$work/again.psr"
	check "$name: two builds are the same" cmp "$models/$name.psr" "$work/again.psr"
	for threads in 1 2 5; do
		check "$name is built by $threads threads" build $name "$work/threads.psr" --threads $threads
		check "$name: $threads threads build the same" cmp "$models/$name.psr" "$work/threads.psr"
	done
done
for name in teapot top; do
	check "$name is built packed" build $name "$work/packed.psr" --pack
	plain=$(stat -c %s "$models/$name.psr") packed=$(stat -c %s "$work/packed.psr")
	check "$name: the packed file is smaller" test "$packed" -lt $((plain / 2))
	is "$name: packed and plain have one content id" "$(psr-model info "$models/$name.psr" | grep '^content id')" \
		"$(psr-model info "$work/packed.psr" | grep '^content id')"
	head -c $((packed / 2)) "$work/packed.psr" >"$work/cut.psr"
	refuses "$name: half of a packed file" 4 "cut short" psr-model info "$work/cut.psr"
done
mkdir "$work/elsewhere"
cp "$work/top.glb" "$work/elsewhere/top.glb"
check "a mesh elsewhere is built" psr-model build "$work/elsewhere/top.glb" -r 96 -o "$work/elsewhere.psr" --quiet
check "its place does not matter" cmp "$models/top.psr" "$work/elsewhere.psr"

# --- frames ---
lights=(--light point:3,5,4,ref=5,color=#ffe0a0 --light dir:-1,-2,-1,intensity=0.5)
shot() { psr shot --server "$server" --size 1920x1080 --no-smooth "${lights[@]}" "$@"; }
frames() { # color and depth of views far, near and orthographic
	for name in teapot top; do
		shot --model $name --depth "$work/depth.pfm" --hash
		shot --model $name --eye 2,3,4 --target 0,1,0 --fov 20 --depth "$work/depth.pfm" --hash
		shot --model $name --eye 5,4,6 --target 0,1,0 --ortho 5 --depth "$work/depth.pfm" --hash
	done
}
for run in "1 first" "1 second" "2 first" "2 second" "5 first"; do
	start_psrd --models "$models" --threads "${run% *}"
	frames >"$work/frames-${run/ /-}"
	check "psrd stops cleanly" stop_psrd
done
is "each view has a hash of its own, twice" 12 "$(sort -u "$work/frames-1-first" | grep -cE '^(color|depth) [0-9a-f]{16}$')"
for run in 1-second 2-first 2-second 5-first; do
	check "1920x1080 by ${run%-*} threads, ${run#*-} run: the same as by one thread" cmp "$work/frames-1-first" \
		"$work/frames-$run"
done

# --- codecs, listeners, load ---
start_psrd --models "$models" --threads 2 --listen "unix:$work/socket"
expected=$(shot --model top --hash)
for codec in lossless raw jpeg:1 jpeg:85 jpeg:100; do
	is "$codec reports the frame's hash" "$expected" "$(shot --model top --codec $codec --hash)"
done
is "so does a Unix socket" "$expected" "$(server=unix:$work/socket shot --model top --hash)"
check "a lossless picture is written" shot --model top -o "$work/tcp.ppm"
check "and one from the Unix socket" psr shot --server "unix:$work/socket" --size 1920x1080 --no-smooth "${lights[@]}" --model top \
	-o "$work/unix.ppm" --codec raw
check "they are the same file" cmp "$work/tcp.ppm" "$work/unix.ppm"

psr bench --server "$server" --model teapot --clients 4 --seconds 1 --size 320x240 --json >"$work/bench.json" \
	2>"$work/err" &
bench=$!
while kill -0 $bench 2>/dev/null; do
	shot --model top --hash
done >"$work/under-load"
wait $bench
is "four clients for a second: exit status 0" 0 $?
is "no frame has failed" 0 "$(number "$work/bench.json" failed)"
check "each client has got a frame" [ "$(number "$work/bench.json" frames)" -ge 4 ]
echo "# $(number "$work/bench.json" frames_per_s) frames/s of 320x240 beside $(wc -l <"$work/under-load") of 1920x1080"
is "frames drawn meanwhile are the same" "$expected" "$(sort -u "$work/under-load")"
check "psrd stops cleanly after the load" stop_psrd
