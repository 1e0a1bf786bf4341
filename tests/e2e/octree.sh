#!/bin/bash
# needs: psr-model
# Octrees from clouds and meshes by psr-model: leaves, memory, what info says, options that do not go together; and their
# pictures by psrd.
. "$(dirname "$0")/lib.sh"

python3 tests/e2e/ball.py "$work/ball.las" 60000 colors

value() { # key of the JSON object FILE.json
	python3 -c 'import functools, json, sys
print(functools.reduce(lambda o, k: o[k], sys.argv[2].split("."), json.load(open(sys.argv[1]))))' "$1" "$2"
}

check "a cloud becomes an octree" psr-model build "$work/ball.las" --representation octree --levels 7 -o "$work/ball.psr"
psr-model info "$work/ball.psr" --json >"$work/ball.json"
is "it has the levels that were asked for" 7 "$(value "$work/ball.json" octree.levels)"
is "its leaves are a 128th of the ball's diameter" 0.15625 "$(printf %.5f "$(value "$work/ball.json" octree.leaf_edge)")"
is "it has no blocks" False "$(python3 -c 'import json, sys; print("blocks" in json.load(open(sys.argv[1])))' "$work/ball.json")"
check "the middle of the ball is the origin, to a leaf" python3 -c 'import json, sys
m = json.load(open(sys.argv[1]))
assert all(abs(a - b) < m["octree"]["leaf_edge"] for a, b in zip(m["origin"], (412000, 5312000, 120))), m["origin"]' \
	"$work/ball.json"
# A plane with normal n meets |nx| + |ny| + |nz| cells for each area of a leaf's face: 1.5 on a sphere's average. Of these
# 77,000 the 60,000 points fall into some two thirds of 60,000 / 77,000; half a face's number is below any such chance.
check "its leaves are those of a sphere" python3 -c 'import json, math, sys
o = json.load(open(sys.argv[1]))["octree"]
cells = 4 * math.pi * 100 / o["leaf_edge"] ** 2
assert 0.5 * cells < o["leaves"] < 1.5 * cells, (o["leaves"], cells)' "$work/ball.json"
check "text says the same, with the bits of each array" \
	bash -c 'psr-model info "$1" | grep -qE "^  normals +16\.00 bits a leaf"' - "$work/ball.psr"

psr-model build "$work/ball.las" --representation octree --levels 7 --scan -q -o "$work/scan.psr"
psr-model info "$work/scan.psr" --json >"$work/scan.json"
is "with --scan it keeps the classes of the cloud, and no stream of zeros" \
	"{'classes': {'2': $(value "$work/ball.json" octree.leaves)}}" "$(value "$work/scan.json" octree.scan)"
psr-model build "$work/ball.las" --representation octree --levels 7 --scan --pack -q -o "$work/scan.psr"
is "and so it does packed" "$(value "$work/scan.json" content_id)" \
	"$(psr-model info "$work/scan.psr" --json >"$work/scan.json"; value "$work/scan.json" content_id)"
# The scan is behind the octree: its first byte is in the last third of the file, and the levels before it are there.
head -c $(($(stat -c %s "$work/scan.psr") * 2 / 3)) "$work/scan.psr" >"$work/part.psr"
psr-model info "$work/part.psr" --json >"$work/scan.json"
is "a part of it is a coarser model, without classes" "5 7 {}" \
	"$(value "$work/scan.json" prefix.levels) $(value "$work/scan.json" prefix.of_levels) $(value "$work/scan.json" octree.scan 2>/dev/null || echo '{}')"
head -c -1 "$work/scan.psr" >"$work/part.psr"
check "all but the last byte is all of the octree, without its scan" \
	bash -c 'psr-model info "$1" | grep -q "all 7 levels of its octree, without its scan"' - "$work/part.psr"
refuses "its classes as colours" 4 "the model's file ends before them" \
	psr shot "$work/part.psr" --color-by class -o "$work/none.png"
