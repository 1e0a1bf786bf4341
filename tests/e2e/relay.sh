#!/bin/bash
# psr and psrd over bad networks: small pieces, a slow line, stalls, ends and silence in the middle of a frame. Who is
# left says so, and the daemon serves the next client at once with the memory and the descriptors that it had before.
. "$(dirname "$0")/lib.sh"
relay_pid=

start_relay() { # relay's options; sets $through
	: >"$work/relay"
	"$BUILD/tests/tools/relay" --to "$server" "$@" >"$work/relay" 2>"$work/relay.log" &
	relay_pid=$!
	for _ in $(seq 200); do
		grep -q '^READY' "$work/relay" && break
		kill -0 $relay_pid 2>/dev/null || break
		sleep 0.02
	done
	through=$(sed -n 's/^READY //p' "$work/relay")
}
stop_relay() { # what it counted is in $work/relay
	[ -n "$relay_pid" ] || return 0
	kill -TERM $relay_pid
	wait $relay_pid
	relay_pid=
}
trap 'stop_relay; finish; exit $?' EXIT

counted() { sed -n "s/.*$1 \([0-9]*\).*/\1/p" "$work/relay"; }
shot() { psr shot --server "$through" --model teapot --size 320x240 "$@"; }
hash() { shot --hash "$@" 2>&1 | grep -oE 'color [0-9a-f]{16}'; }
descriptors() { find "/proc/$psrd_pid/fd" -mindepth 1 2>/dev/null | wc -l; }
memory() { sed -n 's/^VmRSS:[^0-9]*\([0-9]*\).*/\1/p' "/proc/$psrd_pid/status"; }
has_descriptors() { [ "$(descriptors)" -eq "$1" ]; }

start_psrd --models tests/golden --threads 2 --idle-timeout 2
direct=$server
through=$direct
expected=$(hash)
case $expected in
'color '????????????????) ok "a picture comes without a relay" ;;
*) not_ok "a picture comes without a relay" "$expected" ;;
esac
idle=$(descriptors)

# --- what changes only how bytes come ---
for seed in 1 2 3; do
	start_relay --split 7 --seed $seed
	is "pieces of 1 to 7 bytes make the same picture, seed $seed" "$expected" "$(hash)"
	stop_relay
done
start_relay --listen "unix:$work/socket" --split 1
is "so do single bytes, over a Unix socket" "$expected" "$(hash --size 320x240)"
stop_relay
start_relay --rate-down 1 --rate-up 1 --delay 50 --jitter 10
is "so does a line of 1 Mbit/s with 100 ms of round trip" "$expected" "$(hash)"
stop_relay
check "which carried all of it" [ "$(counted down)" -gt 10000 ]
start_relay --stall 150 --every 200
is "so does one that stands still three quarters of the time" "$expected" "$(hash)"
stop_relay

# --- ends in the middle ---
# The first connection of each relay ends after so many bytes, the next ones are sound. The whole exchange has some 20 KB:
# the ends fall into WELCOME, into OPENED and FRAME_BEGIN, and into rectangles.
for bytes in 20 200 700 9000; do
	start_relay --reset-down $bytes --faulty 1
	refuses "a reset after $bytes bytes of the server" 6 "the (server closed the connection|connection is lost)" shot --hash
	is "and the next client is served" "$expected" "$(hash)"
	stop_relay
	is "there was one reset" 1 "$(counted resets)"
done
start_relay --close-down 9000 --faulty 1
refuses "an end after 9000 bytes" 6 "closed the connection" shot --hash
stop_relay
for bytes in 30 150 300; do
	start_relay --reset-up $bytes --faulty 1
	refuses "a reset after $bytes bytes of the client" 6 "the (server closed the connection|connection is lost)" shot --hash
	stop_relay
done
check "psrd keeps no descriptor of them" wait_for 30 has_descriptors "$idle"

before=$(memory)
start_relay --reset-down 9000
for _ in $(seq 60); do
	shot --hash 2>/dev/null
done
stop_relay
is "60 more are reset in the middle of a frame" 60 "$(counted resets)"
check "and leave no descriptor" wait_for 30 has_descriptors "$idle"
# an answer that stayed would be 40 KB of rectangles, a connection 70 KB of buffers: 60 of them more than 2 MB
after=$(memory)
if [ "${CONFIG:-release}" = asan ] || [ "${CONFIG:-release}" = tsan ]; then
	skip "and no memory" "sanitizers keep what is freed"
else
	check "and no memory: $before kB before, $after kB after" [ $((after - before)) -lt 2048 ]
fi
server=$direct through=$direct
is "psrd draws the same after all that" "$expected" "$(hash)"

# --- silence ---
start_relay --cut-up 400 --cut-down 9000
shot --hash --timeout 60 >"$work/cut" 2>&1 &
waiting=$!
is_connected() { [ "$(descriptors)" -gt "$idle" ]; }
check "a client is connected" wait_for 30 is_connected
kill -KILL $waiting
wait $waiting 2>/dev/null
check "one that goes without a word is found by its silence" wait_for 30 has_descriptors "$idle"
stop_relay
start_relay --cut-down 9000
refuses "a server that goes silent in the middle of a frame is given up" 6 "no frame within 3 s" \
	shot --hash --timeout 3
stop_relay

# --- who is killed ---
long_shot() { # in the background: pass 0 has come soon, the others take many seconds; sets $waiting
	psr shot --server "$through" --model teapot --size 1600x1200 --passes 4 --hash >"$work/killed" 2>&1 &
	waiting=$!
	wait_for 30 is_connected
	sleep 0.3
}
start_relay --delay 5
long_shot
check "a client is in the middle of its frames" is_connected
kill -KILL $waiting
wait $waiting 2>/dev/null
check "killed, it leaves nothing with psrd" wait_for 30 has_descriptors "$idle"
is "which serves the next one" "$expected" "$(hash)"
long_shot
check "another client is in the middle of its frames" is_connected
kill -KILL "$psrd_pid"
wait "$psrd_pid" 2>/dev/null
psrd_pid=
wait $waiting
is "if the daemon is killed, it ends with 6" 6 $?
check "and says that: $(tail -n 1 "$work/killed")" grep -qE "the (server closed the connection|connection is lost)" "$work/killed"
stop_relay
