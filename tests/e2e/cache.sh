#!/bin/bash
# Builds and their cache from outside: what clients are told, what stays behind, when the disk is full or processes die.
# needs: psr-model
. "$(dirname "$0")/lib.sh"

models=$work/models cache=$work/cache
mkdir "$models"
tetrahedron() { # size
	printf 'v 0 0 0\nv %s 0 0\nv 0 %s 0\nv 0 0 %s\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' "$1" "$1" "$1"
}
shot() { psr shot --server "$server" --size 64x64 --codec lossless "$@"; }
hash_of() { shot --model "$1" --hash 2>/dev/null; }
says_no_path() { # claim pattern model: the picture is refused, in words without a folder of the server
	shot --model "$3" -o "$work/none.png" >"$work/out" 2>"$work/err" && { not_ok "$1" "there is a picture"; return; }
	if grep -qE -- "$2" "$work/err" && ! grep -qF "$work" "$work/err"; then
		ok "$1: $(head -n 1 "$work/err")"
	else
		not_ok "$1" "$(cat "$work/err")"
	fi
}
built() { find "$cache" -name '*.psr' 2>/dev/null | wc -l; }

# --- what clients are told ---
tetrahedron 1 >"$models/good.obj"
printf 'solid broken' >"$models/broken.stl"
head -c 3000 /dev/urandom >"$models/random.glb"
printf 'mtllib textured.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n' >"$models/textured.obj"
printf 'newmtl red\nmap_Kd pictures/gone.png\n' >"$models/textured.mtl"
tetrahedron 2 >"$models/locked.obj"
start_psrd --models "$models" --cache "$cache" --resolution 32 --max-resolution 32
says_no_path "a broken file" ': broken\.stl: no triangle' broken
says_no_path "random bytes" ': random\.glb: broken JSON' random
if shot --model textured -o "$work/textured.png" 2>"$work/err"; then
	ok "a missing texture costs the texture alone"
else
	says_no_path "a missing texture" 'textured\.obj: .*gone\.png' textured
fi
if [ "$(id -u)" -ne 0 ]; then
	chmod 0 "$models/locked.obj"
	says_no_path "a file that may not be read" 'Permission denied' locked
else
	skip "a file that may not be read" "root may read all"
fi
rm -f "$models/locked.obj"
says_no_path "a file that has gone" 'locked' locked
check "a good one is built beside them" shot --model good -o "$work/good.png"
check "psrd ends" stop_psrd

# --- the size of the cache ---
rm -rf "$cache"
for i in 1 2 3 4; do tetrahedron $i >"$models/t$i.obj"; done
start_psrd --models "$models" --cache "$cache" --resolution 32 --max-resolution 32
first=$(hash_of t1)
size=$(find "$cache" -name '*.psr' -size -1000k -printf '%s\n' | head -n 1)
stop_psrd
start_psrd --models "$models" --cache "$cache" --resolution 32 --max-resolution 32 --cache-size $((3 * size + size / 2))
for i in 2 3 4; do hash_of t$i >/dev/null; done
n=$(built)
if [ "$n" -eq 3 ]; then ok "the cache keeps what its size allows"; else not_ok "the cache keeps what its size allows" "$n models"; fi
again=$(hash_of t1)
if [ -n "$first" ] && [ "$first" = "$again" ]; then
	ok "what it lost is built again, the same"
else
	not_ok "what it lost is built again, the same" "'$again', expected '$first'"
fi
stop_psrd

# --- who may write to it ---
chmod 0777 "$cache"
refuses "a cache that others can write" 3 'mode 0777: others may write' \
	psrd --listen 127.0.0.1:0 --models "$models" --cache "$cache"
chmod 0700 "$cache"

# --- a full disk ---
mkdir "$work/full"
if mount -t tmpfs -o size=64k psr-test "$work/full" 2>/dev/null; then
	head -c 60000 /dev/zero >"$work/full/filler"
	start_psrd --models "$models" --cache "$work/full/cache" --resolution 256 --max-resolution 256
	says_no_path "a full disk" 't1\.obj: cannot write the cache: No space left' t1
	left=$(find "$work/full/cache" -type f | wc -l)
	if [ "$left" -eq 0 ]; then ok "it leaves nothing half-written"; else not_ok "it leaves nothing half-written" "$left files"; fi
	rm "$work/full/filler"
	mount -o remount,size=64m "$work/full"
	check "with room the same psrd builds it" shot --model t1 -o "$work/t1.png"
	stop_psrd
	umount "$work/full"
else
	skip "a full disk" "this user mounts nothing"
fi

# --- processes that die ---
child() { pgrep -P "$psrd_pid" -f 'psr-model build'; }
wait_for_child() { # while|until
	for _ in $(seq 400); do
		if [ "$1" = until ] && child >/dev/null; then return 0; fi
		if [ "$1" = while ] && ! child >/dev/null; then return 0; fi
		sleep 0.05
	done
	return 1
}
rm -rf "$cache"
psr-model make teapot -o "$models/heavy.glb" 2>"$work/err"
start_psrd --models "$models" --cache "$cache" --resolution 4096 --max-resolution 4096 --threads 1
ask_heavy() { # the client itself, not a shell, is in the background
	psr shot --server "$server" --size 64x64 --model heavy -o "$work/heavy.png" 2>"$work/heavy.err" &
	client=$!
}
ask_heavy
check "a build runs" wait_for_child until
kill -KILL "$(child)"
wait $client
if grep -q 'was killed (signal 9)' "$work/heavy.err"; then
	ok "a killed build ends its request: $(head -n 1 "$work/heavy.err")"
else
	not_ok "a killed build ends its request" "$(cat "$work/heavy.err")"
fi
ask_heavy
check "the next request starts another" wait_for_child until
kill $client
wait $client 2>/dev/null
check "which ends when its client is gone" wait_for_child while
ask_heavy
wait_for_child until
pid=$(child)
kill -KILL $psrd_pid
wait $psrd_pid 2>/dev/null
psrd_pid=
for _ in $(seq 100); do kill -0 "$pid" 2>/dev/null || break; sleep 0.05; done
if [ -n "$pid" ] && ! kill -0 "$pid" 2>/dev/null; then
	ok "a killed psrd leaves no build"
else
	not_ok "a killed psrd leaves no build" "process '$pid'"
fi
wait $client 2>/dev/null
