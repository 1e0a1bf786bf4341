#!/bin/bash
# not for threads
# psr bench: what it counts, against psrd's own count; a psrd that stops for a second, seen by an open loop and not by a
# closed one; a thousand connections; pictures that are verified, recorded and sent again; mixes; searches. And psr stats.
. "$(dirname "$0")/lib.sh"
size=64x48
json=$work/bench.json

holds() { # claim expression-of-awk
	if awk "BEGIN { exit !($2) }"; then ok "$1 ($2)"; else not_ok "$1" "not so: $2"; fi
}
bench() { psr bench --server "$server" --size $size "$@"; }
stat() { psr stats --server "$server" --json >"$work/stats" && number "$work/stats" "$1"; }
of() { tr -d '\n\t ' <"$json" | sed -n "s/.*\"$1\":{[^}]*\"$2\":\([-+0-9.eE]*\).*/\1/p"; } # object key

ulimit -S -n 4096 2>/dev/null
start_psrd --models tests/golden --threads 2 --max-clients 1100 --frame-timeout 600

# --- counts ---
frames=$(stat frames) connections=$(stat connections_total)
check "a closed loop of 200 requests" bench --model dice --clients 3 --frames 200 --warmup 0 --json --path zoom
mv "$work/out" "$json"
is "all of them are measured" 200 "$(of latency_ms n)"
is "psrd has counted as many" 200 $(($(stat frames) - frames))
is "over three connections, the first one and that of each psr stats" 6 $(($(stat connections_total) - connections))
is "no frame has failed" 0 "$(number "$json" failed)"
holds "the first byte comes before the last" "$(of first_byte_ms p50) <= $(of latency_ms p50)"
holds "the server's time is part of the latency" "$(of total mean) + $(of queue mean) <= $(of latency_ms mean)"
holds "percentiles rise" "$(of latency_ms p50) <= $(of latency_ms p90) && $(of latency_ms p99) <= $(of latency_ms max)"
check "an open loop of 60 requests, decoded" bench --model dice --rate 200 --poisson --frames 60 --warmup 0 --json --decode --threads 2
mv "$work/out" "$json"
is "all of them are measured" 60 "$(of latency_ms n)"
is "and decoded" 60 "$(of decode_ms n)"
check "views, with eight requests of a client under way" bench --model dice --views --inflight 8 --frames 200 --warmup 0 --clients 2 --json
mv "$work/out" "$json"
is "each request is drawn or superseded" 200 $(($(of latency_ms n) + $(number "$json" superseded)))
holds "some are superseded" "$(number "$json" superseded) > 0"

# --- a second that psrd does not live through ---
# Stops psrd for a second as soon as a load has measured its first one. The load's latencies: p99 and max.
stopped() { # bench's options
	: >"$work/rows"
	bench --model dice --clients 1 --seconds 6 --warmup 0 "$@" >"$work/rows" 2>&1 &
	local load=$!
	until grep -q frames/s "$work/rows" || ! kill -0 $load 2>/dev/null; do sleep 0.05; done
	kill -STOP $psrd_pid
	sleep 1
	kill -CONT $psrd_pid
	wait $load
	read -r p99 most < <(awk '$1 == "latency" { print $4, $6 }' "$work/rows")
}
# 40 requests a second for 6 s are 240. At least 40 of them are due in the second, 25 ms apart, and wait for its end; p99
# is the third longest latency, so at least 1 s - 3 * 25 ms. The histogram may say 1/256 less.
stopped --rate 40
holds "an open loop shows the second in its p99" "$p99 >= 920"
# One request waits for the second's end; the others are sent when it has passed.
stopped
holds "a closed loop has seen it once" "$most >= 500"
holds "and does not show it in its p99" "$p99 < 500"

# --- a thousand connections ---
if [ "$(ulimit -n)" -lt 2500 ]; then
	skip "a thousand connections" "this system gives a program $(ulimit -n) file descriptors"
else
	connections=$(stat connections_total)
	size=640x480
	check "a thousand connections from one process" bench --model teapot --clients 1000 --frames 60 --warmup 0 --json
	mv "$work/out" "$json"
	size=64x48
	is "psrd has seen all of them" 1002 $(($(stat connections_total) - connections))
	is "all frames have come" 60 "$(of latency_ms n)"
	holds "the load takes less than a tenth of psrd's time" "$(number "$json" processor_s) < 0.1 * $(number "$json" server_processor_s)"
fi
refuses "more clients than psrd takes" 6 "max-clients|full" bench --model dice --clients 1200 --frames 1

# --- right pictures ---
cat >"$work/mix" <<'END'
# two kinds
weight=3 model=dice path=random shadows size=64x48
weight=1 model=teapot model=dice path=flick size=40x30 codec=lossless quality=draft light=point:9,9,9
END
check "a mix is drawn here, too, and is the same" psr bench --server "$server" --mix "$work/mix" --frames 60 --warmup 0 \
	--verify 1 --verify-models tests/golden --record "$work/recording" --json
mv "$work/out" "$json"
is "all pictures were compared" 60 "$(number "$json" verified_right)"
is "a line for each request, and one for the kinds" 61 "$(wc -l <"$work/recording")"
check "both kinds are among them" test "$(grep -c '"kind":1' "$work/recording")" -gt 0 -a "$(grep -c '"kind":0' "$work/recording")" -gt 0
check "a recording is sent again" psr bench --server "$server" --replay "$work/recording" --verify 1 --json
mv "$work/out" "$json"
is "and gives the same pictures" 60 "$(number "$json" verified_right)"
sed '2,$s/"hash":"../"hash":"5a/' "$work/recording" >"$work/spoilt"
refuses "a wrong picture is found" 1 "request [0-9]+ of client [0-9]: the picture has the hash" \
	psr bench --server "$server" --replay "$work/spoilt" --verify 1
