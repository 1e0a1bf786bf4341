#!/bin/bash
# Loads psrd with more and more clients, and with more and more requests a second, and puts tables and plots into
# docs/load.md. Wants a machine that does nothing else.
set -eu
cd "$(dirname "$0")/.."
build=${BUILD:-build/release}
models=$build/load-models
source=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models/bunny.obj
page=docs/load.md
work=$(mktemp -d)
psrd=
trap '[ -z "$psrd" ] || kill $psrd; rm -rf "$work"' EXIT

mkdir -p "$models" docs/load
[ "$models/bunny.psr" -nt "$source" ] || "$build/bin/psr-model" build "$source" -r 1024 -o "$models/bunny.psr"
"$build/bin/psrd" --listen "unix:$work/socket" --models "$models" --cache "$work/cache" >"$work/ready" 2>"$work/log" &
psrd=$!
for _ in $(seq 200); do
	grep -q '^READY' "$work/ready" && break
	sleep 0.05
done
bench() { "$build/bin/psr" bench --server "unix:$work/socket" --model bunny --seconds 1.2 --warmup 0.3 "$@"; }

for size in 320x240 640x480 1280x720 1920x1080; do
	echo "load: clients, $size" >&2
	plot=()
	[ $size != 1280x720 ] || plot=(--plot docs/load/clients.svg)
	bench --size $size --sweep clients=1..64 "${plot[@]}" | tail -n +2 >"$work/table"
	docs/put-table.sh $page "clients, $size" "$work/table"
done
echo "load: requests a second" >&2
bench --size 1280x720 --clients 16 --poisson --sweep rate=20..320/9 --plot docs/load/rate.svg | tail -n +2 >"$work/table"
docs/put-table.sh $page "rate" "$work/table"
bench --size 1280x720 --clients 16 --poisson --rate 80 --seconds 6 --plot docs/load/latency.png | grep -v ' frames/s ' | tail -n +2 >"$work/table"
docs/put-table.sh $page "one load" "$work/table"
