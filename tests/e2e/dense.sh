#!/bin/bash
# psr-view on a screen with two pixels a point: SDL on Wayland, in a compositor of scale 2 whose only window it fills. The
# frame has the pixels of the screen, and what the hand points at is told in pixels, too.
. "$(dirname "$0")/lib.sh"
. "$(dirname "$0")/window.sh"

needs "a window of two pixels a point" psr-view Xvfb xdotool weston
width=640 height=480 # pixels
export XDG_RUNTIME_DIR=$work/run
# SDL on Wayland brings libraries that leak and are unloaded, so no suppression can name them: view.sh looks for leaks.
export ASAN_OPTIONS=${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0
mkdir -m 700 "$XDG_RUNTIME_DIR"
read_screen() { read_pixels 0 0 $width $height; }
has_drawn() { read_screen && [ "$(tail -c +16 "$work/screen.ppm" | od -An -v -tx1 -w3 | sort -u | head -n 20 | wc -l)" -ge 20 ]; }
drag() { # dx dy, pixels of the screen: from the middle, in steps
	xdotool mousemove $((width / 2)) $((height / 2)) mousedown 1
	for _ in 1 2 3 4 5 6 7 8; do xdotool mousemove_relative --sync -- $(($1 / 8)) $(($2 / 8)); done
	xdotool mouseup 1
	go_out
}
go_out() { xdotool mousemove $((width - 1)) $((height - 1)); } # the compositor draws its cursor into the last rows
screen_is() { read_screen && cmp -s -n $((15 + 3 * width * (height - 12))) "$work/screen.ppm" "$1"; }
has_points() { [ "$(grep -c '^point' "$work/view.log")" -ge "$1" ]; }

open_screen ${width}x$height
printf '%s\n' '[core]' idle-time=0 >"$work/weston.ini"
weston --backend=x11-backend.so --shell=kiosk-shell.so --use-pixman --scale=2 --width=$((width / 2)) \
	--height=$((height / 2)) --config="$work/weston.ini" --socket=dense >"$work/weston.log" 2>&1 &
compositor_pid=$!
if ! within 20 test -S "$XDG_RUNTIME_DIR/dense"; then
	skip "a window of two pixels a point" "weston does not run: $(tail -n 1 "$work/weston.log")"
	exit
fi
start_psrd --models tests/golden --threads 2
(cd "$work/shots" && WAYLAND_DISPLAY=dense SDL_VIDEODRIVER=wayland exec psr view --bare --server "$server" --model teapot \
	--size 200x160 --no-inertia >"$work/view.log" 2>"$work/view.err") &
view_pid=$!
if ! within 20 has_drawn && grep -q 'no window can be opened' "$work/view.err"; then
	skip "a window of two pixels a point" "$(cat "$work/view.err")"
	exit
fi
check "a picture comes" has_drawn
go_out
is_true "two pixels a point"
check "of the screen's pixels, not its points" grep -q -- "--size ${width}x$height" <<<"$command"
home=$command

drag 80 40
is_true "after an orbit"
differs "the eye went" "$(said eye)" "$(command=$home said eye)"

# The cursor is told in points: x of the screen is point x / 2, whose middle is pixel x + 1 of an even x.
eval "${command% -o *} --depth '$work/depth.pfm' -o '$work/true.png'" 2>/dev/null
at_x=280 at_y=300
depth=$(tail -c $((4 * width * height)) "$work/depth.pfm" | od -An -v -tf4 -w$((4 * width)) |
	tail -n +$((height - at_y - 1)) | head -n 1 | awk -v x=$at_x '{ print $(x + 2) }') # rows from the bottom
sleep 0.6 # not a double click with the drag before
xdotool mousemove $at_x $at_y mousedown 1
sleep 0.15 # as long as a hand takes and longer: nothing moves, so the picture stays as good as it is
xdotool mouseup 1
within 5 has_points 1
check "a click reads the depth of the pixel below the cursor" awk -v true="$depth" \
	-v is="$(sed -n 's/^point.*depth \([^ ]*\).*/\1/p' "$work/view.log")" 'BEGIN { exit !((is / true - 1) ^ 2 < 1e-12) }'
xdotool click 4
sleep 0.1
xdotool click 4
before=$command
shot
differs "a wheel zooms" "$(said eye)" "$(command=$before said eye)"
sleep 0.6
xdotool mousemove $at_x $at_y click 1
within 5 has_points 2
check "towards what is below the cursor: it stays there" awk \
	-v d="$(length $(sed -n 's/^point \([^ ]*\).*/\1/p' "$work/view.log"))" 'BEGIN { print d; exit !(d > 0 && d < 0.03) }'
xdotool key Escape
ends "Escape ends it"
check "psrd stops cleanly" stop_psrd
