#!/bin/bash
# needs: psr-model
# Builds of differential points that are ended; and what psr-model info says of surfaces that let light through.
. "$(dirname "$0")/lib.sh"

mkdir "$work/out.d"
psr-model make teapot -o "$work/teapot.glb" >/dev/null
is_choosing() { grep -q '^choose' "$work/stages"; }
: >"$work/stages"
TMPDIR=$work/out.d psr-model build "$work/teapot.glb" --representation dpoints -r 1024 --threads 1 --progress-fd 3 -q \
	-o "$work/out.d/teapot.psr" 3>"$work/stages" &
build=$!
check "a build chooses its points" wait_for 60 is_choosing
begin=$(date +%s%N)
kill -TERM $build
wait $build
is "SIGTERM ends it" 143 $?
took=$((($(date +%s%N) - begin) / 1000000))
check "within two seconds: $took ms" [ $took -lt 2000 ]
is "and it leaves nothing" "" "$(ls -A "$work/out.d")"

# --error: what it asks for holds, info says so, and what is no error is refused.
printf 'v 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n' >"$work/corner.obj"
build_corner() { psr-model build "$work/corner.obj" --representation dpoints -r 128 -o "$work/corner.psr" "$@"; }
check "an error is kept" build_corner --error 0.5 -q
psr-model info "$work/corner.psr" --json >"$work/corner.json"
off=$(number "$work/corner.json" height_pixels)
check "info says what holds: $off pixels" awk "BEGIN { exit !($off > 0 && $off <= 0.50001) }"
for bad in 0 -1 nan inf x 1px; do
	refuses "--error $bad" 2 "'$bad' is not a number of pixels above 0, such as 0.5" build_corner --error "$bad"
done
refuses "--error below what words hold" 2 "ask for 0.0046 or more" build_corner --error 0.001
refuses "--error with --eps" 2 "leave out --error, or both of them" build_corner --error 1 --eps 0.01
refuses "--error with --delta" 2 "leave out --error, or both of them" build_corner --delta 0.1 --error 1
refuses "--error of blocks" 2 "add --representation dpoints" psr-model build "$work/corner.obj" --error 1 -o "$work/none.psr"

# Clouds: a sphere as PLY, and as lines of numbers with some that are none.
awk 'BEGIN { n = 20000; for (i = 0; i < n; i++) { z = 1 - (2 * i + 1) / n; r = sqrt(1 - z * z); a = 2.399963229728653 * i
	printf "%.9g %.9g %.9g\n", r * cos(a), r * sin(a), z } }' >"$work/ball.txt"
{
	printf 'ply\nformat ascii 1.0\nelement vertex 20000\nproperty double x\nproperty double y\nproperty double z\nend_header\n'
	cat "$work/ball.txt"
} >"$work/ball.ply"
{ cat "$work/ball.txt"; echo "nan 0 0"; } >"$work/ball.xyz"
build_cloud() { psr-model build "$1" --representation dpoints -r 256 -o "${1%.*}.psr" "${@:2}"; }
said() { "$@" 2>"$work/said"; }
points() { psr-model info "$work/$1.psr" --json >"$work/$1.json" && number "$work/$1.json" points; }
check "a cloud becomes differential points" build_cloud "$work/ball.ply"
kept=$(points ball)
check "few of them: $kept of 20000" [ "$kept" -gt 0 -a "$kept" -lt 1000 ]
check "as text, too" said build_cloud "$work/ball.xyz"
check "with a warning of what has no place" grep -q 'points without a finite place were left out: 1' "$work/said"
is "and just as many" "$kept" "$(points ball)"
psr shot "$work/ball.psr" --size 300x300 --no-smooth --codec lossless --ambient 1 -o "$work/ball.ppm" \
	--depth "$work/ball.pfm" --report "$work/shot.json"
{
	echo OFF
	echo "$((65 * 128)) $((64 * 128 * 2)) 0"
	awk 'BEGIN { pi = atan2(0, -1); for (i = 0; i <= 64; i++) for (j = 0; j < 128; j++) { b = pi * i / 64; a = 2 * pi * j / 128
		print sin(b) * cos(a), sin(b) * sin(a), cos(b) }
		for (i = 0; i < 64; i++) for (j = 0; j < 128; j++) { k = i * 128 + j; l = i * 128 + (j + 1) % 128
		print 3, k, k + 128, l + 128; print 3, k, l + 128, l } }'
} >"$work/sphere.off"
check "its picture is that of the sphere" psr-model accuracy "$work/sphere.off" --depth "$work/ball.pfm" --report "$work/shot.json"
for bad in "1 2 3" "1 2 3\n1 2 3\n1 2 3" "$(seq -s '\n' -f '%g 0 0' 30)"; do
	printf "$bad\n" >"$work/bad.xyz"
	refuses "of what is no surface: $(printf "$bad" | head -n 1)..." 4 "has a surface around it, of seven points that are not on a line" \
		build_cloud "$work/bad.xyz"
