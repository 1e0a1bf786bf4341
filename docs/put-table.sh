#!/bin/bash
# put-table.sh PAGE MARK FILE: replaces the lines between "<!-- MARK -->" and "<!-- end -->" of a page by a file, as text,
# folded to the width of a page.
set -eu
fold=$(dirname "$0")/fold.awk
work=$(mktemp)
trap 'rm -f "$work"' EXIT
awk -f "$fold" "$3" | awk -v begin="<!-- $2 -->" '
	$0 == begin { print; print "```text"; while ((getline line < "-") > 0) print line; print "```"; inside = 1; next }
	inside && /^<!-- end -->$/ { inside = 0 }
	!inside { print }
' "$1" >"$work"
cat "$work" >"$1"