check "views are recorded" psr bench --server "$server" --size $size --model dice --views --inflight 8 --frames 200 --warmup 0 \
	--record "$work/views" --json
mv "$work/out" "$json"
is "with what was superseded" "$(number "$json" superseded)" "$(grep -c '"outcome":"superseded"' "$work/views")"
psr bench --server "$server" --size 5000x5000 --model dice --frames 3 --warmup 0 --record "$work/failing" >"$work/out"
is "failures are recorded, too" 3 "$(grep -c '"outcome":"over a limit"' "$work/failing")"
psr bench --server "$server" --replay "$work/failing" --json >"$json"
is "and sent again" 3 "$(number "$json" failed)"
head -n 1 "$work/recording" >"$work/cut"
refuses "a recording without requests" 4 "has no requests" psr bench --server "$server" --replay "$work/cut"
(cat "$work/cut" && echo '{"at":0,"client":99}') >"$work/bad"
refuses "a recording with a client that it does not have" 4 "line 2 has no usable client" psr bench --server "$server" --replay "$work/bad"
refuses "a model that the folder lacks" 3 "no .psr file in .* is the server's dice" \
	bench --model dice --frames 5 --warmup 0 --verify 1 --verify-models "$work"

# --- mixes and options that are wrong ---
mix() { printf '%b' "$1" >"$work/mix" && psr bench --server "$server" --mix "$work/mix" --frames 1; }
refuses "an unknown word" 2 "mix:2:12: .*colour" mix 'model=dice\nmodel=dice colour=red\n'
refuses "a weight of nothing" 2 "mix:1:12: .*weight" mix 'model=dice weight=0\n'
refuses "a line without a model" 2 "mix:1:1: .*model" mix 'size=64x48\n'
refuses "a path that is no file" 3 "cannot read nosuch" mix 'model=dice path=nosuch\n'
refuses "an empty mix" 2 "has no line" mix '# nothing\n'
refuses "seventeen lines" 5 "mix:17:1: a mix has at most 16 lines" mix "$(for _ in $(seq 17); do printf 'model=dice\\n'; done)"
refuses "a mix beside a model" 2 "its lines say which models" bench --mix "$work/mix" --model dice
refuses "an open and a closed loop" 2 "--rate excludes --inflight" bench --model dice --rate 5 --inflight 2
refuses "a sweep of nothing" 2 "--sweep takes" bench --model dice --sweep clients=4
refuses "a sweep that falls" 2 "the range rises" bench --model dice --sweep rate=4..2
refuses "a limit without a unit" 2 "--slo takes" bench --model dice --slo p99=50
refuses "a plot of no known kind" 2 "neither in .svg nor in .png" bench --model dice --plot plot.gif
refuses "a plot without gnuplot" 3 "not installed; install the package gnuplot-nox" env "PATH=$BUILD/bin" \
	psr bench --server "$server" --model dice --frames 1 --plot "$work/plot.svg"

# --- several loads ---
check "a sweep" bench --model dice --sweep clients=1..4/3 --seconds 0.3 --warmup 0
mv "$work/out" "$work/sweep"
is "has a line for each load" "1 2 4" "$(awk '$1 ~ /^[0-9]+$/ { print $1 }' "$work/sweep" | paste -sd' ')"
check "and names the knee" grep -q "^knee: clients [124]," "$work/sweep"
search() { bench --model dice --slo p99=1000s --sweep rate=5..10 --seconds 0.5 --warmup 0 "$@"; }
check "a limit that always holds" search --floor 10
mv "$work/out" "$work/search"
check "finds the greatest load" grep -q "^greatest rate that holds p99=1000s: 10$" "$work/search"
search --floor 11 >"$work/out"
is "below the floor the exit status is 1" 1 $?
bench --model dice --slo p50=1us --sweep clients=1..2 --seconds 0.3 --floor 1 >"$work/out"
is "so is it when no load holds" 1 $?
check "rows as a table" bench --model dice --seconds 1.2 --csv "$work/rows.csv"
check "have a head and a line a second" awk -F, 'NF != 9 { exit 1 } END { exit NR < 2 }' "$work/rows.csv"

# --- psr stats ---
psr stats --server "$server" --prometheus >"$work/metrics"
check "metrics are those of Prometheus" awk '
	/^# TYPE psrd_[a-z_]+ (counter|gauge)$/ { typed[$3] = 1; next }
	/^# HELP psrd_[a-z_]+ / { next }
	/^psrd_[a-z_]+ [-+0-9.e]+$/ && typed[$1] { n++; next }
	{ exit 1 }
	END { exit n < 20 }' "$work/metrics"
check "each id that psrd counts has a name" test "$(psr stats --server "$server" | wc -l)" -eq "$(grep -c '^psrd_' "$work/metrics")"
: >"$work/watch"
psr stats --server "$server" --watch >"$work/watch" &
watch=$!
until grep -q '^frames .*/s$' "$work/watch" || ! kill -0 $watch 2>/dev/null; do sleep 0.05; done
check "--watch tells the growth a second" kill $watch
wait $watch 2>/dev/null
refuses "two forms at once" 2 "exclude each other" psr stats --server "$server" --json --prometheus
check "psrd stops cleanly" stop_psrd
