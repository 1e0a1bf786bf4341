#!/bin/bash
# needs: psr-model
# Pictures of octrees of meshes have no holes, and show nothing from behind a surface: from fifteen sides, where leaves
# are half a pixel wide to four, compared with rays. Of generated models, and of a scan.
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
if [ -f "$PSR_MODELS/bunny.obj" ]; then
	closed bunny "$PSR_MODELS/bunny.obj" 8
elif [ "${CI:-}" = true ]; then
	not_ok "bunny is there" "no $PSR_MODELS/bunny.obj; make models fetches it"
else
	skip "bunny is closed" "no $PSR_MODELS/bunny.obj; make models fetches it"
fi
