# Shared by standard.sh and real.sh: views of a model at magnification 1 against the ray-traced truth of its source.
# Sourced after lib.sh.

# camera of a view: options of psr shot and of psr-model accuracy, whose heights are `height`, around cx cy cz
place() { awk "BEGIN { printf \"%.9g,%.9g,%.9g\", $cx + $1 * $height, $cy + $2 * $height, $cz + $3 * $height }"; }

# Draws one view, measures it, adds its counts to the model's; prints nothing.
measure_view() { # model source size camera-options...
	local model=$1 source=$2 size=$3 json=$work/accuracy.json key
	shift 3
	psr shot --server "$server" --model "$model" --size "${size}x$size" "$@" --no-smooth --codec lossless --ambient 1 \
		-o "$work/frame.ppm" --depth "$work/depth.pfm" 2>"$work/err" || return 1
	psr-model accuracy "$source" --depth "$work/depth.pfm" --color "$work/frame.ppm" "$@" --spacing "$spacing" \
		--json >"$json" 2>"$work/err"
	[ $? -le 1 ] || return 1 # 1: measured, and not good enough; the bounds of check_views decide
	for key in truth inside inside_empty holes outside_drawn color_compared color_wrong; do
		eval "sum_$key=\$((sum_$key + $(number "$json" $key)))"
	done
	worst_p999=$(awk "BEGIN { a = $(number "$json" distance_p999); print (a > $worst_p999 ? a : $worst_p999) }")
	worst_p50=$(awk "BEGIN { a = $(number "$json" distance_p50); print (a > $worst_p50 ? a : $worst_p50) }")
}

# Three views of a model that psrd serves: from the front, obliquely, in perspective. One line of numbers and a claim for
# each bound: holes and outside are pixels in 10,000 of those inside of the silhouette, p999 is the distance
# at the 99.9th percentile in spacings, color is pixels in 1000 whose colour is over 16 codes off.
check_views() { # model source psr-file size holes outside p999 color
	local model=$1 source=$2 size=$4 holes=$5 outside=$6 p999=$7 color=$8 target key
	psr-model info "$3" --json >"$work/info.json"
	spacing=$(number "$work/info.json" spacing)
	height=$(awk "BEGIN { print $spacing * $size }") # a pixel is as wide as the samples are apart
	read -r cx cy cz <<<"$(array "$work/info.json" origin)"
	target=$(place 0 0 0)
	for key in truth inside inside_empty holes outside_drawn color_compared color_wrong; do eval "sum_$key=0"; done
	worst_p999=0 worst_p50=0
	if ! measure_view "$model" "$source" "$size" --eye "$(place 0 0 2)" --target "$target" --up 0,1,0 --ortho "$height" ||
		! measure_view "$model" "$source" "$size" --eye "$(place 1.1 0.7 -1.3)" --target "$target" --up 0,1,0 \
			--ortho "$height" ||
		# Eight heights away the nearest part is 7.5 from the eye: 1 / (2 * 7.5 * tan(4.15)) = 0.92, so no part is magnified.
		! measure_view "$model" "$source" "$size" --eye "$(place -4.8 3.6 5.29152)" --target "$target" --up 0,1,0 \
			--fov 8.3; then
		not_ok "$model is drawn and measured" "$(head -n 1 "$work/err")"
		return
	fi
	printf '# %-11s %7d pixels of it, %6d inside: %3d holes, %3d of them empty, %4d drawn outside, p50 %.2f p99.9 %.2f, colour off %d of %d\n' \
		"$model" $sum_truth $sum_inside $sum_holes $sum_inside_empty $sum_outside_drawn "$worst_p50" "$worst_p999" \
		$sum_color_wrong $sum_color_compared
	check "$model: $holes or fewer holes in 10,000 pixels inside of the silhouette" \
		[ $((sum_holes * 10000)) -le $((sum_inside * holes)) ]
	check "$model: $outside or fewer in 10,000 are drawn more than a pixel outside of it" \
		[ $((sum_outside_drawn * 10000)) -le $((sum_truth * outside)) ]
	check "$model: 99.9 % are within $p999 of the sample spacing" awk "BEGIN { exit !($worst_p999 <= $p999) }"
	check "$model: $color or fewer in 1000 pixels have another colour" \
		[ $((sum_color_wrong * 1000)) -le $((sum_color_compared * color)) ]
}
