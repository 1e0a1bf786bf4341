#!/bin/bash
# needs: psr-model
# not for threads
# A LAS file by intensity, class, height and return through psrd: as it comes, built, and packed; its legend, in
# pictures and not in files of numbers; in suites, loads, reports and turntables; and models without the number.
. "$(dirname "$0")/lib.sh"

python3 tests/e2e/ball.py "$work/ball.las" 30000 scan
mkdir "$work/models"
octree=(--representation octree --levels 7 -q)
psr-model build "$work/ball.las" "${octree[@]}" --scan -o "$work/models/plain.psr"
psr-model build "$work/ball.las" "${octree[@]}" --scan --pack -o "$work/models/packed.psr"
psr-model build "$work/ball.las" "${octree[@]}" -o "$work/models/bare.psr"
cp "$work/ball.las" tests/golden/teapot.psr "$work/models"
start_psrd --models "$work/models" --threads 2
shot() { psr shot --server "$server" --size 320x240 "$@"; }
hashes() { shot "$@" --quality good --hash 2>/dev/null; }

# --- the same by each way to a model ---
own=$(hashes --model plain)
: >"$work/hashes"
for by in intensity class height return; do
	plain=$(hashes --model plain --color-by $by)
	echo "$plain" >>"$work/hashes"
	is "packed, the same bits by $by" "$plain" "$(hashes --model packed --color-by $by)"
	if [ $by = height ]; then
		check "a beginning by height" shot --model packed --level 5 --color-by $by -o "$work/begun.ppm"
	else
		is "a beginning has no $by, and says where it is" "of a scan stand behind all levels of a packed octree" \
			"$(shot --model packed --level 5 --color-by $by -o "$work/begun.ppm" 2>&1 | grep -o 'of a scan.*octree')"
	fi
	check "a LAS file as it comes, by $by" shot --model ball --color-by $by --no-legend -o "$work/las_$by.ppm"
done
check "these are four pictures, and none in the model's own colours" \
	test "$( (grep ^color "$work/hashes"; grep ^color <<<"$own") | sort -u | wc -l)" -eq 5
# Colours of classes 2 and 6, and of the first, a middle and the last return, are darkened, which keeps their hue. The
# ball is seen from the front: classes change to the right, returns downwards.
check "each half has its class, each third its return, of the file as it comes" python3 - "$work"/las_class.ppm \
	"$work"/las_return.ppm <<'END'
import sys
def hue(path, x, y):
    p = open(path, "rb").read()[-3 * 320 * 240:][3 * (320 * y + x):][:3]
    return tuple(round(c / max(p), 1) for c in p)
cls, ret = sys.argv[1:]
across = [hue(cls, x, 120) for x in (110, 210)]
down = [hue(ret, 160, y) for y in (50, 120, 190)]
assert len(set(across)) == 2 and len(set(down)) == 3, (across, down)
END

# --- legends ---
shot --model plain --color-by class --no-legend -o "$work/none.ppm" 2>/dev/null
shot --model plain --color-by class -o "$work/legend.ppm" 2>/dev/null
check "a picture has a legend in its lower left corner" python3 - "$work/legend.ppm" "$work/none.ppm" <<'END'
import sys
a, b = (open(path, "rb").read()[-3 * 320 * 240:] for path in sys.argv[1:])
changed = [i // 3 for i in range(0, len(a), 3) if a[i:i + 3] != b[i:i + 3]]
assert len(changed) > 1000 and all(i % 320 < 160 and i // 320 > 120 for i in changed), len(changed)
END
same() { # claim name: with a legend and without, the same file
	shot --model plain --color-by class -o "$work/with_$2" 2>"$work/said" || { not_ok "$1" "$(cat "$work/said")"; return; }
	shot --model plain --color-by class --no-legend -o "$work/without_$2" 2>/dev/null
	check "$1" python3 - "$work/with_$2" "$work/without_$2" <<-'END'
		import re, sys
		date = re.compile(rb"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d") # of an .exr file, when it was written
		a, b = (date.sub(b"", open(path, "rb").read()) for path in sys.argv[1:])
		assert a == b
	END
}
same "an array has none" color.npy
if shot --model plain -o "$work/try.exr" 2>/dev/null; then
	same "an .exr file has none" color.exr
	same "nor has one whose ending is in capitals" color.EXR
else
	skip "an .exr file has none" "there is no OpenImageIO"
fi
shot --model plain --color-by class --plane color -o "$work/with_plane.npy" 2>/dev/null
check "nor has a plane" cmp "$work/with_plane.npy" "$work/with_color.npy"
shot --model plain --color-by class --size 320x240 --no-legend -o "$work/none.png" 2>/dev/null
shot --model plain --color-by class --size 320x240 -o "$work/legend.png" 2>/dev/null
check "a .png file has one" bash -c '! cmp -s "$1" "$2"' - "$work/none.png" "$work/legend.png"

# --- everywhere else ---
shot --model plain --color-by return --report "$work/report.json" -o "$work/first.ppm" 2>/dev/null
check "a report is drawn again" psr shot --server "$server" --replay "$work/report.json" -o "$work/again.ppm"
check "in the same colours, with their legend" cmp "$work/first.ppm" "$work/again.ppm"
cat >"$work/colors.suite" <<END
size=320x240 model=plain quality=good
test=own hash=$(sed 's/color //' <<<"$own")
test=intensity color-by=intensity hash=$(sed -n '1s/color //p' "$work/hashes")
test=class color-by=class hash=$(sed -n '2s/color //p' "$work/hashes")
test=height color-by=height hash=$(sed -n '3s/color //p' "$work/hashes")
test=return color-by=return hash=$(sed -n '4s/color //p' "$work/hashes")
END
check "a suite has each of them" psr test --server "$server" "$work/colors.suite"
sed -i 's/color-by=return/color-by=class/' "$work/colors.suite"
check "and sees another one" bash -c '! psr test --server "$1" "$2"' - "$server" "$work/colors.suite"
check "a load is verified" psr bench --server "$server" --model plain --color-by class --clients 2 --frames 20 \
	--warmup 0 --verify 1 --verify-models "$work/models"
check "a load is recorded" psr bench --server "$server" --model plain --color-by height --clients 1 --frames 5 \
	--warmup 0 --record "$work/load.json"
check "and sent again in the same colours" psr bench --server "$server" --replay "$work/load.json" --verify 1
check "a turntable is drawn" psr turntable --server "$server" --model plain --color-by intensity --frames 4 \
	--size 320x240 -o "$work/turn.png"

# --- what is not there ---
refuses "classes of a cloud that was built without" 4 "its octree keeps no classes of a scan" \
	shot --model bare --color-by class -o "$work/refused.png"
refuses "returns of blocks" 4 "its representation has no returns of a scan.*coloured by height" \
	shot --model teapot --color-by return -o "$work/refused.png"
refuses "an animation of them" 4 "no intensities of a scan" \
	psr turntable --server "$server" --model teapot --color-by intensity -o "$work/refused.png"
psr bench --server "$server" --model teapot --color-by intensity --frames 5 --warmup 0 >"$work/load" 2>&1
is "a load of them fails" 1 $?
check "and says why" grep -q "the first failure: .*no intensities of a scan" "$work/load"
refuses "another number" 2 "intensity, class, height or return, not 'depth'" \
	shot --model plain --color-by depth -o "$work/refused.png"
check "nothing is written of these" test ! -e "$work/refused.png"
check "any model is drawn by height" shot --model teapot --color-by height -o "$work/height.png"
check "psrd stops cleanly" stop_psrd