refuses "a scan of blocks" 2 "add --representation octree" psr-model build "$work/ball.las" \
	--representation blocks --scan -o "$work/none.psr"

psr-model build "$work/ball.las" --representation octree --levels 7 --memory 1m -q -o "$work/runs.psr"
is "sorting on disk makes the same file" "$(sha256sum <"$work/ball.psr")" "$(sha256sum <"$work/runs.psr")"
check "a cloud becomes an octree without being asked" psr-model build "$work/ball.las" --levels 7 -q -o "$work/runs.psr"
is "which is the same file" "$(sha256sum <"$work/ball.psr")" "$(sha256sum <"$work/runs.psr")"
check "a spacing in place of levels" psr-model build "$work/ball.las" --representation octree --spacing 0.16 -q -o "$work/runs.psr"
is "makes the same file" "$(sha256sum <"$work/ball.psr")" "$(sha256sum <"$work/runs.psr")"
check "blocks and an octree in one model" psr-model build "$work/ball.las" --representation both -r 64 --levels 7 \
	-o "$work/both.psr"
psr-model info "$work/both.psr" --json >"$work/both.json"
is "with both of them" "7 64" "$(value "$work/both.json" octree.levels) $(value "$work/both.json" resolution)"

# Other files of points, and meshes.
python3 - "$work/ball.las" "$work/ball.xyz" <<'END'
import struct, sys
data = open(sys.argv[1], "rb").read()
with open(sys.argv[2], "w") as f:
    f.write("// x y z r g b\nnan nan nan 0 0 0\n")
    for at in range(227, len(data), 26):
        x, y, z = struct.unpack_from("<3i", data, at)
        r, g, b = struct.unpack_from("<3H", data, at + 20)
        f.write("%.3f %.3f %.3f %d %d %d\n" % (x / 1000 + 412000, y / 1000 + 5312000, z / 1000 + 120, r, g, b))
END
psr-model build "$work/ball.xyz" --representation octree --levels 7 -o "$work/text.psr" >"$work/said" 2>"$work/warned"
check "a point without a place is left out, with a warning" grep -q "points without a finite place were left out: 1" "$work/warned"
check "and not counted" grep -q "from 60000 points" "$work/said"
psr-model info "$work/text.psr" --json >"$work/text.json"
is "a cloud of text has the leaves of the same cloud of LAS" "$(value "$work/ball.json" octree.leaves)" \
	"$(value "$work/text.json" octree.leaves)"
is "and stands upright" "[0, 0, 1]" "$(value "$work/text.json" up)"
psr-model make pencil -o "$work/mesh.glb" >/dev/null
check "a mesh becomes an octree" psr-model build "$work/mesh.glb" --representation octree --levels 7 -o "$work/mesh.psr"
psr-model info "$work/mesh.psr" --json >"$work/mesh.json"
is "of as many levels" 7 "$(value "$work/mesh.json" octree.levels)"

refuses "levels and a spacing together" 2 "give one of them" \
	psr-model build "$work/ball.las" --representation octree --levels 7 --spacing 1 -o "$work/none.psr"
refuses "levels for blocks of a mesh" 2 "add --representation octree" \
	psr-model build "$work/mesh.glb" --levels 7 -o "$work/none.psr"
refuses "levels for blocks of a cloud" 2 "add --representation octree" \
	psr-model build "$work/ball.las" --representation blocks --levels 7 -o "$work/none.psr"
refuses "another representation" 2 "it is blocks, octree, both or dpoints" \
	psr-model build "$work/ball.las" --representation trees -o "$work/none.psr"
refuses "a spacing that takes too many levels" 2 "more than 20 levels" \
	psr-model build "$work/ball.las" --representation octree --spacing 1e-9 -o "$work/none.psr"
