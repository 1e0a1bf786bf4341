#!/bin/bash
# make viewer-picture: docs/viewer.png, psr view at work: under Xvfb, with a hand of xdotool, on the model engine.
set -eu
cd "$(dirname "$0")/.."
BUILD=$(realpath "${BUILD:-build/release}")
PATH=$BUILD/bin:$PATH
models=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
[ -f "$models/engine.glb" ] || { echo "docs/viewer.sh: make models fetches engine.glb, which is not there" >&2; exit 3; }
unset PSR_SERVER
export XDG_CONFIG_HOME=/nonexistent # no defaults of the user
out=build/viewer
mkdir -p "$out"
[ "$out/engine.psr" -nt "$models/engine.glb" ] || psr-model build "$models/engine.glb" -r 1024 -o "$out/engine.psr"

work=$(mktemp -d)
psrd --listen "unix:$work/socket" --models "$out" >"$work/ready" 2>"$work/psrd.log" &
pids=$!
Xvfb -noreset -displayfd 3 -screen 0 1600x1000x24 -fbdir "$work" 3>"$work/display" 2>/dev/null &
pids="$! $pids"
trap 'kill $pids 2>/dev/null || :; wait; rm -rf "$work"' EXIT
until [ -s "$work/display" ] && [ -s "$work/ready" ]; do sleep 0.1; done
DISPLAY=:$(cat "$work/display")
export DISPLAY SDL_VIDEODRIVER=x11 SDL_RENDER_DRIVER=software

cd "$work"
psr view --server "unix:$work/socket" --model engine --size 1600x1000 --shadows --azimuth 30 --elevation 25 --zoom 0.7 \
	--background '#30353c' >"$work/log" 2>&1 &
pids="$! $pids"
for _ in $(seq 100); do xdotool search --name '^engine' >/dev/null && break || sleep 0.1; done
xdotool windowfocus "$(xdotool search --name '^engine')"
xdotool key p F2
for _ in $(seq 200); do grep -q '^psr shot' "$work/log" && break || sleep 0.1; done # it waits for the true picture
xdotool key m
xdotool mousemove 640 470 click 1
sleep 0.7
xdotool mousemove 815 590 click 1
sleep 0.7
xdotool mousemove 0 999
sleep 5
cd - >/dev/null
python3 tests/tools/screen.py "$work/Xvfb_screen0" 0 0 1600 1000 docs/viewer.png
ls -l docs/viewer.png
