#!/bin/bash
# not for threads
# Planes beside colour and depth, and pictures of stages: the same bytes whatever the threads, the ISA and the codec of
# colour; files of the right size; each stage a picture of its own.
. "$(dirname "$0")/lib.sh"
planes=(color depth normal id weight words block bound)
stages=(blocks samples cull levels normals weights holes depth)
views=("--model teapot" "--model dice --eye 1,0.8,1.2 --ortho 0.5" "--model wheel --size 64x48")

shot() { psr shot --server "$server" --size 301x203 --no-smooth "$@"; }
hashes() {
	for view in "${views[@]}"; do
		for plane in "${planes[@]}"; do
			# shellcheck disable=SC2086
			shot $view --plane "$plane" --hash
		done
	done
}

for run in "1 avx512" "3 avx512" "2 avx2" "2 c"; do
	PSR_ISA=${run#* } start_psrd --models tests/golden --threads "${run% *}"
	hashes >"$work/hashes-${run/ /-}"
	check "psrd of ${run% *} threads, ${run#* } at most, stops cleanly" stop_psrd
	check "its planes are those of one thread" cmp "$work/hashes-1-avx512" "$work/hashes-${run/ /-}"
done
is "every plane of every view has a hash" 24 "$(grep -cE '^[a-z]+ [0-9a-f]{16}$' "$work/hashes-1-avx512")"

start_psrd --models tests/golden --threads 2
teapot() { shot --model teapot "$@"; }
while read -r plane bytes; do
	check "the $plane plane is written as .npy" teapot --plane "$plane" -o "$work/$plane.npy"
	is "with $bytes bytes a pixel behind a header of 128" $((128 + 301 * 203 * bytes)) "$(stat -c %s "$work/$plane.npy")"
done <<-END
	color 3
	depth 4
	normal 6
	id 4
	weight 1
	words 8
	block 3
	bound 2
END
check "colour is written as a picture, too" teapot --plane color -o "$work/color.ppm"
check "and has the same bytes" cmp <(tail -c +129 "$work/color.npy") <(tail -c $((301 * 203 * 3)) "$work/color.ppm")
check "depth goes to .pfm" teapot --plane depth -o "$work/depth.pfm"
check "normals go to .png" teapot --plane normal -o "$work/normal.png"
check "weights go to .ppm" teapot --plane weight -o "$work/weight.ppm" --depth "$work/more.pfm"
check "with the same depth beside them" cmp "$work/depth.pfm" "$work/more.pfm"
is "one instance has one id, and the rest none" "00000000 ffffffff" \
	"$(tail -c +129 "$work/id.npy" | od -An -v -tx4 -w4 | tr -d ' ' | sort -u | tr '\n' ' ' | sed 's/ $//')"
is "--hash prints the planes that were asked for" "depth weight" \
	"$(teapot --plane weight --depth "$work/more.pfm" --hash | cut -d' ' -f1 | tr '\n' ' ' | sed 's/ $//')"
expected=$(teapot --plane words --hash)
for codec in raw jpeg:50; do
	is "--codec $codec changes no plane but colour" "$expected" "$(teapot --plane words --hash --codec $codec)"
done

for stage in "${stages[@]}"; do
	check "--show $stage" teapot --show "$stage" -o "$work/show-$stage.ppm"
	check "--show $stage from near" teapot --eye 0,2,4 --show "$stage" -o "$work/near-$stage.ppm"
	is "is as large as asked for" $((15 + 301 * 203 * 3)) "$(stat -c %s "$work/show-$stage.ppm")"
done
is "no two stages look alike" $((2 * ${#stages[@]})) \
	"$(sha256sum "$work"/show-*.ppm "$work"/near-*.ppm | cut -d' ' -f1 | sort -u | wc -l)"
colors() { tail -c +16 "$1" | od -An -v -tu1 -w3 | sort -u | wc -l; }
check "blocks have colours of their own" [ "$(colors "$work/near-blocks.ppm")" -gt 100 ]
check "samples have more" [ "$(colors "$work/near-samples.ppm")" -gt "$(colors "$work/near-blocks.ppm")" ]
check "a stage as .png" teapot --show levels -o "$work/levels.png"
check "psrd stops cleanly at the end" stop_psrd
