#!/bin/bash
# psr-view on a screen of Xvfb, with a hand of xdotool. At rest the screen has the pixels of `psr shot`, which the command
# of a screenshot draws.
. "$(dirname "$0")/lib.sh"
. "$(dirname "$0")/window.sh"

needs "a window is turned, zoomed, resized" psr-view Xvfb xdotool
refuses "without a display a sentence says what to do" 3 "no display.*psr view --term" \
	timeout 10 env -u DISPLAY -u WAYLAND_DISPLAY -u SDL_VIDEODRIVER psr view --model teapot
refuses "two files" 2 "one file at a time" timeout 10 psr view a.ply b.ply
refuses "a path that is none" 4 "no path that --record wrote" timeout 10 psr view --play "$here/tests/e2e/lib.sh"

open_screen 400x320
# Mesa, where it is installed, leaks from a library that it unloads.
export SDL_VIDEODRIVER=x11 SDL_RENDER_DRIVER=software SDL_FRAMEBUFFER_ACCELERATION=0

# --- a hand ---
view() { # psr-view's options
	(cd "$work/shots" && exec psr view --bare "$@" >"$work/view.log" 2>"$work/view.err") &
	view_pid=$!
	within 20 xdotool search --name ' - psr-view$' # the title of a loop that runs: it takes keys
	window=$(xdotool search --name ' - psr-view$')
	within 10 has_focus
}
has_focus() { xdotool windowfocus "$window" && [ "$(xdotool getwindowfocus)" = "$window" ]; }
drag() { # button dx dy: from the middle, in steps
	xdotool mousemove --window "$window" 160 120 mousedown "$1"
	for _ in 1 2 3 4 5 6 7 8; do xdotool mousemove_relative --sync -- $(($2 / 8)) $(($3 / 8)); done
	xdotool mouseup "$1"
}
read_screen() { # [rows]: the window's pixels, or its upper rows, into $work/screen.ppm, without the mouse
	xdotool mousemove 0 0
	eval "$(xdotool getwindowgeometry --shell "$window")"
	read_pixels "$X" "$Y" "$WIDTH" "${1:-$HEIGHT}"
}
has_turned() { read_screen 100 && ! cmp -s "$work/screen.ppm" "$1"; } # what is written below is not looked at

start_psrd --models tests/golden --threads 2
address=$server
view --server "$address" --model teapot --size 320x240 --no-inertia
is_true "the first picture"
home=$command

# --- orbit, pan, zoom ---
drag 1 80 40
is_true "after an orbit"
differs "the eye went" "$(said eye)" "$(command=$home said eye)"
check "about the middle, as far from it as before" awk -v a="$(length "$(said eye)" "$(said target)")" \
	-v b="$(command=$home; length "$(said eye)" "$(said target)")" 'BEGIN { exit !((a / b - 1) ^ 2 < 1e-20) }'
before=$command
drag 3 -40 16
is_true "after a pan"
differs "the target went" "$(said target)" "$(command=$before said target)"
before=$command
xdotool mousemove --window "$window" 150 130 click 4 click 4 click 4 click 4
is_true "after a zoom"
check "the eye is nearer" awk -v a="$(said eye)" -v b="$(command=$before said eye)" 'BEGIN {
	split(a, p, ","); split(b, q, ","); exit !(p[3] < q[3]) }'

# --- light, stages ---
xdotool keydown l
drag 1 40 -24
xdotool keyup l
xdotool key x n Prior
is_true "with a light of its own, shadows, without smoothing"
check "says so" grep -q -- "--light dir:.*--ambient 0.2.*--shadows.*--no-smooth" <<<"${command//\'/}"
xdotool key t
is_true "a picture of blocks"
xdotool key t t t t t t t t k x n Next h
shot
check "all back is the first picture" [ "${command% -o *}" = "${home% -o *}" ]

# --- pick and measure ---
psr shot --server "$address" --model teapot --quality good --size 320x240 --depth "$work/depth.pfm" 2>/dev/null
depth=$(tail -c $((4 * 320 * 240)) "$work/depth.pfm" | od -An -v -tf4 -w$((4 * 320)) | tail -n +$((240 - 120)) |
	head -n 1 | awk '{ print $(160 + 1) }') # rows from the bottom
