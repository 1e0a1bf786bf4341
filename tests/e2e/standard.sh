#!/bin/bash
# needs: psr-model
# The fourteen models of the standard set ([G] table 8.1) at 256: made, built, drawn, compared with the ray-traced truth.
. "$(dirname "$0")/lib.sh"
. "$(dirname "$0")/truth.sh"
size=256
models=$work/models
mkdir "$models"

check "the standard set is made" psr-model make all -o "$work/source"
for source in "$work"/source/*.glb; do
	model=$(basename "$source" .glb)
	check "$model is built" psr-model build "$source" -r $size -o "$models/$model.psr" --quiet
done
start_psrd --models "$models"
n=0
for source in "$work"/source/*.glb; do
	model=$(basename "$source" .glb)
	holes=10 outside=0 p999=1 color=1
	check_views "$model" "$source" "$models/$model.psr" $size $holes $outside $p999 $color
	n=$((n + 1))
done
check "there are fourteen" [ $n -eq 14 ]
check "psrd stops cleanly" stop_psrd
