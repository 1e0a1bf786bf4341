#!/bin/bash
# needs: psr-model
# psr fetch: files as they are, broken off and gone on with, levels of octrees, what is damaged or changed.
. "$(dirname "$0")/lib.sh"

relay_pid=
start_relay() { # relay's options; sets $through
	: >"$work/relay"
	"$BUILD/tests/tools/relay" --to "$server" "$@" >"$work/relay" 2>"$work/relay.log" &
	relay_pid=$!
	for _ in $(seq 600); do
		grep -q '^READY' "$work/relay" && break
		kill -0 $relay_pid 2>/dev/null || break
		sleep 0.05
	done
	through=$(sed -n 's/^READY //p' "$work/relay")
}
stop_relay() {
	[ -n "$relay_pid" ] || return 0
	kill -TERM $relay_pid
	wait $relay_pid
	relay_pid=
}
trap 'stop_relay; finish; exit $?' EXIT

mkdir "$work/models" "$work/here"
awk 'BEGIN { srand(1); for (i = 0; i < 60000; i++) { a = rand() * 6.2832; z = 2 * rand() - 1; r = sqrt(1 - z * z);
	print r * cos(a), r * sin(a), z, int(rand() * 256), int(rand() * 256), 99 } }' >"$work/ball.xyz"
psr-model build "$work/ball.xyz" --representation octree --levels 8 --pack -q -o "$work/models/ball.psr"
cp tests/golden/teapot.psr "$work/models"
psr-model make pencil -o "$work/models/pencil.glb" >/dev/null
start_psrd --models "$work/models" --cache "$work/cache" --resolution 64
cd "$work/here" || exit 1
fetch() { psr fetch --server "$server" "$@"; }

check "a packed octree is fetched" fetch ball
check "as the server has it" cmp ball.psr "$work/models/ball.psr"
check "so is a plain file" fetch teapot -o pot.psr
check "byte for byte" cmp pot.psr "$work/models/teapot.psr"
check "a source is built first" fetch pencil
check "and its model is one" psr-model info pencil.psr
check "nothing else is left" [ "$(echo *)" = "ball.psr pencil.psr pot.psr" ]
is "a file that is whole already is not fetched again" "ball.psr: $(psr fetch ball --server "$server" | sed 's/^[^:]*: //')" \
	"$(fetch ball | sed 's/; [0-9.]* MB fetched$/; 0.00 MB fetched/')"

# Levels: 8 in all, in steps of two.
check "the first levels alone" fetch ball --level 6 -o few.psr
is "are a model of six levels" "6 of 8 levels" "$(psr-model info few.psr | grep -o '6 of 8 levels')"
check "and the rest goes on behind them" bash -c 'psr fetch --server "$1" ball -o few.psr >said' - "$server"
check "without those that are there" grep -qvF "$(stat -c %s ball.psr | awk '{ printf "%.2f MB fetched", $1 / 1e6 }')" said
check "and makes the whole file" cmp few.psr ball.psr
refuses "levels of a file that has none" 2 "has no levels to end at" fetch teapot --level 3 -o none.psr
check "such a file whole" fetch teapot -o whole.psr
refuses "its levels, when it is there" 2 "has no levels to end at" fetch teapot --level 3 -o whole.psr
check "nothing is left beside what is there whole" [ ! -e whole.psr.part ]
rm -f said none.psr.part whole.psr

# What psrd draws of these levels is what the part of the file is.
shot() { psr shot --server "$server" --size 96x96 "$@"; }
psr fetch --server "$server" ball --level 6 -o first.psr >/dev/null
check "the first levels are drawn" shot --model ball --level 5 --report r.json -o levels.ppm
check "from the same model as from the part of the file" \
	[ "$(jq -r .model.content_id r.json)" = "$(psr-model info first.psr --json | jq -r .content_id)" ]
is "and the report names them" "6 8 6" \
	"$(jq -r '"\(.model.octree_levels) \(.model.of_levels) \(.request.models[0].octree_levels)"' r.json)"