head -c 700000 "$work/ball.las" >"$work/cut.las"
refuses "a cloud that was cut" 4 "cut\.las" psr-model build "$work/cut.las" --representation octree -o "$work/none.psr"
refuses "a folder for runs that is not there" 3 "no-folder" \
	env TMPDIR="$work/no-folder" psr-model build "$work/ball.las" --representation octree --memory 1m -o "$work/none.psr"
check "nothing is left of these" bash -c '! ls "$1" | grep -E "none|\.psr-"' - "$work"

# --- packed, meshes, other clouds ---
check "an octree is packed" psr-model build "$work/ball.las" --representation octree --levels 7 --pack -o "$work/packed.psr"
psr-model info "$work/packed.psr" --json >"$work/packed.json"
is "it has the same content" "$(value "$work/ball.json" content_id)" "$(value "$work/packed.json" content_id)"
check "in a third of the bits" python3 -c 'import json, sys
o = json.load(open(sys.argv[1]))["octree"]
packed, plain = (sum(o[k].values()) for k in ("packed_bits_per_leaf", "bits_per_leaf"))
assert 0 < 3 * packed < plain, (packed, plain)' "$work/packed.json"
check "all but its last bytes are a coarser model" bash -c 'head -c -20000 "$1" >"$2"' - "$work/packed.psr" "$work/part.psr"
psr-model info "$work/part.psr" --json >"$work/part.json"
is "of five of its seven levels" "5 7" "$(value "$work/part.json" prefix.levels) $(value "$work/part.json" prefix.of_levels)"
is "whose leaves are four times as wide" "$(python3 -c "print(4 * $(value "$work/ball.json" octree.leaf_edge))")" \
	"$(value "$work/part.json" octree.leaf_edge)"
head -c 3000 "$work/packed.psr" >"$work/less.psr"
refuses "less than its first step" 4 "it was cut short" psr-model info "$work/less.psr"
psr-model make teapot -o "$work/teapot.glb"
check "a mesh becomes an octree and blocks" psr-model build "$work/teapot.glb" --representation both -r 128 -o "$work/teapot.psr"
is "of leaves as wide as a pixel" 7 "$(psr-model info "$work/teapot.psr" --json >"$work/teapot.json"; value "$work/teapot.json" octree.levels)"
awk 'BEGIN { srand(1); for (i = 0; i < 5000; i++) print rand() * 4, rand() * 4, 0, 255, 0, 0 }' >"$work/square.xyz"
check "lines of numbers become an octree" psr-model build "$work/square.xyz" --representation octree --levels 5 -o "$work/square.psr"

# --- pictures ---
mkdir "$work/models"
cp "$work/ball.psr" "$work/part.psr" "$work/packed.psr" "$work/both.psr" "$work/teapot.psr" "$work/square.psr" "$work/models"
cp "$work/square.xyz" "$work/models/lines.xyz"
start_psrd --models "$work/models" --threads 2
shot() { psr shot --server "$server" --size 200x200 "$@"; }
hashes() { shot "$@" --hash 2>/dev/null; }

ball=$(hashes --model ball)
is "a packed octree looks as the plain one" "$ball" "$(hashes --model packed)"
check "a part of it, coarser" [ -n "$(hashes --model part)" -a "$(hashes --model part)" != "$ball" ]
check "psrd makes an octree of lines of numbers" shot --model lines --report "$work/lines.json" -o "$work/lines.png"
is "and of nothing else" "['octree']" "$(value "$work/lines.json" model.representations)"
is "where nobody names one, blocks are drawn" "$(hashes --model both)" "$(hashes --instance both,as=blocks)"
check "and an octree where it is named" [ "$(hashes --instance both,as=octree)" != "$(hashes --model both)" ]
is "psr says why" "blocks     drawn: 1 instance, since the model has blocks, the fastest" \
	"$(shot --model both --effects -o "$work/both.ppm" 2>/dev/null | head -n 1)"
is "and of an octree how many levels suffice" \
	"octree     drawn: 1 instance, since the scene says so; 5 of 7 levels suffice" \
	"$(psr shot --server "$server" --size 24x24 --quality good --instance both,as=octree --effects --report "$work/named.json" \
	-o "$work/named.ppm" 2>/dev/null | head -n 1)"
