#!/bin/bash
# Measures what a viewer shows along movements of a hand, psrd behind a relay that delays and slows down (all links of
# docs/latency.md, or those named as MS:MBIT), and puts the tables into that page. Wants a machine that does nothing
# else.
set -eu
cd "$(dirname "$0")/.."
build=${BUILD:-build/release}
models=$build/latency-models
cache=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
page=docs/latency.md
work=$(mktemp -d)
pids=
stop() {
	[ -z "$pids" ] || { kill $pids && wait $pids; } 2>/dev/null || :
	pids=
}
trap 'stop; rm -rf "$work"' EXIT

# A wall with a door, and a room behind it, of small squares in two shades, each seen from inside.
doorway() {
	awk 'BEGIN {
		patch(-2, -1, 3, 4, 0, 0, 0, 0, -5, 200, 170, 120)  # floor
		patch(-2, 1, -2, 4, 0, 0, 0, 0, 5, 230, 230, 230)   # ceiling
		patch(-2, -1, 3, 0, 0, -5, 0, 2, 0, 150, 180, 200)  # left
		patch(2, -1, -2, 0, 0, 5, 0, 2, 0, 180, 150, 200)   # right
		patch(-2, -1, -2, 4, 0, 0, 0, 2, 0, 120, 190, 120)  # back
		patch(-2, -1, 1, 4, 0, 0, 0, 2, 0, 210, 110, 90)    # with the door
		print "ply\nformat ascii 1.0\nelement vertex", n
		print "property float x\nproperty float y\nproperty float z"
		print "property uchar red\nproperty uchar green\nproperty uchar blue"
		print "element face", n / 4 "\nproperty list uchar int vertex_indices\nend_header"
		for (i = 0; i < n; i++) print vertex[i]
		for (i = 0; i < n; i += 4) print 4, i, i + 1, i + 2, i + 3
	}
	function corner(x, y, z, shade, r, g, b) {
		vertex[n++] = sprintf("%.3f %.3f %.3f %d %d %d", x, y, z, shade * r, shade * g, shade * b)
	}
	function length_of(x, y, z) { return sqrt(x * x + y * y + z * z) }
	function patch(x, y, z, ux, uy, uz, vx, vy, vz, r, g, b,    i, j, k, nu, nv, u, v, shade, s, t) {
		nu = int(10 * length_of(ux, uy, uz) + 0.5); nv = int(10 * length_of(vx, vy, vz) + 0.5)
		for (i = 0; i < nu; i++) for (j = 0; j < nv; j++) {
			s = x + ux * (i + 0.5) / nu + vx * (j + 0.5) / nv; t = y + uy * (i + 0.5) / nu + vy * (j + 0.5) / nv
			if (r == 210 && s > -0.5 && s < 0.5 && t < 0.6) continue
			shade = (i + j) % 2 ? 1 : 0.7
			for (k = 0; k < 4; k++) {
				u = (i + (k == 1 || k == 2)) / nu; v = (j + (k >= 2)) / nv
				corner(x + ux * u + vx * v, y + uy * u + vy * v, z + uz * u + vz * v, shade, r, g, b)
			}
		}
	}' >"$1"
}

build_model() { # source resolution
	local model
	model=$models/$(basename "${1%.*}").psr
	[ "$model" -nt "$1" ] || "$build/bin/psr-model" build "$1" -r "$2" -o "$model"
}
mkdir -p "$models/sources"
[ -f "$models/sources/doorway.ply" ] || doorway "$models/sources/doorway.ply"
build_model "$models/sources/doorway.ply" 512
build_model "$cache/bunny.obj" 1024
build_model "$cache/dragon.ply" 1024
build_model "$cache/engine.glb" 1024

# Starts a program and waits for its READY; sets `address`.
start() { # ready-file command...
	local ready=$1
	shift
	"$@" >"$ready" 2>"$ready.log" &
	pids="$! $pids"
	for _ in $(seq 100); do
		address=$(sed -n 's/^READY //p' "$ready")
		[ -z "$address" ] || return 0
		sleep 0.1
	done
	echo "latency: $1 does not start: $(tail -n 1 "$ready.log")" >&2
	exit 1
}

[ $# -gt 0 ] || set -- {0,50,100,200}:{1000,50,10}
for one; do
	delay=${one%:*} rate=${one#*:}
	echo "latency: $delay ms, $rate Mbit/s" >&2
	start "$work/psrd" "$build/bin/psrd" --listen "unix:$work/socket" --models "$models" --cache "$work/cache"
	start "$work/relay" "$build/tests/tools/relay" --to "$address" --delay "$(awk "BEGIN { print $delay / 2 }")" \
		--rate-down "$rate"
	{
		printf '%-8s %6s %8s %6s %6s %7s %8s %9s %6s %8s\n' '' shown/s new/s age warp 'filled' warped unwarped more sharp
		"$build/tests/bench/latency" "$address" "$models" docs/hands
	} >"$work/table"
	stop
	docs/put-table.sh $page "$delay ms, $rate Mbit/s" "$work/table"
done
