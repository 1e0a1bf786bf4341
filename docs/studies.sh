#!/bin/bash
# Runs the studies of docs/studies.md (all of them, or those named), puts their tables into it and their plots beside it.
set -eu
cd "$(dirname "$0")/.."
program=${BUILD:-build/release}/bin/psr-study
rates=${BUILD:-build/release}/tests/bench/octree_rates
page=docs/studies.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p docs/studies
fetched=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
scans=$(ls "$fetched/dragon.ply" "$fetched/armadillo.off" "$fetched/bunny.obj" 2>/dev/null | tr '\n' ,)

[ $# -gt 0 ] || set -- tolerance block-size square-lattice selection models masks subdivision culling octree octree-points octree-offsets \
	octree-alias octree-rates octree-levels octree-prefixes octree-parts octree-splats dpoint \
	dpoint-models dpoint-splats dpoint-frames dpoint-bytes dpoint-equal dpoint-holes dpoint-error
for study; do
	echo "study $study" >&2
	plot=()
	grep -q "(studies/$study.svg)" $page && plot=(--plot "$work/$study.svg")
	models=()
	case $study in
	octree | octree-points) models=(-r 512 --models "${scans}pinetree,terrain,scan:terrain") ;;
	octree-prefixes) models=(-r 512 --models "${scans}pinetree,scan:terrain") ;;
	octree-splats) models=(--models "${scans}teapot") ;;
	dpoint-bytes) models=(--models "teapot,gavel$(ls "$fetched/fandisk.off" 2>/dev/null | sed 's/^/,/')") ;;
	dpoint-holes) models=(--models "teapot,gavel,toybird,chair$(ls "$fetched/fandisk.off" "$fetched/bunny.obj" "$fetched/lionhead.off" "$fetched/rotor.off" "$fetched/helmet.off" 2>/dev/null | sed 's/^/,/' | tr -d '\n')") ;;
	dpoint-models)
		[ -f "$fetched/lionhead.off" ] && [ -f "$fetched/fandisk.off" ] ||
			{ echo "lionhead.off and fandisk.off are not here: make models fetches them" >&2; continue; }
		models=(--models "teapot,$fetched/lionhead.off,$fetched/fandisk.off")
		;;
	dpoint-splats) models=(--out docs/studies) ;;
	octree-rates) # beside another renderer
		[ -f "$fetched/dragon.ply" ] || { echo "dragon.ply is not here: make models fetches it" >&2; continue; }
		"$rates" -o docs/studies/octree-rates.png "$fetched/dragon.ply" >"$work/table"
		docs/put-table.sh $page "study $study" "$work/table"
		continue
		;;
	octree-alias) models=(--out docs/studies) ;;
	octree-offsets) models=(--out docs/studies --models gavel) ;;
	octree-levels) models=(--out docs/studies --models "${scans}dragon") ;; # the first one
	octree-parts) models=(--out docs/studies --models "scan:${scans}dragon") ;;
	esac
	"$program" "$study" --keep "$work" "${models[@]}" "${plot[@]}" >"$work/table"
	[ ${#plot[@]} -eq 0 ] || mv "$work/$study.svg" docs/studies/
	docs/put-table.sh $page "study $study" "$work/table"
done
