#!/bin/bash
# Cameras that people type, and several pictures of a model: sides and angles, turntables, contact sheets, camera files,
# standard output.
. "$(dirname "$0")/lib.sh"
size=64x48

shot() { psr shot --server "$server" --size $size "$@"; }
turntable() { psr turntable --server "$server" --size $size "$@"; }
color() { shot "$@" --hash 2>/dev/null | sed -n 's/^color //p'; }

# Whether the edges of a .ppm of 64x48 are background, and its inside is not.
is_whole() {
	tail -c $((64 * 48 * 3)) "$1" | od -An -v -tu1 -w3 | awk '
		{ x = (NR - 1) % 64; y = int((NR - 1) / 64); other = $1 != 32 || $2 != 36 || $3 != 40 }
		other && (x == 0 || x == 63 || y == 0 || y == 47) { cut++ }
		other { inside++ }
		END { exit !(NR == 64 * 48 && inside > 100 && !cut) }'
}

start_psrd --models tests/golden --threads 2

# --- the whole model is in the picture ---
for model in teapot wheel; do
	for camera in "" "--up 0,0,1" "--up 1,0,0" "--up 0,-1,0" "--up 1,2,-3" "--azimuth 137" "--elevation 90" \
		"--elevation -60 --roll 30" "--view left --up 0,0,1" "--view iso --ortho fit" "--up 1,1,0 --ortho fit --roll 45"; do
		# shellcheck disable=SC2086
		shot --model $model $camera --no-smooth -o "$work/a.ppm" 2>"$work/err"
		check "$model is whole: ${camera:-without a camera}" is_whole "$work/a.ppm"
	done
done
teapot=$(color --model teapot)
is "home is the view without a camera" "$teapot" "$(color --model teapot --view home)"
is "zoom 1 changes nothing" "$teapot" "$(color --model teapot --zoom 1)"
is "front is azimuth 0, level" "$(color --model teapot --view front)" "$(color --model teapot --azimuth 0 --elevation 0)"
is "left is azimuth -90" "$(color --model teapot --view left)" "$(color --model teapot --azimuth -90 --elevation 0)"
shot --model teapot --zoom 3 --no-smooth -o "$work/a.ppm" 2>"$work/err"
is_cut() { ! is_whole "$1"; }
check "zoom 3 is cut off" is_cut "$work/a.ppm"
is "a target is in the middle" "$(color --model teapot --azimuth 0 --elevation 0 --target 0,1,0)" \
	"$(color --model teapot --view front --target 0,1,0)"
refuses "two ways to say where the camera is" 2 "--eye excludes --azimuth" shot --model teapot --eye 1,2,3 --azimuth 4 --hash
refuses "a side and an angle" 2 "--view excludes --azimuth" shot --model teapot --view top --azimuth 4 --hash
refuses "a side that is none" 2 "not 'side'" shot --model teapot --view side --hash
refuses "a camera of the model and a zoom" 2 "--camera is a whole camera" shot --model teapot --camera home --zoom 2 --hash
check "the camera home sees the whole model, too" shot --model teapot --camera home --no-smooth -o "$work/a.ppm"
check "indeed" is_whole "$work/a.ppm"