xdotool mousemove --window "$window" 160 120 click 1
within 3 grep -q '^point' "$work/view.log"
check "a click reads the depth of the picture" awk -v is="$(sed -n 's/^point.*depth \([^ ]*\).*/\1/p' "$work/view.log")" \
	-v true="$depth" 'BEGIN { exit !((is / true - 1) ^ 2 < 1e-12) }'
check "and a normal of length 1" awk -F'normal ' '/^point/ { split($2, n, ",")
	exit !((n[1] ^ 2 + n[2] ^ 2 + n[3] ^ 2 - 1) ^ 2 < 1e-6) }' "$work/view.log"
xdotool key m
sleep 0.6 # single clicks, not a double one
xdotool mousemove --window "$window" 140 120 click 1
sleep 0.6
xdotool mousemove --window "$window" 180 130 click 1
within 3 grep -q '^distance' "$work/view.log"
check "two clicks measure between them" awk '/^point/ { a = b; b = $2 } /^distance/ { d = $2 }
	END { split(a, p, ","); split(b, q, ",")
	exit !(d > 0 && (sqrt((p[1] - q[1]) ^ 2 + (p[2] - q[2]) ^ 2 + (p[3] - q[3]) ^ 2) / d - 1) ^ 2 < 1e-12) }' "$work/view.log"
xdotool key m

# --- another size; psrd goes and comes back ---
xdotool windowsize --sync "$window" 280 200
is_true "in a smaller window"
check "of its size" grep -q -- "--size 280x200" <<<"$command"
kill -9 $psrd_pid
wait $psrd_pid 2>/dev/null
check "a lost connection is said" within 5 sh -c "xdotool getwindowname $window | grep -q 'connection lost'"
read_screen 100
cp "$work/screen.ppm" "$work/lost.ppm"
drag 1 40 16
check "the last picture turns meanwhile" within 3 has_turned "$work/lost.ppm"
psrd --listen "$address" --models tests/golden --threads 2 >/dev/null 2>"$work/psrd.log" &
psrd_pid=$!
check "psrd comes back, and so does the connection" within 10 sh -c "! xdotool getwindowname $window | grep -q lost"
is_true "after that, from where it was turned to"

# --- a file is dropped ---
if type -P psr-model >/dev/null && [ -x "$BUILD/tests/tools/drop" ]; then
	printf '%s\n' 'v 0 0 0' 'v 1 0 0' 'v 1 1 0' 'v 0 1 0' 'v 0 0 3' 'v 1 0 3' 'v 1 1 3' 'v 0 1 3' 'f 4 3 2 1' \
		'f 5 6 7 8' 'f 1 2 6 5' 'f 2 3 7 6' 'f 3 4 8 7' 'f 4 1 5 8' >"$work/tower.obj"
	check "a window takes a file" "$BUILD/tests/tools/drop" "$window" "$work/tower.obj"
	check "and shows it" within 20 sh -c "xdotool getwindowname $window | grep -q '^tower'"
	is_true "a file that was dropped"
	check "the command names the file, and no psrd" \
		grep -q "^psr shot $work/tower.obj --model tower --size" <<<"$command"
fi
xdotool key Escape
ends "Escape ends it"

