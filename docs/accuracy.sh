#!/bin/bash
# Measures what accuracy costs on a handful of models that differ (or those named), and puts tables and plots into
# docs/accuracy.md. Wants a machine that does nothing else.
set -eu
cd "$(dirname "$0")/.."
build=${BUILD:-build/release}
out=$build/accuracy
fetched=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
page=docs/accuracy.md

mkdir -p "$out" docs/accuracy
declare -A source=([bunny]=$fetched/bunny.obj [engine]=$fetched/engine.glb [clearcoat]=$fetched/clearcoat/ClearCoatTest.gltf)
[ $# -gt 0 ] || set -- bunny engine clearcoat table
for name in "$@"; do
	file=${source[$name]:-$out/$name.glb}
	[ -n "${source[$name]:-}" ] || [ -s "$file" ] || "$build/bin/psr-model" make "$name" -o "$file" >/dev/null
	if [ ! -s "$file" ]; then
		echo "accuracy: $name is left out: make models fetches it" >&2
		continue
	fi
	echo "accuracy: $name" >&2
	"$build/bin/psr-model" accuracy "$file" --views 8 --size 128x128 -r 256 --out "$out/$name" >"$out/$name.txt" || [ $? -eq 7 ] # a byte changed: told above, and all is written
	docs/put-table.sh $page "$name" "$out/$name.txt"
	cp "$out/$name/plot.svg" "docs/accuracy/$name.svg"
	[ "$name" != engine ] || cp "$out/$name/strip.png" docs/accuracy/engine.png
done
