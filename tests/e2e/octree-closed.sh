#!/bin/bash
# needs: psr-model
# Pictures of octrees of meshes have no holes, and show nothing from behind a surface: from fifteen sides, where leaves
# are half a pixel wide to four, compared with rays. Of generated models, a scan, a CAD part, whose
# faces are on the cube's sides, and one of few triangles, whose normals lean from them (0181).
. "$(dirname "$0")/lib.sh"

closed() { # name source levels
	check "an octree of $1 is made" psr-model build "$2" --representation octree --levels "$3" -q -o "$work/$1.psr"
	check "$1 is closed from all sides" "$BUILD/tests/tools/octree_closed" "$work/$1.psr" "$2"
	sed 's/^/# /' "$work/out"
}

for model in teapot top; do
	check "$model is made" psr-model make $model -o "$work/$model.glb"
	closed $model "$work/$model.glb" 8
done
for file in bunny.obj anchor.off helmet.off; do
	model=${file%.*}
	if [ -f "$PSR_MODELS/$file" ]; then
		closed $model "$PSR_MODELS/$file" 8
	elif [ "${CI:-}" = true ]; then
		not_ok "$model is there" "no $PSR_MODELS/$file; make models fetches it"
	else
		skip "$model is closed" "no $PSR_MODELS/$file; make models fetches it"
	fi
done
