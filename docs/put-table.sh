#!/bin/bash
# put-table.sh PAGE MARK FILE: replaces what stands between the lines "<!-- MARK -->" and "<!-- end -->" of a page by a file, as text.
set -eu
work=$(mktemp)
trap 'rm -f "$work"' EXIT
awk -v begin="<!-- $2 -->" -v table="$3" '
	$0 == begin { print; print "```text"; while ((getline line < table) > 0) print line; print "```"; inside = 1; next }
	inside && /^<!-- end -->$/ { inside = 0 }
	!inside { print }
' "$1" >"$work"
cat "$work" >"$1"
