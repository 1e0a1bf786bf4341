#!/bin/bash
# Draws the figures of docs/figures.md (all of them, or those named) into docs/figures and puts their tables into the page.
set -eu
cd "$(dirname "$0")/.."
build=${BUILD:-build/release}
program=$build/bin/psr-study
keep=$build/figures-models
page=docs/figures.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p docs/figures "$keep"
# Models of another sampler are of no use.
find "$keep" -name '*.psr' ! -newer "$build/lib/libpsr-build.a" -delete

[ $# -gt 0 ] || set -- gaps fill threshold highlights shadows backs set edges interfaces thin stills zoom
for figure; do
	echo "figure $figure" >&2
	"$program" "$figure" --keep "$keep" --out docs/figures >"$work/table"
	docs/put-table.sh $page "figure $figure" "$work/table"
done