# --- the model's own way up ---
if type -P psr-model >/dev/null; then
	mkdir "$work/up"
	cp tests/golden/teapot.psr "$work/up/y.psr"
	# A tower, three times as high as wide, its height along z.
	printf '%s\n' 'v 0 0 0' 'v 1 0 0' 'v 1 1 0' 'v 0 1 0' 'v 0 0 3' 'v 1 0 3' 'v 1 1 3' 'v 0 1 3' 'f 4 3 2 1' \
		'f 5 6 7 8' 'f 1 2 6 5' 'f 2 3 7 6' 'f 3 4 8 7' 'f 4 1 5 8' >"$work/tower.obj"
	check "a tower is built, its way up +z" psr-model build "$work/tower.obj" --up 0,0,1 -r 64 -o "$work/up/z.psr" --quiet
	golden=$server golden_pid=$psrd_pid
	start_psrd --models "$work/up"
	shot --model z --view front --ortho fit --no-smooth -o "$work/a.ppm"
	# It is higher than wide in the picture.
	check "and stands upright without --up" awk '
		{ x = (NR - 1) % 64; y = int((NR - 1) / 64) }
		$1 != 32 || $2 != 36 || $3 != 40 { columns[x] = 1; rows[y] = 1 }
		END { exit !(length(rows) > 2 * length(columns)) }' <(tail -c $((64 * 48 * 3)) "$work/a.ppm" | od -An -v -tu1 -w3)
	is "--up 0,0,1 is the same" "$(color --model z)" "$(color --model z --up 0,0,1)"
	is "turned upright beside a model of another way up it is the same from the front" "$(color --model z --view front)" \
		"$(color --instance z,rotate=X:-90 --view front --up 0,1,0)"
	check "psrd of two ways up stops cleanly" stop_psrd
	server=$golden psrd_pid=$golden_pid
fi

# --- several pictures over one connection ---
check "three sides are numbered" shot --model teapot --view front,left,top -o "$work/side_%d.ppm" --report "$work/side_%d.json"
is "from 1 on" "side_1.ppm side_2.ppm side_3.ppm" "$(cd "$work" && echo side_?.ppm)"
for k in 1:front 2:left 3:top; do
	shot --model teapot --view ${k#*:} -o "$work/a.ppm"
	check "picture ${k%:*} is the ${k#*:}" cmp "$work/a.ppm" "$work/side_${k%:*}.ppm"
done
is "their hashes are numbered, too" "1 color $(color --model teapot --view front)" \
	"$(shot --model teapot --view front,left --hash | head -n 1)"
refuses "one file for three pictures" 2 "is one file for 3 pictures" shot --model teapot --view front,left,top -o "$work/x.png"
refuses "one report for two pictures" 2 "--report.*is one file for 2 pictures" \
	shot --model teapot --view front,left --report "$work/x.json"
refuses "a name of two numbers" 2 "one %d or %03d" shot --model teapot --view front,left -o "$work/%d_%d.png"
check "they are put on a sheet" shot --model teapot --view front,left,top --sheet 2x2 -o "$work/sheet.ppm"
is "of four places" "P6 128 96 255" "$(head -n 3 "$work/sheet.ppm" | tr '\n' ' ' | sed 's/ $//')"
tile() { # column row: the pixels of a place
	tail -c $((128 * 96 * 3)) "$work/sheet.ppm" | od -An -v -tx1 -w$((128 * 3)) |
		awk -v row="$2" 'int((NR - 1) / 48) == row' | cut -c $((1 + $1 * 576))-$((576 + $1 * 576)) | tr -d ' \n'
}
pixels() { tail -c $((64 * 48 * 3)) "$1" | od -An -v -tx1 | tr -d ' \n'; }
check "the first above, to the left" [ "$(tile 0 0)" = "$(pixels "$work/side_1.ppm")" ]
check "the third below" [ "$(tile 0 1)" = "$(pixels "$work/side_3.ppm")" ]
refuses "a sheet that is too small" 2 "2x1 has places for 2 pictures, and there are 3" \
	shot --model teapot --view front,left,top --sheet 2x1 -o "$work/x.png"

cat >"$work/cameras" <<-END
	# three cameras
	azimuth=30 elevation=20 zoom=2
	eye=5,4,6 target=0,1,0 fov=30   # in coordinates

	view=top ortho=fit
END
check "a file of cameras is drawn" shot --model teapot --cameras "$work/cameras" -o "$work/camera_%02d.ppm"
shot --model teapot --eye 5,4,6 --target 0,1,0 --fov 30 -o "$work/a.ppm"
check "each as from the command line" cmp "$work/a.ppm" "$work/camera_02.ppm"
is "no more than it has" 3 "$(find "$work" -name 'camera_*' | wc -l)"
echo "azimuth=30 elevatoin=20" >"$work/cameras"
refuses "an error in it has its place" 2 "cameras:1:12: unknown option elevatoin; did you mean elevation" \
	shot --model teapot --cameras "$work/cameras" -o "$work/x_%d.png"

# --- turntables ---
check "a turntable is drawn" turntable --model teapot --frames 5 -o "$work/turn_%02d.ppm"
is "five pictures" 5 "$(find "$work" -name 'turn_*.ppm' | wc -l)"
is "all different" 5 "$(cat "$work"/turn_*.ppm | split -b $((13 + 64 * 48 * 3)) --filter=md5sum | sort -u | wc -l)"
for k in 1 2 3 4 5; do check "whole in picture $k" is_whole "$work/turn_0$k.ppm"; done
check "an animation is written" turntable --model teapot --frames 5 -o "$work/turn.png"
is "of five frames: five controls of frames, four of them with data of their own" "5 4" \
	"$(grep -a -o fcTL "$work/turn.png" | wc -l) $(grep -a -o fdAT "$work/turn.png" | sort | uniq -c | awk '{ print ($1 >= 4 ? 4 : $1) }')"
check "again, the same bytes" turntable --model teapot --frames 5 -o "$work/again.png"
check "indeed" cmp "$work/turn.png" "$work/again.png"
check "and to standard output" bash -c "psr turntable --server $server --size $size --model teapot --frames 5 -o - >$work/again.png"
check "indeed the same" cmp "$work/turn.png" "$work/again.png"
if [ -f "$BUILD/lib/psr-image-oiio.so" ]; then
	check "a GIF is written" turntable --model teapot --frames 5 -o "$work/turn.gif"
	is "which is one" GIF89a "$(head -c 6 "$work/turn.gif")"
	refuses "what does not move" 4 "has no animations" turntable --model teapot -o "$work/x.jpg"
fi
check "a sheet has as many pictures as places" turntable --model teapot --sheet 3x2 -o "$work/turn.ppm" --hash
is "six" 6 "$(grep -c color "$work/out")"
turntable --model teapot --frames 4 --eye 5,4,6 --report "$work/turn_%d.json" --hash >"$work/turns" 2>/dev/null
is "a turntable of an eye begins there" "1 color $(color --model teapot --eye 5,4,6 2>/dev/null)" "$(head -n 1 "$work/turns")"
# A quarter about +Y turns +z to +x and +x to -z. The report tells 17 digits.
check "and is to the right of it a quarter later" awk -v eye="$(array "$work/turn_2.json" eye)" \
	-v target="$(array "$work/turn_2.json" target)" 'BEGIN {
		split(eye, e, " "); split(target, t, " ")
		x = t[1] + (6 - t[3]); z = t[3] - (5 - t[1])
		exit !((e[1] - x) ^ 2 + (e[2] - 4) ^ 2 + (e[3] - z) ^ 2 < 1e-24)
	}'
