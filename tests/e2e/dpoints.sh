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

# Sheer are surfaces of BLEND materials; the coverage of things narrower than a sample is none.
psr-model make pencil -o "$work/pencil.glb" >/dev/null
psr-model build "$work/pencil.glb" -r 64 -o "$work/pencil.psr" >/dev/null 2>"$work/said"
psr-model info "$work/pencil.psr" --json >"$work/pencil.json"
is "info counts as many sheer blocks as the build's note" "$(sed -n 's/.*note: \([0-9]*\) of .*/\1/p' "$work/said" | grep . || echo 0)" \
	"$(number "$work/pencil.json" sheer)"
