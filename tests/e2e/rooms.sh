#!/bin/bash
# not for threads
# Rooms of the source tree include each other in one order: a line below may include itself and the lines above it. The
# longest prefix of a file is its room.
. "$(dirname "$0")/lib.sh"

cat >"$work/rooms" <<'END'
libpsr/include
libpsr/base
libpsr/dpoint
libpsr/compare
libpsr/octree
libpsr/model
libpsr/simd
libpsr/render
libpsr/import/import.h
libpsr/import/image
libpsr/import/cloud
libpsr/import/ply
libpsr/import/points
libpsr/import/gltf
libpsr/import/assimp
libpsr/import/cad
libpsr/import
libpsr/image
libpsr/cad
libpsr/surface
libpsr/ray
libpsr/measure
libpsr/sample/octree
libpsr/sample/dpoint
libpsr/sample/project
libpsr/sample/visible
libpsr/sample/own
libpsr/sample/thin
libpsr/sample/mend
libpsr/sample/level
libpsr/sample/levels
libpsr/sample/pack
libpsr/sample
proto
server/log server/options
server/net
server/models
server/frames
server/session
server
client/include
client/lib
client/cli
client/home/
client/scene
client/replay
client/output
client/draw
client/view/lens
client/view/hand
client/view/path
client/bench/
client/test/
client/view/link
client/view/
client/view/window
client
models/shapes
models/commands.h
models/accuracy/
models/price
models/studies/lib
models/studies/greedy
models/studies/cull
models/studies/tables/tables.h
models/studies/dpoint
models/studies
models
END

# Lines "file: included file" for what goes against the order, or for a file without a room.
against() {
	find libpsr proto server client models -name '*.[ch]' -o -name '*.cc' | sort >"$work/files"
	xargs grep -H '^#include "' <"$work/files" | awk -v order="$1" -v files="$work/files" '
		BEGIN {
			while ((getline line < order) > 0) {
				room++
				n = split(line, prefix, " ")
				for (i = 1; i <= n; i++)
					rank[prefix[i]] = room
			}
			while ((getline file < files) > 0) {
				is_there[file] = 1
				if (!rank_of(file)) print file ": no room"
			}
			n_folders = split("libpsr/include/ libpsr/ proto/include/ client/include/", folder, " ")
		}
		function rank_of(file,    p, best, length_of_best) {
			for (p in rank)
				if (index(file, p) == 1 && length(p) > length_of_best) { best = rank[p]; length_of_best = length(p) }
			return best
		}
		{
			file = $0; sub(/:.*/, "", file)
			name = $0; sub(/[^"]*"/, "", name); sub(/".*/, "", name)
			found = file; sub(/[^\/]*$/, "", found); found = found name
			if (!(found in is_there)) found = name
			for (i = 1; i <= n_folders && !(found in is_there); i++) found = folder[i] name
			if (!(found in is_there)) print file ": nowhere is " name
			else if (rank_of(found) > rank_of(file)) print file ": " found
		}'
}

against "$work/rooms" >"$work/found"
if [ -s "$work/found" ]; then
	not_ok "no room includes one below it in tests/e2e/rooms.sh" "$(wc -l <"$work/found") includes"
	sed 's/^/# /' "$work/found" | head -n 20
else
	ok "no room includes one below it: $(wc -l <"$work/files") files in $(wc -l <"$work/rooms") rooms"
fi

# The same with two rooms exchanged finds what the second one includes.
sed 's|^libpsr/ray$|@|; s|^libpsr/surface$|libpsr/ray|; s|^@$|libpsr/surface|' "$work/rooms" >"$work/exchanged"
check "an include against the order is found" grep -q '^libpsr/ray/.*: libpsr/surface/' <(against "$work/exchanged")
