#!/bin/bash
# needs: psr-model
# psr-model accuracy --views measures settings on views of a source: tables, CSV, JSON, pictures, and one page that holds
# all of it.
. "$(dirname "$0")/lib.sh"

source=$work/top.glb out=$work/out.d
measure() { psr-model accuracy "$source" --views 2 --size 40x32 -r 48 --rounds 2 "$@"; }
png_size() { od -An -j16 -N8 -tu1 "$1" | awk '{ print $3 * 256 + $4 "x" $7 * 256 + $8 }'; }
is_html_alone() { ! grep -oE '(src|href)="[^"]{0,40}' "$1" | grep -qv '="data:image/'; }

check "a top is generated" psr-model make top -o "$source"
check "its settings are measured, into a new folder" measure --out "$out"
cp "$work/out" "$work/table"
cp "$work/err" "$work/progress"
check "progress is told apart" grep -q 'frames, view, 2 of 2' "$work/progress"
check "the tables are printed" grep -q '^The cheapest choice within an error$' "$work/table"
is "a setting has one line" 1 "$(grep -c '^[* ]  *pass 2 ' "$work/table")"
is "instruction sets, threads and culling cost no pixel" 0 \
	"$(grep -cE '^[* ]  *(c|avx2|avx512|[24] threads|no (cones|masks|occlusion|culling)|positions, all)  ' "$work/table")"
check "the usual setting draws the usual picture" grep -qE '^[* ]= usual ' "$work/table"

n=$(($(wc -l <"$out/prices.csv") - 1))
is "the CSV has a line for each setting of each view" "$n" "$(($(grep -c '^0,around,' "$out/prices.csv") + $(grep -c '^1,close,' "$out/prices.csv")))"
is "as many columns in each" 17 "$(awk '{ gsub(/"[^"]*"/, "x"); print gsub(/,/, "") + 1 }' "$out/prices.csv" | sort -u | tr '\n' ' ' | tr -d ' ')"
is "and JSON has each setting" $((n / 2)) "$(grep -c '"setting":' "$out/prices.json")"
check "no setting is named twice" test -z "$(grep '"setting":' "$out/prices.json" | sort | uniq -d)"
check "JSON has what the options said" test "$(number "$out/prices.json" width) $(number "$out/prices.json" resolution)" = "40 48"
check "a still of pass 4 is nearer to the truth than a usual frame" awk -F, '
	$4 == "\"usual\"" { usual[$1] = $13 } $4 == "\"pass 4\"" { best[$1] = $13 }
	END { exit !(best[0] < usual[0] && best[1] < usual[1]) }' "$out/prices.csv"
columns=$(($(grep -o '<figcaption>' "$out/index.html" | wc -l) / 2))
is "the strip has a picture for each on the page" "$((columns * 44 - 4))x$((4 * 36 - 4))" "$(png_size "$out/strip.png")"
check "the page ends" grep -q '^</html>$' "$out/index.html"
check "and needs no other file" is_html_alone "$out/index.html"
if command -v gnuplot >/dev/null; then
	check "there are plots" test -s "$out/plot.svg" -a -s "$out/plot.png"
else
	skip "there are plots" "gnuplot is not there"
fi

# Without gnuplot all but the plots is there.
(
	PATH=$work/empty
	"$BUILD/bin/psr-model" accuracy "$source" --views 1 --size 32x32 -r 32 --rounds 1 --out "$work/plain"
) >"$work/out" 2>"$work/progress"
is "without gnuplot it works as well" 0 $?
check "and says so" grep -q 'there is no plot: gnuplot' "$work/progress"
check "on the page, too" grep -q 'There is no plot' "$work/plain/index.html"

check "the same seed gives the same errors" measure --out "$work/again"
is "in each view and setting" "$(cut -d, -f1-4,13 "$out/prices.csv" | md5sum)" "$(cut -d, -f1-4,13 "$work/again/prices.csv" | md5sum)"
check "another seed is taken" measure --out "$work/other" --seed 2
check "and gives others" test "$(cut -d, -f13 "$out/prices.csv" | md5sum)" != "$(cut -d, -f13 "$work/other/prices.csv" | md5sum)"

refuses "no view is an error" 2 '--views' psr-model accuracy "$source" --views 0
refuses "so are two sources" 2 'one source' psr-model accuracy "$source" "$source" --views 1
refuses "two ways at once" 2 'use one of them' psr-model accuracy "$source" --views 1 --depth "$work/x.pfm"
refuses "a picture that is too small" 2 '--size' psr-model accuracy "$source" --views 1 --size 8x8
refuses "a source that is not there" 3 'nowhere.ply' psr-model accuracy "$work/nowhere.ply" --views 1
refuses "a folder that cannot be made" 3 '--out: the folder .* cannot be made' measure --out "$work/none/folder"
touch "$work/file"
refuses "a folder that is a file" 3 '--out: the folder .* cannot be made' measure --out "$work/file"