done
{ cat "$work/ball.txt"; seq -f '%g 3 0' 0 0.01 0.5; } >"$work/wire.xyz"
check "a wire beside it is kept" said build_cloud "$work/wire.xyz"
check "and counted" grep -q '51 points of the cloud have too few neighbours' "$work/said"

# STEP: faces as they are, within their rims; a face whose border is open is left out, and the rest is there.
pins=tests/data/import/pins.step
build_part() { psr-model build "$1" --representation dpoints -r 256 -o "$work/part.psr" "${@:2}" >"$work/told" 2>"$work/said"; }
if [ -r "$BUILD/lib/psr-cad-occ.so" ]; then
	check "a part becomes differential points" build_part "$pins"
	check "of its patches" grep -q 'from 6 NURBS patches' "$work/told"
	for view in "20 30 1" "200 -40 1" "100 5 4" "-60 70 12"; do
		read -r azimuth elevation zoom <<<"$view"
		psr shot "$work/part.psr" --size 300x300 --no-smooth --codec lossless --ambient 1 --azimuth "$azimuth" \
			--elevation "$elevation" --zoom "$zoom" --target 0,0,20 -o "$work/part.ppm" --depth "$work/part.pfm" --report "$work/shot.json"
		check "its picture has no hole: $view" psr-model accuracy "$pins" --depth "$work/part.pfm" --report "$work/shot.json" \
			--max-holes 0
	done
	kept=$(points part)
	check "with an error" build_part "$pins" --error 0.5
	off=$(psr-model info "$work/part.psr" --json >"$work/part.json" && number "$work/part.json" height_pixels)
	check "that holds: $off pixels" awk "BEGIN { exit !($off > 0 && $off <= 0.50001) }"
	sed 's/(#42,#76,#99,#126)/(#42,#76,#126)/' "$pins" >"$work/open.step"
	check "a border that is open leaves its face out" build_part "$work/open.step"
	check "and tells so" grep -q '2 of 6 faces could not be cut into triangles and were left out, first face 1 of part "pin"' "$work/said"
	check "the others are there" grep -q 'from 4 NURBS patches' "$work/told"
	sed 's/(50.,0.,0.)/(nan,1.E308,0.)/' "$pins" >"$work/nowhere.step"
	check "a part that is nowhere leaves the other there" build_part "$work/nowhere.step"
	check "and tells so, too" grep -q '3 of 6 faces have no NURBS of their own' "$work/said"
	check "of patches" grep -q 'from 3 NURBS patches' "$work/told"
	head -c 4000 "$pins" >"$work/cut.step"
	refuses "a part that ends in the middle" 4 "the STEP file ends in the middle" psr-model build "$work/cut.step" \
		--representation dpoints -r 256 -o "$work/none.psr"
	check "as blocks it has no patches" psr-model build "$pins" -r 64 -o "$work/blocks.psr" -q
else
	skip "differential points of STEP" "a build without Open CASCADE"
fi

