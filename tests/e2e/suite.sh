#!/bin/bash
# not for threads
# psr test: a suite with one of each failure, its page, accepting, and what ends a run.
. "$(dirname "$0")/lib.sh"
golden=$PWD/tests/golden
suite=$work/demo.suite

run() { # status, arguments of psr test: standard output to sum
	local status=$1
	shift
	psr test "$@" >"$work/sum" 2>"$work/err"
	local got=$?
	[ $got -eq "$status" ] || { echo "exit status $got instead of $status"; cat "$work/sum" "$work/err"; return 1; }
}
says() { # claim pattern: a line of the sum
	check "$1" grep -qE -- "$2" "$work/sum"
}

pixel=$(sed -n '/^test=one-pixel/,/hash/s/.*hash=\([0-9a-f]*\) .*/\1/p' tests/golden/frames.suite)

# --- accepting: hashes and references that are not known yet ---
cat >"$suite" <<END
# A comment stays, and blanks, too.
models=$golden   size=160x120

test=shown model=teapot reference=shown.png depth=shown.pfm depth-rmse=0
test=turn  model=top    turntable=3	hash=? hash=depth:?   # known later
test=known model=teapot hash=$pixel size=1x1 no-smooth
END
cp "$suite" "$work/before"
check "a suite whose pictures are not known fails" run 1 "$suite"
says "its reference is missing" \
	'^FAILED   demo: shown: the reference .*/shown.png is not there yet; the reference .*shown.pfm is not there yet$'
says "its hashes are missing" \
	'^FAILED   demo: turn/3: color has the hash [0-9a-f]{16}, and the suite knows none yet; depth has'
says "what is known passes" '^1 passed, 4 failed$'
check "nothing was accepted" cmp "$suite" "$work/before"
check "a turntable is accepted" run 0 --accept turn "$suite"
says "each of its pictures" '^0 passed, 0 failed, 3 accepted$'
check "only the hashes of the suite changed" \
	diff <(sed -E 's/(hash=(depth:)?)[0-9a-f,]{20,}/\1?/g' "$suite") "$work/before"
check "the others are still not there" test ! -e "$work/shown.png"
check "all is accepted" run 0 --accept '*' "$suite"
check "and passes now" run 0 "$suite"
says "all of it" '^5 passed, 0 failed$'
check "one test alone" run 0 --only shown "$suite"
says "is one" '^1 passed, 0 failed$'

# --- one of each failure ---
cat >"$work/failures.suite" <<END
models=$golden size=160x120
test=exact  model=teapot azimuth=22 reference=shown.png
test=psnr   model=teapot azimuth=23 reference=shown.png psnr=45
test=ssim   model=teapot azimuth=23 reference=shown.png ssim=0.999
test=flip   model=teapot azimuth=23 reference=shown.png flip=0.001
test=off    model=teapot azimuth=23 reference=shown.png off=16:0.1%
test=depth  model=teapot azimuth=23 depth=shown.pfm depth-rmse=0.01
test=size   model=teapot size=80x60 reference=shown.png
test=broken model=teapot reference=failures.png
test=hash   model=teapot hash=0000000000000000
test=normal model=teapot hash=normal:0000000000000000
test=time   model=teapot size=640x480 time=0.0001,of=exact,n=3
test=nobody model=nobody hash=?
test=some   model=teapot error=not-found
test=other  model=nobody error=over-a-limit
test=near   model=teapot azimuth=21.6 reference=shown.png psnr=40 ssim=0.98 flip=0.02 off=16:1%
test=none   model=nobody error=not-found
test=fast   model=teapot size=8x8 time=10000,of=exact,n=1
END
echo "no PNG" >"$work/failures.png"
check "fourteen failures" run 1 "$work/failures.suite" --html "$work/page.html" --junit "$work/junit.xml"
cp "$work/sum" "$work/failures"
says "and three that pass" '^3 passed, 14 failed$'
while read -r name pattern; do
	says "$name says so" "^FAILED   failures: $name: $pattern"
done <<'END'
exact [0-9]+ of 19200 pixels differ; worst in [0-9]+x[0-9]+ pixels at [0-9]+,[0-9]+$
psnr psnr is [0-9.]+ dB, at least 45 dB is needed; worst in
ssim ssim is 0[0-9.]+, at least 0.999 is needed; worst in
flip flip is 0[0-9.]+, at most 0.001 is needed; worst in
off the share of pixels off by more than 16 codes is [0-9.]+ %, at most 0.1 % is needed; worst in
depth depth-rmse is [0-9.]+, at most 0.01 is needed; worst in
size the picture has 80x60 pixels, the reference 160x120$
broken the reference cannot be read: .*failures.png is no PNG
hash color has the hash [0-9a-f]{16} instead of 0000000000000000$
normal normal has the hash [0-9a-f]{16} instead of 0000000000000000$
time its time is [0-9.e+]+ of that of exact \([0-9.e+]+ ms and [0-9.e+]+ ms, p50 of 3\), at most 0.0001 is needed$
nobody not found: there is no model nobody
some a picture came instead of the error `not found`$
other the error is `not found` instead of `over a limit`
END
check "the same in the Test Anything Protocol" run 1 "$work/failures.suite" --tap
check "has a line a test" test "$(grep -cE '^(not )?ok ' "$work/sum")" -eq 17
says "and their number" '^1\.\.17$'
check "fails the same tests" test "$(grep -c '^not ok ' "$work/sum")" -eq 14

