#!/bin/bash
# Records the movements of docs/hands: psr view under Xvfb, with a hand of xdotool whose events come unevenly, as a
# mouse's do that a person moves: 4 to 20 ms apart, in steps that grow, shrink and waver. docs/latency.sh plays them.
set -eu
cd "$(dirname "$0")/.."
BUILD=$(realpath "${BUILD:-build/release}")
PATH=$BUILD/bin:$PATH
models=$BUILD/latency-models
[ -f "$models/bunny.psr" ] && [ -f "$models/doorway.psr" ] ||
	{ echo "docs/hands.sh: make latency builds its models, which are not there" >&2; exit 3; }
hands=$PWD/docs/hands
work=$(mktemp -d)
psrd --listen "unix:$work/socket" --models "$models" >"$work/ready" 2>/dev/null &
pids=$!
Xvfb -noreset -displayfd 3 -screen 0 1280x720x24 3>"$work/display" 2>/dev/null &
pids="$! $pids"
trap 'kill $pids 2>/dev/null || :; wait; rm -rf "$work"' EXIT
until [ -s "$work/display" ] && [ -s "$work/ready" ]; do sleep 0.1; done
DISPLAY=:$(cat "$work/display")
export DISPLAY SDL_VIDEODRIVER=x11 SDL_RENDER_DRIVER=software
RANDOM=7

# A stroke of dx, dy pixels in about so many ms. even: at the same speed all along; else slow, fast, slow.
stroke() { # dx dy ms [even]
	awk -v dx="$1" -v dy="$2" -v ms="$3" -v even="${4:-}" -v seed=$RANDOM 'BEGIN {
		srand(seed)
		for (t = 0; t < ms; ) {
			wait = 4 + int(16 * rand() * rand()); t += wait
			p = t > ms ? 1 : t / ms; part = even ? p : p * p * p * (10 - 15 * p + 6 * p * p)
			waver = p < 1 ? (rand() - 0.5) * 3 : 0
			x = int(dx * part + waver); y = int(dy * part + waver / 2)
			printf "mousemove_relative -- %d %d sleep %.3f ", x - px, y - py, wait / 1000
			px = x; py = y
		}
	}' >"$work/stroke"
	xdotool $(cat "$work/stroke")
}

record() { # name model options of psr view...
	name=$1
	model=$2
	shift 2
	(cd "$work" && exec psr view --bare --server "unix:$work/socket" --model "$model" --size 1280x720 --record way.json "$@") \
		>/dev/null 2>&1 &
	view=$!
	until xdotool search --name "^$model - psr-view" >/dev/null 2>&1; do sleep 0.1; done
	xdotool windowfocus "$(xdotool search --name "^$model - psr-view")"
	sleep 2 # the first pictures
	xdotool mousemove 500 360
	"$name"
	sleep 0.3
	xdotool key Escape
	wait $view
	# What stands still at either end is left out.
	python3 - "$work/way.json" "$hands/$name.json" <<'PYTHON'
import json, sys
poses = json.load(open(sys.argv[1]))["poses"]
still = [{k: v for k, v in p.items() if k != "seconds"} for p in poses]
first = next(i for i, s in enumerate(still) if s != still[0]) - 1
last = next(i for i in range(len(still) - 1, 0, -1) if still[i] != still[-1]) + 1
begin = poses[first]["seconds"] if first > 0 else 0
# The first pose may be the end of a long rest.
begin = max(begin, poses[first + 1]["seconds"] - 0.016)
lines = [json.dumps({**p, "seconds": round(max(p["seconds"] - begin, 0), 4)}) for p in poses[first:last + 1]]
open(sys.argv[2], "w").write('{"poses": [\n' + ",\n".join(lines) + "\n]}\n")
PYTHON
}

pan() { xdotool mousedown 3; stroke 250 -60 1500; xdotool mouseup 3; }
dragon() { orbit; }
engine() { orbit; }
orbit() { xdotool mousedown 1; stroke 180 6 1500 even; xdotool mouseup 1; }
flick() { xdotool mousedown 1; stroke 200 -8 250 even; xdotool mouseup 1; sleep 1.2; }
zoom() {
	xdotool mousemove 700 300
	for wait in 0.21 0.13 0.16 0.24 0.11 0.19 0.15 0.2; do xdotool click 4 sleep $wait; done
}
doorway() { xdotool keydown w; sleep 1.5; xdotool keyup w; }

record pan bunny --azimuth 20 --elevation 15
record orbit bunny --azimuth 20 --elevation 15 --no-inertia
record dragon dragon --azimuth 20 --elevation 15 --no-inertia
record engine engine --azimuth 20 --elevation 15 --no-inertia
record flick bunny --azimuth 20 --elevation 15
record zoom bunny --azimuth 20 --elevation 15
record doorway doorway --eye 0.1,0,2.6 --target 0,-0.1,-2 --up 0,1,0 --fov 57.3
ls -l "$hands"
