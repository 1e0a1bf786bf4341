#!/bin/bash
# needs: psr-model
# psr-model accuracy takes camera and spacing from the report of a frame, and ends in a verdict: PASS, FAIL, or that the
# camera seems wrong, each with an exit status of its own.
. "$(dirname "$0")/lib.sh"
mkdir "$work/models"

judge() { psr-model accuracy "$source" --depth "$work/depth.pfm" --report "$work/report.json" "$@"; }
gives() { # claim status pattern command...: the last line of standard output matches
	local claim=$1 status=$2 pattern=$3 got line
	shift 3
	"$@" >"$work/out" 2>"$work/err"
	got=$?
	line=$(tail -n 1 "$work/out")
	if [ $got -eq "$status" ] && [[ $line =~ $pattern ]]; then
		ok "$claim: $line"
	else
		not_ok "$claim" "exit status $got (expected $status), last line '$line' (expected /$pattern/) of: $*"
		sed 's/^/# /' "$work/err" | head -n 5
	fi
}
draw() { psr shot --server "$server" --model top "$@" --depth "$work/depth.pfm" --report "$work/report.json"; }

source=$work/top.glb
check "a top is generated" psr-model make top -o "$source"
check "and built" psr-model build "$source" -r 128 -o "$work/models/top.psr" --quiet
start_psrd --models "$work/models"

check "it is drawn in perspective" draw --size 128x128
gives "the report is enough" 0 '^PASS: [0-9]+ holes in [0-9]+ pixels' judge
check "it is drawn in a view that is orthographic" draw --size 96x128 --ortho 3 --eye 3,4,5 --target 0,0,0
gives "the report is enough for that too" 0 '^PASS: ' judge
check "it is drawn far away, where pixels are wider than its spacing" draw --size 40x40
gives "then pixels are what counts" 0 '^PASS: ' judge
check "refined" draw --size 128x128 --passes 2
gives "a refined picture passes" 0 '^PASS: ' judge
cp "$work/report.json" "$work/good.json"
cp "$work/depth.pfm" "$work/good.pfm"

# colours
check "smoothed colours are drawn" draw --size 128x128 --ambient 1 -o "$work/frame.ppm"
refuses "smoothed colours are not compared" 2 '--color: .*was smoothed.*--no-smooth' judge --color "$work/frame.ppm"
check "plain colours are drawn" draw --size 128x128 --ambient 1 --no-smooth -o "$work/frame.ppm"
gives "and compared" 0 '^PASS: ' judge --color "$work/frame.ppm"
cp "$work/good.json" "$work/report.json"
cp "$work/good.pfm" "$work/depth.pfm"

# options win over the report
gives "a stricter bound fails" 1 '^FAIL: .*\(0\.00 may be\)' judge --max-distance 0
gives "an eye of the command line is taken" 4 '^the camera seems wrong: ' judge --eye 300,0,0
judge --spacing 1000 --json >"$work/json"
check "a spacing of the command line is taken" awk "BEGIN { exit !($(number "$work/json" distance_max) < 0.01) }"
check "JSON has the verdict" grep -q '"verdict":[[:space:]]*"pass"' "$work/json"

# another camera: turned by a right angle, and twice as far
sed 's/"eye":/"eye": [0, -9, 0.1], "was":/' "$work/good.json" >"$work/report.json"
gives "a camera that looks from elsewhere seems wrong" 4 '^the camera seems wrong: ' judge
refuses "and in JSON too" 4 'the camera seems wrong' judge --json
cp "$work/out" "$work/json"
check "which says so" grep -q '"verdict":[[:space:]]*"camera"' "$work/json"
cp "$work/good.json" "$work/report.json"
check "another object is generated" psr-model make pencil -o "$work/pencil.glb"
gives "another object seems a wrong camera" 4 '^the camera seems wrong: ' \
	psr-model accuracy "$work/pencil.glb" --depth "$work/depth.pfm" --report "$work/report.json"

# a damaged depth map: 12 of its middle rows of 128 are +inf (00 00 80 7f), or half as deep
header=$(($(stat -c %s "$work/good.pfm") - 128 * 128 * 4))
damage() { # bytes of a pixel, as printf takes them
	cp "$work/good.pfm" "$work/depth.pfm"
	for ((i = 0; i < 12 * 128; i++)); do printf '%b' "$1"; done |
		dd of="$work/depth.pfm" bs=1 seek=$((header + 60 * 128 * 4)) conv=notrunc status=none
}
damage '\x00\x00\x80\x7f'
gives "a depth map with rows that are empty fails" 1 '^FAIL: [1-9][0-9]* holes' judge
damage '\x00\x00\x00\x3f'
gives "one with rows that are too near fails" 1 '^FAIL: ' judge
head -c 5000 "$work/good.pfm" >"$work/depth.pfm"
refuses "one that is cut short is bad data" 4 'depth.pfm' judge
cp "$work/good.pfm" "$work/depth.pfm"

# reports that are none
refuses "a report of another size belongs to another frame" 2 'different frames' \
	judge --report <(tr -d '\n' <"$work/good.json" | sed 's/"size":[^]]*]/"size": [64, 64]/')
echo '{"size": [128, 128]}' >"$work/report.json"
refuses "a report without a camera is refused" 4 'lacks the camera' judge
echo 'PNG' >"$work/report.json"
refuses "so is what is no JSON" 4 'no report' judge
rm "$work/report.json"
refuses "and what is not there" 3 'report.json' judge
tr -d '\n' <"$work/good.json" | sed 's/"request":.*//; s/}[[:space:]]*$//; s/,[[:space:]]*$//' >"$work/report.json"
echo ', "request": {"instances": [{"rotation": [0,0,0,1], "translation": [1,0,0], "scale": 1}]}}' >>"$work/report.json"
refuses "a picture of a model that was moved is refused" 4 'was moved' judge
refuses "without a report the camera is asked for" 2 '--report' psr-model accuracy "$source" --depth "$work/depth.pfm"
check "psrd stops cleanly" stop_psrd