has_tty() { script -qec true /dev/null >/dev/null 2>&1 </dev/null; } # some containers have no /dev/pts
if has_tty; then
	script -qec "psr turntable --server $server --size $size --model teapot --frames 3 -o $work/tty_%d.png" /dev/null \
		>"$work/tty" 2>&1 </dev/null
	check "a terminal sees how far it is" grep -q "picture 3 of 3" "$work/tty"
else
	skip "a terminal sees how far it is" "there are no pseudo-terminals here"
fi
turntable --model teapot --quality draft --frames 3 -o "$work/tty_%d.png" >"$work/quiet" 2>&1
check "a pipe does not" test ! -s "$work/quiet"
refuses "a turntable of two views" 2 "a turntable has one view" turntable --model teapot --view front,top -o "$work/x_%d.png"

# --- standard output ---
shot --model teapot -o "$work/a.png"
check "-o - is a PNG" bash -c "psr shot --server $server --size $size --model teapot -o - | cmp - $work/a.png"
is "--report - is JSON" '{' "$(shot --model teapot --report - | head -n 1)"
refuses "two files on one output" 2 "there is one standard output" shot --model teapot -o - --report -
refuses "a file and hashes on one output" 2 "print on standard output" shot --model teapot -o - --hash
check "psrd stops cleanly" stop_psrd
