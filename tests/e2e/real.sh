#!/bin/bash
# needs: psr-model
# Real models of CGAL's data: two OFF meshes and a cloud of coloured points at survey coordinates.
. "$(dirname "$0")/lib.sh"
. "$(dirname "$0")/truth.sh"
size=384
models=$work/models
mkdir "$models"

for entry in armadillo:armadillo.off elephant:elephant.off b9_training:b9_training.ply; do
	model=${entry%%:*} source=$PSR_MODELS/${entry#*:}
	if [ -f "$source" ]; then
		check "$model is built" psr-model build "$source" --representation blocks -r $size -o "$models/$model.psr" --quiet
		available="${available:-} $entry"
	elif [ "${CI:-}" = true ]; then
		# A run that claims to have tested everything must have had the models.
		not_ok "$model is there" "no $source; make models fetches it"
	else
		skip "$model against the truth" "no $source; make models fetches it"
	fi
done
[ -n "${available:-}" ] || exit
start_psrd --models "$models"
for entry in $available; do
	check_views "${entry%%:*}" "$PSR_MODELS/${entry#*:}" "$models/${entry%%:*}.psr" $size 10 0 1 1
done
check "psrd stops cleanly" stop_psrd