is "which the report has, too" "5 7 0" "$(for of in levels of_levels automatic; do
	value "$work/named.json" drawn_as.octree.$of; done | paste -sd " ")"
check "a replay draws the octree again" psr shot --server "$server" --replay "$work/named.json" -o "$work/again.ppm"
check "and not its blocks" cmp "$work/named.ppm" "$work/again.ppm"
refuses "blocks of an octree" 4 "asks for representation 1 \\(blocks\\), and its model has an octree alone" \
	shot --instance ball,as=blocks --hash
check "the ball is round, red above and blue below" bash -c 'psr shot --server "$1" --model ball --view front \
	--size 200x200 --background "#000000" -o "$2" && python3 - "$2"' - "$server" "$work/ball.ppm" <<'END'
import math, sys
data = open(sys.argv[1], "rb").read()
pixels = data[-200 * 200 * 3:]
at = lambda x, y: pixels[3 * (200 * y + x):][:3]
rows = [y for y in range(200) if any(max(at(x, y)) > 8 for x in range(200))]
middle, radius = (rows[0] + rows[-1]) / 2, (rows[-1] - rows[0] + 1) / 2
assert radius > 50, radius
inside = outside = 0
for y in range(200):
    for x in range(200):
        r = math.hypot(x - 99.5, y - middle)
        color = at(x, y)
        if r < radius - 4:
            assert max(color) > 8, ("a hole", x, y)
            if y < middle - radius / 4: assert color[0] > color[2], ("not red", x, y, color)
            if y > middle + radius / 4: assert color[2] > color[0], ("not blue", x, y, color)
        elif r > radius + 4:
            assert max(color) <= 8, ("outside", x, y)
END
# A leaf is a 128th of the teapot, so outlines may differ by a pixel or two of 100: in 4 % of the pixels at most by all of
# the 150 codes between the teapot and what is behind it. Its highlights, brighter than all else, are where those of the
# blocks are, but for a pixel around each.
shot --instance teapot,as=blocks -o "$work/blocks.ppm" 2>/dev/null
shot --instance teapot,as=octree -o "$work/octree.ppm" 2>/dev/null
check "a mesh's octree looks like its blocks" python3 - "$work/blocks.ppm" "$work/octree.ppm" <<'END'
import sys
a, b = (open(path, "rb").read()[-200 * 200 * 3:] for path in sys.argv[1:])
far = sum(max(abs(a[i + c] - b[i + c]) for c in range(3)) > 48 for i in range(0, len(a), 3))
assert far < 0.04 * 200 * 200, far
bright = [i for i in range(0, len(a), 3) if a[i] > 90]
both = sum(b[i] > 80 for i in bright)
assert len(bright) > 20 and 2 * both > len(bright), (both, len(bright))
END
check "a flat cloud is seen from both sides" python3 - "$(hashes --model square --view front)" "$(hashes --model square --view back)" <<'END'
import sys
assert sys.argv[1] and sys.argv[2]
END
for budget in 0.001ms 60000ms 2px; do
	check "an octree is drawn within a budget of $budget" \
		shot --model ball --budget $budget --report "$work/budget.json" -o "$work/budget.ppm"
	check "and its report draws the same bits again" \
		psr shot --server "$server" --replay "$work/budget.json" -o "$work/again.ppm"
	check "which they are" cmp "$work/budget.ppm" "$work/again.ppm"
done
check "so are an octree and blocks in one scene" \
	shot --model teapot --instance both,as=octree,at=1,0,0 --budget 60000ms -o "$work/budget.ppm"
# --- splats ---
check "splats make another picture" \
	[ -n "$(hashes --model ball --splats)" -a "$(hashes --model ball --splats)" != "$ball" ]