# --- the page and the XML ---
page=$work/page.html
images() { grep -o '<img [^>]*src="data:image/png;base64,[^"]*"' "$page" | wc -l; }
check "the page has a heading a failure" test "$(grep -c '^<h3>' "$page")" -eq 14
# Five are beside reference and difference, all of them enlarged; depth has three more columns; five are alone.
check "and all pictures" test "$(images)" -eq $((5 * 6 + 8 + 5))
check "no part of it is elsewhere" sh -c '! grep -qE "(src|href)=\"[^d]|url\(|@import|<script|<link" "$1"' sh "$page"
start_psrd --models "$golden"
check "psr shot draws a picture" \
	psr shot --server "$server" --model teapot --size 160x120 --quality good --azimuth 22 -o "$work/shot.png"
grep -o 'base64,[^"]*' "$page" | head -n 1 | cut -c 8- | base64 -d >"$work/first.png"
check "the page shows the same bytes" cmp "$work/shot.png" "$work/first.png"
check "the XML is whole and counts the same" python3 -c '
import sys, xml.etree.ElementTree as tree
root = tree.parse(sys.argv[1]).getroot()
suite = root.find("testsuite")
assert suite.get("tests") == "17" and suite.get("failures") == "14"
assert len(root.findall(".//failure")) == 14 and len(root.findall(".//testcase")) == 17
assert "at least 45 dB" in root.find(".//testcase[@name=\"psnr\"]/failure").get("message")
' "$work/junit.xml"

# --- a regression is found by a picture that was taken before ---
sed "s/size=160x120/size=160x120 light=dir:-1,-2,-1/; /test=known/d; /test=turn/d" "$suite" >"$work/light.suite"
sed -i 's/shown/sunny/g' "$work/light.suite"
check "a lit picture is taken" run 0 "$work/light.suite" --accept '*'
sed -i 's/dir:-1,-2,-1/dir:-1.05,-2,-1/' "$work/light.suite"
check "its light moves by a degree: it fails" run 1 "$work/light.suite"
says "the colours say so" 'sunny: [0-9]+ of 19200 pixels differ; worst in'
check "the new light is taken" run 0 "$work/light.suite" --accept 'sun*' --html "$page"
says "what changed is told" '^accepted light: sunny: [0-9]+ of 19200 pixels differ; worst in'
check "and shown" grep -q '<h3 class="accepted">sunny</h3>' "$page"
check "it passes then" run 0 "$work/light.suite"

# --- daemons ---
check "a daemon of somebody" run 1 --server "$server" "$work/failures.suite"
check "has the same failures" diff <(grep -v ': time: ' "$work/sum") <(grep -v ': time: ' "$work/failures")
check "psrd stops cleanly" stop_psrd
start_psrd --models "$golden" --max-open 1 --max-handles 1
check "a daemon that takes one request at a time" run 0 --server "$server" tests/golden/frames.suite
check "psrd stops cleanly" stop_psrd
mkdir -p "$work/config/psr"
echo "server = unix:$work/nobody" >"$work/config/psr/psr.conf"
check "the user's own server does not draw for a suite that names its models" \
	env XDG_CONFIG_HOME="$work/config" psr test "$suite"
sed "s|^models=[^ ]*||" "$suite" >"$work/served.suite"
refuses "but for one that names none" 3 "cannot connect" env XDG_CONFIG_HOME="$work/config" psr test "$work/served.suite"
refuses "nobody listens" 3 "cannot connect" psr test --server "unix:$work/nobody" "$suite"
refuses "a psrd of its own that cannot start" 3 \
	"psrd does not start: .*nowhere" psr test --models "$work/nowhere" "$suite"
check "several suites" run 1 "$suite" "$work/failures.suite"
says "have one sum" '^8 passed, 14 failed$'

# --- what is wrong is told before anything is drawn ---
printf 'model=x\ntest=a hash=?\n  test=b size=1x reference=b.png\n' >"$work/wrong.suite"
refuses "a suite that is wrong" 2 "wrong.suite:3:10: --size: '1x' is not a size" psr test "$suite" "$work/wrong.suite"
refuses "a suite that is not there" 2 "cannot read .*nowhere" psr test "$work/nowhere"
refuses "no suite" 2 "a suite is missing" psr test
refuses "a pattern without a test" 2 "no test matches 'x'" psr test "$suite" --only x
refuses "to accept nothing" 2 "--accept: no test matches 'x'" psr test "$suite" --accept x
refuses "a page that cannot be written" 3 "nowhere" psr test "$suite" --html "$work/nowhere/page.html"
sed 's/^test=turn.*/test=turn model=top hash="?"/' "$work/before" >"$work/quoted.suite"
refuses "a hash in quotes" 3 "not where it was" psr test "$work/quoted.suite" --accept turn
printf 'models=%s model=top size=8x8 hash=?\ntest=a\ntest=b\n' "$golden" >"$work/shared.suite"
refuses "a hash for several tests" 3 "is a default of several tests" psr test "$work/shared.suite" --accept a
check "left the suite alone" grep -q 'hash=?$' "$work/shared.suite"
