#!/bin/bash
# Budgets of time and error: what psrd chose draws the same picture again; a bound is kept, or said to be broken; prices
# are told. No claim depends on how long a frame takes.
. "$(dirname "$0")/lib.sh"

start_psrd --models tests/golden --threads 2 --frame-timeout 600
keep() { # command...: keeps what it prints, as check prints of its own
	"$@" >"$work/said.out" 2>"$work/said"
	local status=$?
	cat "$work/said.out"
	cat "$work/said" >&2
	return $status
}
shot() { keep psr shot --server "$server" "$@"; }
of_report() { # expression over the report r
	python3 -c "import json, sys; r = json.load(open(sys.argv[1])); print(eval(sys.argv[2]))" "$work/r.json" "$1"
}
line='^psr shot: chose (pass|scale|spacing) .* for .* ms, took .* ms; (cheaper|better): '

budgets="0.001ms 3ms 60000ms 0.01px 0.7px 2px 20px"
# Threads do the same for all of them.
[ "${CONFIG:-release}" != tsan ] || budgets="3ms 0.7px"
for budget in $budgets; do
	check "a budget of $budget is drawn" \
		shot --model teapot --size 160x120 --budget $budget --report "$work/r.json" -o "$work/a.ppm"
	check "and says what was chosen" grep -qE "$line" "$work/said"
	check "its report draws the same bits again" shot --replay "$work/r.json" -o "$work/b.ppm"
	check "which they are" cmp "$work/a.ppm" "$work/b.ppm"
	is "the report names the budget" $budget "$(of_report "r['budget']['asked']")"
	is "and prices: of what is drawn, and of neighbours but at the ends of the ladder" True "$(of_report "(lambda b:
		all(b[k]['ms'] > 0 for k in ('chosen', 'cheaper', 'better') if k in b) and
		('cheaper' in b) == (b['chosen']['scale'] < 4) and ('better' in b) == (b['chosen']['pass'] < 4) and
		all(r[k] == b['chosen'][k] for k in ('scale', 'spacing_px', 'smooth')))(r['budget'])")"
done
check "20 px are kept" shot --model teapot --size 160x120 --budget 20px --report "$work/r.json" -o "$work/a.ppm"
is "and the report says so" "True True ok" \
	"$(of_report "' '.join(map(str, (r['budget']['kept'], r['budget']['error_px'] <= 20, r['status'])))")"
check "0.001 px are not" shot --model teapot --size 160x120 --budget 0.001px --report "$work/r.json" -o "$work/a.ppm"
check "and the program says so" grep -q 'the budget of 0.001.*px was not kept' "$work/said"
is "and the report, whose frame is the best there is" "False coarse 4" \
	"$(of_report "' '.join(map(str, (r['budget']['kept'], r['status'], r['budget']['chosen']['pass'])))")"
check "a microsecond is too short" \
	shot --model teapot --size 160x120 --budget 0.001ms --report "$work/r.json" -o "$work/a.ppm"
is "a frame comes, and says so" "False late" "$(of_report "' '.join(map(str, (r['budget']['kept'], r['status'])))")"
check "a turntable has budgets" \
	keep psr turntable --server "$server" --model teapot --size 80x60 --frames 5 --budget 0.001ms -o "$work/t%d.ppm"
check "and counts what is over" grep -q '^psr turntable: 5 of 5 pictures are over the budget$' "$work/said"

for bad in 12 ms 0ms -1ms nanms 12s 1e9ms 0px infpx 1mpx 0dB 100dB 30db ""; do
	refuses "a budget of '$bad'" 2 "--budget takes a time such as 12ms" \
		shot --model teapot --budget "$bad" -o "$work/a.ppm"
done
refuses "a likeness to the source of a model that nobody measured" 4 "psr-model build --calibrate" \
	shot --model teapot --budget 30dB -o "$work/a.ppm"
for other in "--quality good" "--spacing 1" "--smooth" "--no-smooth" "--passes 0"; do
	# shellcheck disable=SC2086
	refuses "a budget with $other" 2 "it excludes" shot --model teapot --budget 3ms $other -o "$work/a.ppm"
done

bench() { keep psr bench --server "$server" --model teapot --size 128x96 --clients 2 --frames 60 --warmup 0 "$@"; }
check "a load has budgets, and its frames are those of their settings" \
	bench --budget 5ms --verify 7 --verify-models tests/golden
check "it says how many kept theirs" grep -qE '^within the budget: [0-9.]+ % of 60$' "$work/said.out"
check "a mix, too" bash -c "echo 'model=teapot budget=3px size=64x64' >'$work/mix'; psr bench --server '$server' \
	--mix '$work/mix' --clients 2 --frames 30 --warmup 0 --codec lossless --verify 1 --verify-models tests/golden"

# Which settings are the cheapest depends on times: any picture of the object will do.
printf 'models=%s\ntest=%s model=teapot size=64x64 budget=%s reference=%s.png psnr=5\n' \
	"$PWD/tests/golden" bound 20px bound >"$work/a.suite"
printf 'test=%s model=teapot size=64x64 budget=%s reference=%s.png psnr=5\n' tight 0.001px tight >>"$work/a.suite"
psr test --accept '*' "$work/a.suite" >"$work/sum" 2>&1
psr test "$work/a.suite" >"$work/sum" 2>&1
check "a suite has budgets" grep -q '^1 passed, 1 failed$' "$work/sum"
check "and a broken bound fails" grep -q 'FAILED.*tight: the error bound is .* px, over the budget' "$work/sum"
