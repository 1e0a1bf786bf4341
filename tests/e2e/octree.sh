#!/bin/bash
# needs: psr-model
# Octrees from clouds by psr-model: leaves, memory, what info says, and options that do not go together.
. "$(dirname "$0")/lib.sh"

# 60,000 points of a ball of radius 10 at survey coordinates, red above and blue below, in no order.
python3 - "$work/ball.las" <<'END'
import math, random, struct, sys
random.seed(1)
n = 60000
header = bytearray(227)
header[0:4] = b"LASF"
header[24:26] = bytes([1, 2])
struct.pack_into("<HI", header, 94, 227, 227)
struct.pack_into("<BHI", header, 104, 2, 26, n)
struct.pack_into("<6d", header, 131, 0.001, 0.001, 0.001, 412000.0, 5312000.0, 120.0)
with open(sys.argv[1], "wb") as f:
    f.write(header)
    for i in range(n):
        z = 2 * random.random() - 1
        a = 2 * math.pi * random.random()
        r = math.sqrt(1 - z * z)
        at = [round(10000 * c) for c in (r * math.cos(a), r * math.sin(a), z)]
        color = (60000, 5000, 5000) if z > 0 else (5000, 5000, 60000)
        f.write(struct.pack("<3iHBBBBH3H", *at, 0, 0, 2, 0, 0, 0, *color))
END

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

psr-model build "$work/ball.las" --representation octree --levels 7 --memory 1m -q -o "$work/runs.psr"
is "sorting on disk makes the same file" "$(sha256sum <"$work/ball.psr")" "$(sha256sum <"$work/runs.psr")"
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
refuses "levels for blocks" 2 "add --representation octree" psr-model build "$work/ball.las" --levels 7 -o "$work/none.psr"
refuses "another representation" 2 "it is blocks, octree or both" \
	psr-model build "$work/ball.las" --representation trees -o "$work/none.psr"
refuses "a spacing that takes too many levels" 2 "more than 20 levels" \
	psr-model build "$work/ball.las" --representation octree --spacing 1e-9 -o "$work/none.psr"
head -c 700000 "$work/ball.las" >"$work/cut.las"
refuses "a cloud that was cut" 4 "cut\.las" psr-model build "$work/cut.las" --representation octree -o "$work/none.psr"
refuses "a folder for runs that is not there" 3 "no-folder" \
	env TMPDIR="$work/no-folder" psr-model build "$work/ball.las" --representation octree --memory 1m -o "$work/none.psr"
check "nothing is left of these" bash -c '! ls "$1" | grep -E "none|\.psr-"' - "$work"
