#!/bin/bash
# not for threads
# docs/examples/client.py, which was written from PROTOCOL.md alone: vectors, then pictures from psrd in view 0 and in a
# view that moves, beside those of psr.
. "$(dirname "$0")/lib.sh"
export PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=docs/examples
size=160x120

if ! python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
	skip "a client in Python draws" "there is no python3 here, or one before 3.10"
	exit
fi
client() { python3 docs/examples/client.py --server "$address" --size $size "$@"; }
verify() { python3 tests/tools/client_check.py "$@"; }

check "it packs and unpacks the messages of proto/vectors.txt" verify messages
check "it refuses those that a client refuses" verify refused
check "its hashes are those of proto/planes.txt" verify hashes

mkdir "$work/models"
cp tests/golden/teapot.psr "$work/models/"
if type -P psr-model >/dev/null; then psr-model make pencil -o "$work/models/pencil.glb" >"$work/out"; fi
start_psrd --models "$work/models" --listen "unix:$work/socket" --cache "$work/cache" --resolution 64
address=$server

check "it lists the models" client
cp "$work/out" "$work/list"
check "as psr does" cmp "$work/list" <(psr list --server "$server" | awk 'NR > 1 { printf "%-6s %s\n", $2, $1 }')

pictures() { # model
	local camera model=$1
	read -ra camera < <(verify camera "$address" "$1" $size 2>/dev/null | tr '\n' ' ')
	shot() { psr shot --quality good --server "$server" --model "$model" --size $size "${camera[@]}" "$@" 2>/dev/null; }
	check "$model is drawn" client "$model" "$work/still.png"
	cp "$work/out" "$work/hashes"
	check "with the hashes of psr's picture" \
		cmp "$work/hashes" <(shot --no-smooth --hash -o "$work/still.ppm" --depth "$work/still.pfm")
	check "and its pixels" verify pixels "$work/still.png" "$work/still.ppm"
	check "$model moves" client "$model" "$work/moved.png" --view
	cp "$work/out" "$work/moves"
	check "some of its frames are superseded" grep -q '^[0-9]* superseded by [0-9]*$' "$work/moves"
	check "some are on a base" grep -q '^[0-9]*\.0 color [0-9a-f]* level 0 scale 2 on base [0-9]*\.[01] ' "$work/moves"
	tail -n 2 "$work/moves" >"$work/rest"
	check "at rest there is a sharp one" grep -q '\.1 color [0-9a-f]* level 0 scale 1 on ' "$work/rest"
	check "with the hash of psr's picture" \
		test "$(head -n 1 "$work/rest" | cut -d ' ' -f 2,3)" = "$(shot --hash)"
	check "and a refined one" grep -q '\.2 color [0-9a-f]* level 1 scale 1 on ' "$work/rest"
	check "with the hash of psr's picture" \
		test "$(tail -n 1 "$work/rest" | cut -d ' ' -f 2,3)" = "$(shot --passes 1 --hash -o "$work/moved.ppm")"
	check "and its pixels" verify pixels "$work/moved.png" "$work/moved.ppm"
}
pictures teapot
address=unix:$work/socket
if type -P psr-model >/dev/null; then
	check "a model is built first" client pencil "$work/still.png"
	cp "$work/err" "$work/progress"
	check "and its progress told" grep -q '^pencil: sampling [0-9]* of [0-9]*$' "$work/progress"
	pictures pencil
fi

refuses "it says how it is called" 2 'needs a file' client teapot
refuses "which size is wrong" 2 'not 0x10' client teapot "$work/a.png" --size 0x10
refuses "which model is missing" 3 'sphere' client sphere "$work/a.png"
refuses "which file cannot be written" 3 'cannot write .*none/a\.png' client teapot "$work/none/a.png"
refuses "what is over a limit" 5 '16384' client teapot "$work/a.png" --size 16384x16384
refuses "who does not answer" 6 'does psrd run there' client --server 127.0.0.1:1
refuses "which address is none" 2 'nowhere is no address' client --server nowhere
check "psrd stops cleanly" stop_psrd