check "a picture too large for them says so" bash -c 'psr shot --server "$1" --model ball --level 5 --size 600x600 \
	-o levels.png 2>&1 | grep -q "ball has 6 of its 8 levels, for .* pixels; .* raise --level, or leave it out"' - "$server"
check "a replay draws them again" psr shot --server "$server" --replay r.json -o again.ppm
check "byte for byte" cmp levels.ppm again.ppm
check "without a level psrd draws the whole" shot --model ball --report r.json -o whole.ppm
is "whose report names none" null "$(jq .model.octree_levels r.json)"
check "which is another picture" bash -c '! cmp -s levels.ppm whole.ppm'
check "psr bench measures them" psr bench --server "$server" --model ball --level 5 --frames 3 --warmup 0 --record rec --json
check "which a recording names" grep -q '"octree_levels": *6' rec
rm -f rec first.psr r.json levels.png *.ppm

# Breaks: each connection is reset after so many bytes.
start_relay --reset-down 150000 --rate-down 16 --split 5000
refuses "a connection that is reset ends it" 6 "." psr fetch --server "$through" ball -o broken.psr
check "what came stays, and the file has not its name" [ -s broken.psr.part -a ! -e broken.psr ]
check "it is known to be right" cmp -n "$(stat -c %s broken.psr.part)" broken.psr.part ball.psr
check "and drawn, coarse" psr shot broken.psr.part --size 64x64 -o part.png
n=0
until psr fetch --server "$through" ball -o broken.psr >/dev/null 2>&1; do
	n=$((n + 1))
	[ $n -lt 100 ] || break
done
stop_relay
check "further tries bring the rest" cmp broken.psr ball.psr
check "which were several" [ $n -ge 1 ]
start_relay --reset-down 80000 --faulty 1
rm -f broken.psr
psr fetch --server "$through" teapot -o broken.psr >/dev/null 2>&1
printf 'xxxx' | dd of=broken.psr.part bs=1 seek=$(($(stat -c %s broken.psr.part) / 2)) conv=notrunc 2>/dev/null
check "a part with wrong bytes in it" bash -c 'psr fetch --server "$1" teapot -o broken.psr 2>said' - "$through"
check "is cut before them, with a sentence" grep -q "are damaged" said
check "and mended" cmp broken.psr "$work/models/teapot.psr"
stop_relay
start_relay --cut-down 40000
refuses "a server that falls silent" 6 "has not answered" psr fetch --server "$through" --timeout 2 teapot -o silent.psr
stop_relay

# The server's file changes, is damaged, is itself a part.
head -c 50000 ball.psr >other.psr.part
psr-model build "$work/ball.xyz" --representation octree --levels 7 --pack -q -o "$work/models/ball.psr"
check "a part of a file that the server has no more" bash -c 'psr fetch --server "$1" ball -o other.psr 2>said' - "$server"
check "is fetched from the beginning, with a sentence" grep -q "another file than the server has" said
check "as it is now" cmp other.psr "$work/models/ball.psr"
cp other.psr sound.psr
printf 'xxxx' | dd of="$work/models/ball.psr" bs=1 seek=30000 conv=notrunc 2>/dev/null
refuses "a file that is damaged on the server" 4 "the server's file: bytes .* are damaged" fetch ball -o bad.psr
check "leaves what is right of it" cmp -n "$(stat -c %s bad.psr.part)" bad.psr.part sound.psr
check "and has not its name" [ ! -e bad.psr ]
head -c 40000 sound.psr >"$work/models/ball.psr"
check "a server that has a part gives that" bash -c 'psr fetch --server "$1" ball -o half.psr | grep -q "the first 0.04 of"' - "$server"
refuses "a model that is not there" 3 "there is no model kettle" fetch kettle
refuses "no model at all" 2 "name a model" fetch
check "a second psr fetch of one file" bash -c 'exec 9>>held.psr.part; flock 9; psr fetch --server "$1" teapot -o held.psr 2>said;
	[ $? -eq 6 ] && grep -q "another psr fetch writes it" said' - "$server"
cd / && check "psrd is well" psr list --server "$server"
