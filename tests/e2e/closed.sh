#!/bin/bash
# needs: psr-model
# Stills show no background through a surface: no pixel four or more inside of what pass 0 covers depends on the
# background, in any pass, unless a ray of it, or as near as samples can tell, misses the mesh, or a thin thing hangs a
# veil there, as nearly everywhere in the pine tree. Of scans, CAD parts, textured models, and the standard set, in five
# views, two of them in the last pass, samples about a pixel apart; some models' two, four, and eight.
. "$(dirname "$0")/lib.sh"
resolution=96
testmodels=${PSR_TESTMODELS:-/usr/share/assimp/models}
# A built psr-model finds the module beside it; the tool is elsewhere.
export PSR_IMAGE_MODULE=$BUILD/lib/psr-image-oiio.so

closed() { # model source resolution [side of the picture [zoom]]
	if ! psr-model build "$2" -r "$3" -o "$work/$1.psr" --quiet 2>"$work/err"; then
		not_ok "$1 is built" "$(head -n 1 "$work/err")"
		return
	fi
	check "$1 is closed" "$BUILD/tests/tools/closed" "$work/$1.psr" "$2" "${4:-$3}" 16 "${5:-1}"
	sed -n "s/.* pass \([0-9]\): \([0-9]*\) depend[^,]*, \([0-9]*\) of them veiled, \([0-9]*\) torn.*/\1 \2 \3 \4/p" "$work/out" | awk -v model="$1" '
		{ n[$1] += $2; veiled[$1] += $3; torn[$1] += $4 }
		END {
			printf "# %-16s torn and veiled of those that depend on the background, by pass:", model
			for (p = 0; p < 5; p++) printf " %d, %d of %d;", torn[p], veiled[p], n[p]
			print ""
		}'
	rm -f "$work/$1.psr"
}

fetched() { # model file [resolution [side [zoom]]]
	if [ -f "$PSR_MODELS/$2" ]; then
		closed "$1" "$PSR_MODELS/$2" "${3:-$resolution}" "${4:-}" "${5:-}"
	elif [ "${CI:-}" = true ]; then
		# A run that claims to have tested everything must have had the models.
		not_ok "$1 is there" "no $PSR_MODELS/$2; make models fetches it"
	else
		skip "$1 is closed" "no $PSR_MODELS/$2; make models fetches it"
	fi
}

for entry in dragon:dragon.ply bunny:bunny.obj engine:engine.glb clearcoat:clearcoat/ClearCoatTest.gltf \
	armadillo:armadillo.off elephant:elephant.off; do
	fetched "${entry%%:*}" "${entry#*:}"
done
for model in anchor couplingdown fandisk helmet lionhead nefertiti rotor; do
	fetched $model $model.off
done
fetched helmet-magnified helmet.off 64 150
fetched bunny-4x bunny.obj 64 96 2.7
for entry in helmet:helmet.off engine:engine.glb clearcoat:clearcoat/ClearCoatTest.gltf; do
	fetched "${entry%%:*}-8x" "${entry#*:}" 64 96 5.4
done
for file in Collada/duck.dae OBJ/spider.obj STL/Wuson.stl STL/3DSMaxExport.STL; do
	model=$(basename "${file%.*}")
	if [ -f "$testmodels/$file" ]; then
		closed "$model" "$testmodels/$file" $resolution
	else
		skip "$model is closed" "no $testmodels/$file; it is in Debian's assimp-testmodels"
	fi
done
check "the standard set is made" psr-model make all -o "$work/source"
for source in "$work"/source/*.glb; do
	model=$(basename "$source" .glb)
	# Crowns have most of the set's samples, and veils nearly everywhere.
	case $model in
	pinetree | tree) closed "$model" "$source" 64 ;;
	*) closed "$model" "$source" $resolution ;;
	esac
done
