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

# Sheer are surfaces of BLEND materials; the coverage of things narrower than a sample is none.
psr-model make pencil -o "$work/pencil.glb" >/dev/null
psr-model build "$work/pencil.glb" -r 64 -o "$work/pencil.psr" >/dev/null 2>"$work/said"
psr-model info "$work/pencil.psr" --json >"$work/pencil.json"
is "info counts as many sheer blocks as the build's note" "$(sed -n 's/.*note: \([0-9]*\) of .*/\1/p' "$work/said" | grep . || echo 0)" \
	"$(number "$work/pencil.json" sheer)"
