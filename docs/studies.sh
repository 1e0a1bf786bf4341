#!/bin/bash
# Runs the studies of docs/studies.md (all of them, or those named), puts their tables into it and their plots beside it.
set -eu
cd "$(dirname "$0")/.."
program=${BUILD:-build/release}/bin/psr-study
page=docs/studies.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p docs/studies
fetched=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
scans=$(ls "$fetched/dragon.ply" "$fetched/armadillo.off" "$fetched/bunny.obj" 2>/dev/null | tr '\n' ,)

[ $# -gt 0 ] || set -- tolerance block-size square-lattice selection models masks subdivision culling octree octree-offsets \
	octree-alias octree-levels octree-prefixes octree-splats
for study; do
	echo "study $study" >&2
	plot=()
	grep -q "(studies/$study.svg)" $page && plot=(--plot "$work/$study.svg")
	models=()
	case $study in
	octree) models=(-r 512 --models "${scans}pinetree,terrain,scan:terrain") ;;
	octree-prefixes) models=(-r 512 --models "${scans}pinetree") ;;
	octree-splats) models=(--models "${scans}teapot") ;;
	octree-alias) models=(--out docs/studies) ;;
	octree-offsets) models=(--out docs/studies --models gavel) ;;
	octree-levels) models=(--out docs/studies --models "${scans}dragon") ;; # the first one
	esac
	"$program" "$study" --keep "$work" "${models[@]}" "${plot[@]}" >"$work/table"
	[ ${#plot[@]} -eq 0 ] || mv "$work/$study.svg" docs/studies/
	docs/put-table.sh $page "study $study" "$work/table"
done
