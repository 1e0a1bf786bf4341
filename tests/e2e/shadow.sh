#!/bin/bash
# needs: psr-model
# Shadows of two models of the standard set, of round shapes and of flat boards, against shadow rays.
. "$(dirname "$0")/lib.sh"
. "$(dirname "$0")/truth.sh"
models=$BUILD/test-models/shadow size=256
mkdir -p "$models"

# One view at magnification 1, where texels of the map, samples and pixels are equally far apart. Bounds, in these:
#
# Most faces in shadow are met at up to 30 degrees. There an edge is off by 1.5 texels at most for the sample that may be
# anywhere in its own and the blend with the next, which is 1.7 along the face, by 0.9 for a bias of 1.5 texels times tan 30,
# and by 1 for the pixel that the face's sample may be off: 3.6, so that 99 in 100 of the pixels that are misplaced are by 4
# or fewer.
#
# These errors go both ways, and light is half where an edge is, so that on average an edge is off by less than one pixel:
# then not more are misplaced than the edges have pixels. n pixels in shadow have edges of 2 sqrt(pi n) at least.
check_shadows() { # model sun
	local model=$1 sun=$2 source=$models/$1.glb json=$work/shadow.json view light suffix compared dark misplaced p99
	psr-model info "$models/$model.psr" --json >"$work/info.json"
	spacing=$(number "$work/info.json" spacing)
	height=$(awk "BEGIN { print $spacing * $size }")
	read -r cx cy cz <<<"$(array "$work/info.json" origin)"
	view=(--eye "$(place 1.1 1.3 1.5)" --target "$(place 0 0 0)" --up 0,1,0 --ortho "$height")
	for suffix in '' ,shadow; do
		light=dir:$sun$suffix
		if ! psr shot --server "$server" --model "$model" --size ${size}x$size "${view[@]}" --no-smooth --codec lossless \
			--ambient 0 --light "$light" -o "$work/frame$suffix.ppm" --depth "$work/depth.pfm" 2>"$work/err"; then
			not_ok "$model is drawn with light $light" "$(head -n 1 "$work/err")"
			return
		fi
	done
	psr-model accuracy "$source" --depth "$work/depth.pfm" "${view[@]}" --spacing "$spacing" --sun "$sun" \
		--lit "$work/frame.ppm" --shadow "$work/frame,shadow.ppm" --json >"$json" 2>"$work/err"
	if [ $? -gt 1 ]; then # 1: measured, with a depth that is not good enough; shadows have bounds of their own
		not_ok "the shadows of $model are measured" "$(head -n 1 "$work/err")"
		return
	fi
	compared=$(number "$json" shadow_compared) dark=$(number "$json" shadow_in_shadow)
	misplaced=$(number "$json" shadow_misplaced) p99=$(number "$json" shadow_seam_p99)
	printf '# %-8s %6d pixels compared, %5d in shadow, %4d misplaced, by p99 %.2f and %.2f pixels at most, mean %.4f\n' \
		"$model" "$compared" "$dark" "$misplaced" "$p99" "$(number "$json" shadow_seam_max)" "$(number "$json" shadow_mean)"
	check "$model casts shadows on itself" [ "$dark" -gt 100 ]
	check "$model: not more pixels are on the wrong side of an edge of a shadow than the edges have" \
		awk "BEGIN { exit !($misplaced ^ 2 <= 4 * 3.14159 * $dark) }"
	check "$model: 99 in 100 of these are off by 4 pixels or fewer" awk "BEGIN { exit !($p99 <= 4) }"
}

for model in toybird table; do
	check "$model is made" psr-model make "$model" -o "$work/$model.glb"
	if ! cmp -s "$work/$model.glb" "$models/$model.glb" || [ "$models/$model.psr" -ot "$BUILD/bin/psr-model" ]; then
		cp "$work/$model.glb" "$models/$model.glb"
		check "$model is built" psr-model build "$models/$model.glb" -r $size -o "$models/$model.psr" --quiet
	fi
done
start_psrd --models "$models"
check_shadows toybird -1,-2,-0.5
check_shadows table -1,-2,-0.5
check "psrd stops cleanly" stop_psrd
