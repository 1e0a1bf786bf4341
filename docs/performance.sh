#!/bin/bash
# Runs the benchmarks of docs/performance.md (all of them, or those named) and puts their tables into it. Wants a machine
# that does nothing else.
set -eu
cd "$(dirname "$0")/.."
build=${BUILD:-build/release}
page=docs/performance.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

[ $# -gt 0 ] || set -- dragon engine teapot table-8.2 figure-7.4 growth warp effects kernels
for part; do
	echo "bench $part" >&2
	case $part in
	effects) make --no-print-directory bench-effects ;;
	kernels) make --no-print-directory bench-simd ;;
	*) make --no-print-directory bench only="$part" ;;
	esac 2>/dev/null | sed "/^make/d;/^  \(CC\|CXX\|AR\|LD\) /d;/^Numbers in/d;/^ *$/{N;/^ *\n *$/D}" >"$work/table"
	docs/put-table.sh $page "bench $part" "$work/table"
done