# --- lights and models by hand ---
hold_and_drag() { # key dx dy [modifier]
	xdotool keydown "$1" ${4:+keydown "$4"}
	drag 1 "$2" "$3"
	xdotool ${4:+keyup "$4"} keyup "$1"
}
lamp() { sed -n "s/.*--light '*\([^ ']*\).*/\1/p" <<<"$command"; }
models() { grep -oE -- "--(model|instance) '?[^ ']*" <<<"$command"; }
: >"$work/view.log"
rm "$work"/shots/*
n_shots=0
view --server "$address" --model teapot --instance wheel,at=0,0,4 --light spot:0,9,9:0,0,0:30 --size 320x240 --no-inertia
is_true "a spot before two models"
check "is where it was said to be" [ "$(lamp)" = spot:0,9,9:0,0,0:30 ]
hold_and_drag l 40 -24
is_true "a spot that was moved"
moved=$(lamp)
differs "it moved" "$moved" spot:0,9,9:0,0,0:30
hold_and_drag l 24 8 shift
is_true "a spot that was turned"
check "stays where it is" [ "$(lamp | cut -d: -f2)" = "$(cut -d: -f2 <<<"$moved")" ]
differs "and shines elsewhere" "$(lamp | cut -d: -f3)" "$(cut -d: -f3 <<<"$moved")"
hold_and_drag g 40 0
shot
before=$(models)
check "without a click no model moves" grep -q "wheel,at=0,0,4$" <<<"$before"
sleep 0.6 # not a double click with the drag before
xdotool mousemove --window "$window" 160 120 click 1
check "a click chooses the model in front" within 3 grep -q '^point' "$work/view.log"
is_drawn() { # claim: the screenshot is of the command; a box on the screen shows which model was chosen
	shot
	check "$1: psr shot draws the same, bit for bit" draws_the_same
}
hold_and_drag g 40 0
is_drawn "a model that was moved"
differs "it moved" "$(models)" "$before"
hold_and_drag g 32 16 shift
is_drawn "a model that was turned"
check "says so" grep -q rotate= <<<"$(models)"
hold_and_drag g 0 -40 ctrl
is_drawn "a model that was made larger"
check "says so, too" awk -v s="$(models | sed -n 's/.*scale=//p')" 'BEGIN { exit !(s > 1.05 && s < 1.2) }'
xdotool key Escape
ends "and ends"

# --- colours that tell a number ---
: >"$work/view.log"
rm "$work"/shots/*
n_shots=0
view --server "$address" --model scan --color-by class --size 320x240 --no-inertia
colored() { # claim number: the screen, its screenshot and psr shot have these colours, and a legend
	is_true "$1"
	is "of $1 the command says so" "$2" "$(said color-by)"
}
colored "a scan by class" class
sh -c "${command% -o *} --no-legend -o '$work/plain.ppm'" 2>/dev/null
check "has a legend in the window, too" python3 - "$work/screen.ppm" "$work/plain.ppm" <<'END'
import sys
a, b = (open(path, "rb").read()[-3 * 320 * 240:] for path in sys.argv[1:])
changed = [i // 3 for i in range(0, len(a), 3) if a[i:i + 3] != b[i:i + 3]]
assert len(changed) > 1000 and all(i % 320 < 160 and i // 320 > 100 for i in changed), len(changed)
END
for by in height return; do
	xdotool key v
	colored "its next number, $by" $by
done
xdotool key v
is_true "and after the last one its own colours"
check "of which the command says nothing" sh -c '! grep -q color-by <<END
'"$command"'
END'
xdotool key v
colored "and the first one again, intensity" intensity
xdotool key Escape
ends "and ends, too"
: >"$work/view.log"
rm "$work"/shots/*
n_shots=0
view --server "$address" --model teapot --color-by class --size 320x240 --no-inertia
shot
check "a model without classes is shown in its own colours" sh -c '! grep -q color-by <<END
'"$command"'
END'
xdotool key v
colored "by height, which any model has" height
xdotool key Escape
ends "the end of the colours"

# --- octrees as splats ---
: >"$work/view.log"
rm "$work"/shots/*
n_shots=0
view --server "$address" --model knot --splats --size 320x240 --no-inertia
is_true "an octree as splats"
check "of which the command says so" grep -q -- ' --splats' <<<"$command"
cp "$work/true.png" "$work/splats.png"
xdotool key r
is_true "and as points"
check "says nothing of splats" sh -c '! grep -q splats <<END
'"$command"'
END'
check "which is another picture" sh -c "! cmp -s '$work/splats.png' '$work/true.png'"
xdotool key r
is_true "and as splats again"
check "the same ones" cmp "$work/splats.png" "$work/true.png"
xdotool key Escape
ends "the end of the splats"

# --- a way of the camera ---
view --server "$address" --model wheel --size 320x240 --no-inertia --record "$work/way.json"
n_shots=0
rm "$work"/shots/*
shot
drag 1 64 32
shot
last=$command
xdotool key F5
check "a way is recorded" within 3 test -s "$work/way.json"
xdotool key h space
sleep 0.3
shot
check "and played to its end" [ "$(said eye)" = "$(command=$last said eye)" ]
xdotool key Escape
ends "the end is quiet"
check "nothing is said on standard error" test ! -s "$work/view.err"

# --- a display that goes ---
rm "$work/way.json" "$work"/shots/*
n_shots=0
view --server "$address" --model wheel --size 320x240 --no-inertia --record "$work/way.json"
shot
kill -KILL $xvfb_pid
wait $view_pid
is "without its display the viewer ends" 3 $?
view_pid= xvfb_pid=
check "and says why" grep -q 'the display is gone' "$work/view.err"
check "the way that it recorded is kept" test -s "$work/way.json"
check "psrd stops cleanly" stop_psrd
