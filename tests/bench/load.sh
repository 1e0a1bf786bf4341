#!/bin/bash
# The clock of psr bench beside two others, of the same runs: the relay between it and psrd, which stamps messages as they
# pass, and psrd's own, from a request's arrival until the socket has taken its picture (STATS). Prints p50 and p99 of each,
# and whether they are within 1 % + 50 us; and psrd's reports, which end when the picture is coded. Wants a machine that does
# nothing else.
set -eu
cd "$(dirname "$0")/../.."
build=${BUILD:-build/release}
work=$(mktemp -d)
pids=
stop() {
	[ -z "$pids" ] || { kill $pids && wait $pids; } 2>/dev/null || :
	pids=
}
trap 'stop; rm -rf "$work"' EXIT

start() { # ready-file command...; sets `address`
	"${@:2}" >"$1" 2>"$1.log" &
	pids="$! $pids"
	for _ in $(seq 200); do
		address=$(sed -n 's/^READY //p' "$1")
		[ -z "$address" ] || return 0
		sleep 0.05
	done
	echo "bench-load: $2 does not start: $(tail -n 1 "$1.log")" >&2
	exit 1
}
number() { tr -d '\n\t ' <"$work/json" | sed -n "s/.*\"$1\":\([-+0-9.eE]*\).*/\1/p"; }
stat() { tr -d '\n\t ' <"$work/stats" | sed -n "s/.*\"$1\":\([0-9]*\).*/\1/p" | awk '{ print $1 / 1000 }'; }
of() { tr -d '\n\t ' <"$work/json" | sed -n "s/.*\"$1\":{[^}]*\"$2\":\([-+0-9.eE]*\).*/\1/p"; }
part() { # file part: the least number that is not below this part of all
	sort -g "$1" | awk -v part="$2" '{ v[NR] = $1 } END { k = int(part * NR); k += k < part * NR; print v[k < 1 ? 1 : k] }'
}
row() { # name p50 p99, in ms
	awk -v name="$1" -v p50="$2" -v p99="$3" -v q50="$ours50" -v q99="$ours99" '
		function off(a, b) { return a > b ? a - b : b - a }
		BEGIN { printf "%-28s %9.3f %9.3f   %s\n", name, p50, p99,
			off(p50, q50) <= 0.01 * p50 + 0.05 && off(p99, q99) <= 0.01 * p99 + 0.05 ? "agrees" : "off by more" }'
}

for load in '--clients 1' '--clients 8' '--clients 4 --rate 100 --poisson'; do
	rm -f "$work/socket"
	start "$work/psrd" "$build/bin/psrd" --listen "unix:$work/socket" --models tests/golden --cache "$work/cache" --threads 1 # cores are left for the others
	direct=$address
	start "$work/relay" "$build/tests/tools/relay" --to "$direct" --stamps "$work/stamps"
	# shellcheck disable=SC2086
	"$build/bin/psr" bench --server "$address" --model teapot --size 1024x768 --frames 1000 --warmup 0 --json --record "$work/recording" \
		$load >"$work/json"
	"$build/bin/psr" stats --server "$direct" --json >"$work/stats"
	stop
	awk '{ print $1 / 1000 }' "$work/stamps" >"$work/relayed"
	ours50=$(of latency_ms p50) ours99=$(of latency_ms p99)
	printf '%-28s %9s %9s\n' "$load" 'p50 ms' 'p99 ms'
	row 'psr bench' "$ours50" "$ours99"
	sed -n 's/.*"latency_ms":\([0-9.]*\).*/\1/p' "$work/recording" >"$work/recorded"
	row '  without the histogram' "$(part "$work/recorded" 0.5)" "$(part "$work/recorded" 0.99)"
	row 'stamps of the relay' "$(part "$work/relayed" 0.5)" "$(part "$work/relayed" 0.99)"
	row 'STATS of psrd' "$(stat answered_p50_us)" "$(stat answered_p99_us)"
	row 'reports of psrd, until coded' "$(of psrd_ms p50)" "$(of psrd_ms p99)"
	awk -v total="$(of total mean)" -v queue="$(of queue mean)" -v mean="$(of latency_ms mean)" 'BEGIN {
		printf "mean: %.3f ms, of which psrd reports %.3f waiting and %.3f at work\n\n", mean, queue, total }'
done