is "of blocks they make none" "$(hashes --model teapot)" "$(hashes --model teapot --splats)"
said_of_splats() { shot "$@" --effects -o "$work/splats.ppm" 2>/dev/null | grep '^splats'; }
check "psr says how many" grep -qE "^splats     ran: [0-9]+ leaves" <(said_of_splats --model ball --splats)
is "and why there are none of blocks" "splats     left out: no octree is in view; other instances are drawn as without" \
	"$(said_of_splats --model teapot --splats)"
is "nor in passes" "splats     left out: passes draw leaves as discs" "$(said_of_splats --model ball --splats --passes 1)"
is "nor unless they are asked for" "splats     left out: the settings turn it off" "$(said_of_splats --model ball)"
for quality in good fine; do
	check "a $quality picture of splats has a report" shot --model ball --splats --quality $quality \
		--report "$work/splats.json" -o "$work/splats.ppm"
	is "which tells of them" "True True" "$(value "$work/splats.json" splats) $(value "$work/splats.json" request.splats)"
	check "and draws them again" psr shot --server "$server" --replay "$work/splats.json" -o "$work/again.ppm"
	check "with the same bytes" cmp "$work/splats.ppm" "$work/again.ppm"
done
refuses "splats and a budget" 2 "excludes .*--splats" shot --model ball --splats --budget 12ms --hash
check "psr bench draws them, and psr draws them again" psr bench --server "$server" --model ball --splats --frames 4 \
	--size 64x64 --codec lossless --verify 1 --verify-models "$work/models"
psr list --server "$server" --json >"$work/list.json" 2>/dev/null
shot --model both --report "$work/report.json" -o "$work/both.png" 2>/dev/null
is "a report names what the model has" "blocks octree" "$(python3 -c 'import json, sys
def find(o):
    if isinstance(o, dict):
        if "representations" in o: return o["representations"]
        o = list(o.values())
    if isinstance(o, list):
        for v in o:
            r = find(v)
            if r: return r
print(*find(json.load(open(sys.argv[1]))))' "$work/report.json")"

# A prism whose normals lean from its faces by 15 degrees, and whose ends are sides of the octree's cube; and without ends.
prism() { # faces of ends, 0 or 1
	awk -v ends="$1" 'BEGIN { pi = atan2(0, -1); n = 12; print "OFF"; print 2 * n + 2, 2 * n + 2 * n * ends, 0
		for (i = 0; i < n; i++) for (z = -1; z <= 1; z += 2) print cos(2 * pi * i / n), sin(2 * pi * i / n), z
		print 0, 0, -1; print 0, 0, 1
		for (i = 0; i < n; i++) { a = 2 * i; b = 2 * ((i + 1) % n); print 3, a, b, b + 1; print 3, a, b + 1, a + 1
			if (ends) { print 3, b, a, 2 * n; print 3, a + 1, b + 1, 2 * n + 1 } } }'
}
for ends in 1 0; do
	prism $ends >"$work/prism.off"
	psr-model build "$work/prism.off" --representation octree -r 512 -q -o "$work/prism.psr"
	psr-model build "$work/prism.off" --representation octree -r 512 --pack -q -o "$work/packed.psr"
	is "a prism packed is the same: ends $ends" "$(psr-model info "$work/prism.psr" | grep 'content id')" \
		"$(psr-model info "$work/packed.psr" | grep 'content id')"
	for view in "2 3" "33 20" "64 -5" "91 89" "151 0.5"; do
		read -r azimuth elevation <<<"$view"
		psr shot "$work/prism.psr" --size 400x400 --no-smooth --codec lossless --ambient 1 --azimuth "$azimuth" \
			--elevation "$elevation" -o "$work/prism.ppm" --depth "$work/prism.pfm" --report "$work/prism.json" 2>/dev/null
		check "its picture has no hole: ends $ends, $view" psr-model accuracy "$work/prism.off" --depth "$work/prism.pfm" \
			--report "$work/prism.json" --max-holes 0
	done
done
