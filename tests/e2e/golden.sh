#!/bin/bash
# not for threads
# The golden frames through psrd, with all instructions that the machine has, by one thread and by two: what
# tests/golden/frames draws without sockets.
. "$(dirname "$0")/lib.sh"
suites="tests/golden/frames.suite tests/golden/octrees.suite tests/golden/dpoints.suite"
n=$(cat $suites | grep -c '^test=')

isas=c
for isa in avx2 avx512; do
	if PSR_ISA=$isa psrd --help | grep -qF "[$isa]"; then isas="$isas $isa"; fi # the default is capped by the machine
done
for isa in $isas; do
	for threads in 1 2; do
		start_psrd --models tests/golden --verbose --threads $threads --isa "$isa"
		# shellcheck disable=SC2086
		psr test --server "$server" $suites >"$work/sum"
		check "$n golden frames with $isa by $threads threads" grep -qx "$n passed, 0 failed" "$work/sum"
		check "psrd stops cleanly" stop_psrd
		check "it drew with $isa by $threads threads" grep -q "with $threads threads and $isa$" "$work/psrd.log"
	done
done

check "what a change would show is within its bounds, with a psrd of its own" psr test tests/golden/looks.suite
