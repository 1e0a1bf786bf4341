#!/bin/bash
# make demo: models, a daemon on a free port, pictures, a load test, one table and one contact sheet. Everything that it
# writes is in build/demo; everything that it starts, it stops.
set -eu
cd "$(dirname "$0")/.."
BUILD=$(realpath "${BUILD:-build/release}")
out=build/demo
models=$out/models
PATH=$BUILD/bin:$PATH
seconds=${PSR_DEMO_SECONDS:-3}
mkdir -p "$models"
unset PSR_SERVER
export XDG_CONFIG_HOME=/nonexistent # no defaults of the user

pid=
stop() {
	[ -z "$pid" ] || { kill -TERM "$pid" && wait "$pid"; } || :
	pid=
}
trap stop EXIT

echo "== models"
for name in teapot top pencil wheel; do
	[ "$models/$name.glb" -nt "$BUILD/bin/psr-model" ] || psr-model make "$name" -o "$models/$name.glb"
	[ "$models/$name.psr" -nt "$models/$name.glb" ] || psr-model build "$models/$name.glb" -r 512 -o "$models/$name.psr"
done
models/fetch.sh || echo "(the real models cannot be had now; the demo goes on with its own)"
cache=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
real=
for entry in dragon:dragon.ply bunny:bunny.obj engine:engine.glb clearcoat:clearcoat/ClearCoatTest.gltf; do
	name=${entry%%:*} source=$cache/${entry#*:}
	[ -f "$source" ] || continue
	real="$real $name"
	[ "$models/$name.psr" -nt "$source" ] && [ "$models/$name.psr" -nt "$BUILD/bin/psr-model" ] ||
		psr-model build "$source" -r 512 -o "$models/$name.psr"
done

echo "== psrd"
psrd --listen 127.0.0.1:0 --models "$models" >"$out/ready" 2>"$out/psrd.log" &
pid=$!
for _ in $(seq 200); do
	grep -q '^READY' "$out/ready" && break
	kill -0 $pid 2>/dev/null || { cat "$out/psrd.log" >&2; exit 1; }
	sleep 0.05
done
server=$(sed -n 's/^READY //p' "$out/ready")
echo "serving on $server"

flat() { tr -d '\n\t ' <"$1"; }
number() { flat "$1" | sed -n "s/.*\"$2\":\([-+0-9.eE]*\).*/\1/p"; }             # file key: the last one of that name
of_model() { flat "$1" | sed -n "s/.*\"model\":{[^}]*\"$2\":\([-+0-9.eE]*\).*/\1/p"; } # file key
stage() { flat "$1" | sed -n "s/.*\"$2\":{\"ms\":\([-+0-9.eE]*\).*/\1/p"; }        # file stage: milliseconds

sum() { awk "BEGIN { print $1 + $2 }"; }
size=640x480
rule=$(printf '%.0s-' {1..78})
echo "== a frame of $size as JPEG: milliseconds of its stages; and $seconds s of load by 4 clients"
printf '%-10s %8s %6s %6s %6s %6s %6s %6s %7s %8s\n' model samples cull warp shade fill code total kB frames/s
echo "$rule"
shot() { # what psr says beside a picture would break the table
	psr shot --server "$server" "$@" 2>"$out/notes.txt" || { cat "$out/notes.txt" >&2; exit 1; }
}
sheet=
for name in teapot top pencil wheel $real; do
	report=$out/$name.json
	# The first picture of a model reads it from the disk.
	shot --model "$name" --quality good --size $size --codec jpeg:90 -o "$out/$name.png"
	shot --model "$name" --quality good --size $size --codec jpeg:90 --report "$report" -o "$out/$name.png"
	shot --model "$name" --size 320x240 --background '#f4f4f0' --quality best -o "$out/$name-small.png"
	psr bench --server "$server" --model "$name" --clients 4 --seconds "$seconds" --size $size --json >"$out/$name-bench.json"
	printf '%-10s %8.0f %6.2f %6.2f %6.2f %6.2f %6.2f %6.2f %7.1f %8.1f\n' "$name" "$(of_model "$report" samples)" \
		"$(sum "$(stage "$report" plan)" "$(stage "$report" cull)")" "$(stage "$report" warp)" \
		"$(sum "$(stage "$report" resolve)" "$(stage "$report" shade)")" \
		"$(sum "$(stage "$report" gaps)" "$(stage "$report" fill)")" \
		"$(stage "$report" encode)" "$(stage "$report" total)" \
		"$(flat "$report" | sed -n 's/.*"error_px":[^,]*,"bytes":\([0-9]*\).*/\1/p' | awk '{ print $1 / 1000 }')" \
		"$(number "$out/$name-bench.json" frames_per_s)"
	sheet="$sheet $out/$name-small.png"
done
echo "$rule"

# shellcheck disable=SC2086
"$BUILD/tests/tools/sheet" 4 "$out/contact-sheet.png" $sheet
check=$(psr shot --server "$server" --model teapot --size 320x240 --codec lossless -o "$out/.again.png" --hash)
again=$(psr shot --server "$server" --model teapot --size 320x240 --codec lossless -o "$out/.again.png" --hash)
rm -f "$out/.again.png"
[ "$check" = "$again" ] && echo "two runs of one request: the same bytes ($check)"
stop
echo "pictures: $out/*.png, all of them in $out/contact-sheet.png"