# Faces that normals of their corners lean from, seen aslant: before points leant, 59 pixels of this view were holes.
if [ -f "$PSR_MODELS/rotor.off" ]; then
	psr-model build "$PSR_MODELS/rotor.off" --representation dpoints -r 512 -q -o "$work/rotor.psr"
	psr shot "$work/rotor.psr" --size 500x500 --azimuth 72.588 --elevation 2.388 -o "$work/rotor.ppm" \
		--depth "$work/rotor.pfm" --report "$work/rotor.json" >/dev/null 2>&1
	check "nobody looks through the rotor" psr-model accuracy "$PSR_MODELS/rotor.off" --depth "$work/rotor.pfm" \
		--report "$work/rotor.json" --max-holes 5e-5
elif [ "${CI:-}" = true ]; then
	not_ok "rotor is there" "no $PSR_MODELS/rotor.off; make models fetches it"
else
	skip "nobody looks through the rotor" "no $PSR_MODELS/rotor.off; make models fetches it"
fi

# Sheer are surfaces of BLEND materials; the coverage of things narrower than a sample is none.
psr-model make pencil -o "$work/pencil.glb" >/dev/null
psr-model build "$work/pencil.glb" -r 64 -o "$work/pencil.psr" >/dev/null 2>"$work/said"
psr-model info "$work/pencil.psr" --json >"$work/pencil.json"
is "info counts as many sheer blocks as the build's note" "$(sed -n 's/.*note: \([0-9]*\) of .*/\1/p' "$work/said" | grep . || echo 0)" \
	"$(number "$work/pencil.json" sheer)"

# Triangles that let light through, those of BLEND materials that are opaque, and normal maps.
positions=AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/ # and texture coordinates
map=iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGNoaPgPAAODAgAApfuJAAAAAElFTkSuQmCC # one pixel: +z
looks() { # material...: a triangle of each
	local n=$#
	printf '{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [ { "nodes": [ %s ] } ],
	"nodes": [ %s ], "meshes": [ %s ], "materials": [ %s ], "textures": [ { "source": 0 } ],
	"images": [ { "uri": "data:image/png;base64,%s" } ],
	"buffers": [ { "byteLength": 60, "uri": "data:application/octet-stream;base64,%s" } ],
	"bufferViews": [ { "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 24 } ],
	"accessors": [ { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [ 0, 0, 0 ], "max": [ 1, 1, 0 ] },
	{ "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" } ] }\n' \
		"$(seq -s , 0 $((n - 1)))" \
		"$(for i in $(seq 0 $((n - 1))); do printf '{ "mesh": %d, "translation": [ %d, 0, 0 ] },' $i $((2 * i)); done | sed 's/,$//')" \
		"$(for i in $(seq 0 $((n - 1))); do printf '{ "primitives": [ { "attributes": { "POSITION": 0, "TEXCOORD_0": 1 },
			"material": %d } ] },' $i; done | sed '$s/,$//')" "$(printf '%s,' "$@" | sed 's/,$//')" $map $positions
}
glass='{ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [ 1, 1, 1, 0.5 ] } }'
paint='{ "alphaMode": "BLEND" }' bumps='{ "normalTexture": { "index": 0 } }'
looks "$glass" "$paint" "$bumps" "$bumps" >"$work/looks.gltf"
looks "$paint" >"$work/paint.gltf"
build_looks() { psr-model build "$work/looks.gltf" --representation "$1" -r 32 -o "$work/looks.psr" 2>"$work/said" >/dev/null; }
has_notes() { [ "$(grep -c 'note: ' "$work/said")" = "$1" ]; }
for kind in octree both dpoints; do
	check "$kind of glass" build_looks $kind
	check "$kind of glass: what is drawn opaque is counted" grep -q 'note: 1 of 4 triangles are of surfaces that let light' "$work/said"
done
check "so are normal maps that are not drawn" grep -q 'note: 2 of 4 triangles have normal maps' "$work/said"
check "blocks draw them all" build_looks blocks
check "and say of glass what they do" grep -q 'blocks are of surfaces that let light through' "$work/said"
check "no more" has_notes 1
psr-model build "$work/paint.gltf" --representation dpoints -r 32 -o "$work/looks.psr" 2>"$work/said" >/dev/null
check "what is opaque has no note" has_notes 0
