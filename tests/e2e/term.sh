#!/bin/bash
# psr view --term in a terminal that tests/tools/terminal.py plays: what it draws is what psr shot draws.
. "$(dirname "$0")/lib.sh"

if ! type -P psr-view-term >/dev/null; then
	skip "psr-view-term draws in a terminal" "libchafa-dev is not there"
	exit 0
fi
export TERM=xterm-256color COLORTERM=truecolor
terminal() { python3 tests/tools/terminal.py "$@"; }
says() { # claim pattern command...: succeeds, and prints a line like that
	local claim=$1 pattern=$2
	shift 2
	if "$@" >"$work/said" 2>"$work/err" && grep -qE "$pattern" "$work/said"; then
		ok "$claim"
	else
		not_ok "$claim" "$(cat "$work/said" "$work/err" | head -n 5)"
	fi
}
# Mean squared difference of two PPM files of one size, "different sizes" if they are not.
difference() {
	python3 - "$1" "$2" <<-'END'
		import sys
		a, b = (open(name, "rb").read().split(b"\n", 3) for name in sys.argv[1:])
		print("different sizes" if a[1] != b[1] else sum((x - y) ** 2 for x, y in zip(a[3], b[3])) / len(a[3]))
	END
}
# At most so much: sixels have colours of 0 to 100 and a palette of 256 for all of the picture. A step of 5 either way has
# a mean squared error of a third of 25; the palette may double it twice.
is_near() { awk -v d="$(difference "$1" "$2")" 'BEGIN { exit !(d ~ /^[0-9.]+$/ && d < 34) }'; }

if ! python3 -c 'import pty, os; os.close(pty.openpty()[0])' 2>/dev/null; then
	skip "psr-view-term draws in a terminal" "there are no pseudo-terminals here"
	exit 0
fi
start_psrd --models tests/golden --threads 2
view=(psr view --term --server "$server" --model teapot)

says "a turn by keys, a wheel, a drag without inertia, a side, another size of the terminal, and q" "^exit 0" \
	terminal 60x21 480x336 "wait:sharp keys:i\x1b[C wait:sharp keys:\x1b[<64;30;10M wait:sharp
	keys:\x1b[<0;30;10M\x1b[<32;33;11M\x1b[<0;33;11m wait:sharp keys:3 wait:sharp picture:$work/kitty.ppm
	size:40x11:320x176 wait:sharp picture:$work/small.ppm keys:q" "${view[@]}" --pixels kitty
check "the terminal is as before" grep -q '^restored' "$work/said"
psr shot --quality good --server "$server" --model teapot --view left --size 480x320 -o "$work/shot.ppm" 2>/dev/null
check "kitty's picture has the same pixels as psr shot's" cmp "$work/kitty.ppm" "$work/shot.ppm"
is_size() { [ "$(head -n 2 "$1" | tail -n 1)" = "$2" ]; }
check "and the new size" is_size "$work/small.ppm" "320 160"
says "sixels are drawn, as the terminal says that it has them; SIGTERM ends it" "^exit 0" terminal 40x13 320x208 \
	"wait:sharp picture:$work/sixel.ppm signal:SIGTERM" "${view[@]}" --view left
check "the terminal is as before, too" grep -q '^restored' "$work/said"
psr shot --quality good --server "$server" --model teapot --view left --size 320x192 -o "$work/shot.ppm" 2>/dev/null
check "they are near to psr shot's" is_near "$work/sixel.ppm" "$work/shot.ppm"
says "colours by class, and by the key height" "^exit 0" terminal 60x21 480x336 "wait:sharp picture:$work/class.ppm
	keys:v wait:coloured_by_height picture:$work/height.ppm keys:q" psr view --term --server "$server" --model scan \
	--color-by class --pixels kitty
psr shot --quality good --server "$server" --model scan --color-by class --size 480x320 -o "$work/shot.ppm" 2>/dev/null
check "with the legend of psr shot" cmp "$work/class.ppm" "$work/shot.ppm"
# The second key does nothing but take the note away.
says "an octree as splats, and by the key points" "^exit 0" terminal 60x21 480x336 "wait:sharp
	picture:$work/splats.ppm keys:rx wait:sharp picture:$work/points.ppm keys:q" psr view --term --server "$server" \
	--model knot --splats --pixels kitty
for way in splats points; do
	flag=$(grep splats <<<"--$way")
	psr shot --quality good --server "$server" --model knot $flag --size 480x320 -o "$work/shot.ppm" 2>/dev/null
	check "$way are those of psr shot" cmp "$work/$way.ppm" "$work/shot.ppm"
done
is_far() { ! is_near "$@"; }
psr shot --quality good --server "$server" --model teapot --view right --size 320x192 -o "$work/other.ppm" 2>/dev/null
check "and not to another side's" is_far "$work/sixel.ppm" "$work/other.ppm"
says "symbols are drawn; a crash ends as one" "^exit -11" terminal 40x13 0x0 "wait:sharp signal:SIGSEGV" "${view[@]}" \
	--pixels symbols
check "and leaves the terminal as before" grep -q '^restored' "$work/said"
says "an unknown model is told" "^exit 0" terminal 60x13 480x208 "wait:no_model_pot keys:q" \
	psr view --term --server "$server" --model pot
says "a psrd that dies is told, and the viewer goes on" "^exit 0" terminal 60x13 480x208 \
	"wait:sharp run:kill_-KILL_$psrd_pid wait:connection_lost keys:3q" "${view[@]}"
wait $psrd_pid 2>/dev/null
psrd_pid=
says "a file is viewed by a psrd of its own" "^exit 0" terminal 60x13 480x208 "wait:sharp keys:q" \
	psr view --term tests/golden/teapot.psr
refuses "without a terminal it says so" 3 "no terminal" psr view --term --server "$server" --model teapot </dev/null
refuses "a way that is none" 2 "kitty, sixel and symbols" psr view --term --pixels ansi --model teapot
