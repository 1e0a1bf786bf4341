#!/bin/bash
# needs: psr-model
# Sources in the models folder: built at first use by a child process, cached, built again when they change.
. "$(dirname "$0")/lib.sh"
models=$work/models cache=$work/cache
mkdir "$models"

needle() { # height: a thin tetrahedron, which is built soon
	printf 'v 0 0 0\nv 4 0 0\nv 0 %s 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' "$1"
}
shot() { psr shot --server "$server" --size 160x120 "$@"; }
color() { shot --model "$1" --hash 2>&1; }
state() { psr list --server "$server" | awk -v name="$1" '$1 == name { print $2 }'; }
started() { grep -c "build of .*/$1 started" "$work/psrd.log"; }
is_state() { [ "$(state "$1")" = "$2" ]; }
is_building() { [ "$(started "$1")" -gt 0 ]; }
# Processes whose command line names a file of this test, other than psrd itself.
children() {
	local pid
	for pid in /proc/[0-9]*; do
		tr '\0' ' ' <"$pid/cmdline" 2>/dev/null | grep -q "psr-model build $models" && echo "${pid#/proc/}"
	done
}
start() { start_psrd --models "$models" --cache "$cache" --verbose "$@"; }

check "a pencil is generated" psr-model make pencil -o "$models/pencil.glb"
needle 0.1 >"$models/needle.obj"
printf 'solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n' >"$models/broken.stl"
cp tests/golden/dice.psr "$models"
mkdir "$models/folder"
needle 0.2 >"$models/folder/inner.obj"

# --- listing, first use ---
start
is "a source is listed as one" source "$(state needle)"
is "so is a .glb" source "$(state pencil)"
is "so is one in a folder of its own" source "$(state inner)"
is "a model file is ready" ready "$(state dice)"
is "nothing was built for the list" 0 "$(grep -c "build of" "$work/psrd.log")"
first=$(color needle)
case $first in
'color '????????????????) ok "the first shot of an .obj builds it" ;;
*) not_ok "the first shot of an .obj builds it" "$first" ;;
esac
is "by one build" 1 "$(started needle.obj)"
is "the second shot is the same" "$first" "$(color needle)"
is "and builds nothing" 1 "$(started needle.obj)"
is "it is listed as loaded" loaded "$(state needle)"
is "one model is in the cache" 1 "$(find "$cache" -type f | wc -l)"

has_tty() { script -qec true /dev/null >/dev/null 2>&1 </dev/null; } # some containers have no /dev/pts
COLUMNS=100 script -qec "psr shot --server $server --model pencil --size 160x120 --hash" /dev/null >"$work/tty" 2>&1 </dev/null
if grep -q "building: sample" "$work/tty" && grep -qE "color [0-9a-f]{16}" "$work/tty"; then
	ok "a terminal sees the progress of a build, then the hash"
elif ! has_tty; then
	skip "a terminal sees the progress of a build, then the hash" "there are no pseudo-terminals here"
else
	not_ok "a terminal sees the progress of a build, then the hash" "$(tr '\r' '\n' <"$work/tty" | tail -n 1)"
fi
check "a .glb is drawn" shot --model pencil -o "$work/pencil.png"

refuses "a broken source is refused in the modeller's words" 4 "broken.stl: .*STL" shot --model broken --hash
refuses "and again" 4 "broken.stl: .*STL" shot --model broken --hash
is "it was tried once" 1 "$(started broken.stl)"
is "it is listed as failed" failed "$(state broken)"
is "the others are served" "$first" "$(color needle)"

# Two at once wait for one build.
color inner >"$work/one" &
other=$!
color inner >"$work/two"
wait $other
is "two who ask at once get the same" "$(cat "$work/one")" "$(cat "$work/two")"
is "from one build" 1 "$(started inner.obj)"

# --- SIGHUP ---
needle 0.3 >"$models/later.obj"
refuses "a file that came later is not known yet" 3 "no model later" shot --model later --hash
kill -HUP "$psrd_pid"
check "SIGHUP picks it up" wait_for 20 is_state later source
check "and it is drawn" shot --model later --hash
needle 0.8 >"$models/needle.obj"
kill -HUP "$psrd_pid"
is_changed() { [ "$(color needle)" != "$first" ]; }
check "a changed source is built again after SIGHUP" wait_for 30 is_changed
second=$(color needle)
is "by one more build" 2 "$(started needle.obj)"
check "psrd stops cleanly" stop_psrd

# --- the cache ---
find "$cache" -type f -printf '%p %i %s\n' | sort >"$work/before"
is "every source that can be built is in the cache, the changed one twice" 5 "$(wc -l <"$work/before")"
start
is "a second psrd draws the same" "$second" "$(color needle)"
check "and the pencil" shot --model pencil --hash
is "without a build" 0 "$(grep -c "build of" "$work/psrd.log")"
find "$cache" -type f -printf '%p %i %s\n' | sort >"$work/after"
check "the files of the cache are as they were" cmp "$work/before" "$work/after"
check "psrd stops cleanly after that" stop_psrd
find "$cache" -type f | while read -r file; do head -c 5000 "$file" >"$file.cut" && mv "$file.cut" "$file"; done
start
is "a damaged cache is built again, and draws the same" "$second" "$(color needle)"
is "by a build" 1 "$(started needle.obj)"
check "psrd stops cleanly after a damaged cache" stop_psrd

# --- as fine as pictures ask for ---
mkdir "$work/sizes"
needle 0.1 >"$work/sizes/needle.obj"
needle 0.2 >"$work/sizes/twin.obj"
cp "$work/sizes/twin.obj" "$work/sizes/twin.off"
echo LASF >"$work/sizes/tower.laz"
start_psrd --models "$work/sizes" --cache "$work/sizes-cache" --resolution 64 --max-resolution 300 --verbose
fine() { # size: the resolution of the model that a picture of this size gets
	psr shot --server "$server" --model needle --size "$1" --report "$work/report.json" 2>&1 && number "$work/report.json" resolution
}
is "a small picture gets the coarsest model" 64 "$(fine 48x20)"
is "a larger one a finer model" 256 "$(fine 100x200)"
is "a huge one the finest that is built" 300 "$(fine 4000x10)"
is "another of a size that was there builds nothing" 256 "$(fine 256x65)"
is "so there are three models" 3 "$(find "$work/sizes-cache" -name '*.psr' | wc -l)"
is "a file that cannot be read is listed" failed "$(state tower)"
refuses "and who opens it is told what to do" 4 'tower.laz: .*laszip' psr shot --server "$server" --model tower --hash
is "of two files of one name the other is listed under its own" failed "$(state twin.off)"
refuses "and who opens that is told to rename it" 4 'twin.obj.*rename' psr shot --server "$server" --model twin.off --hash
check "psrd stops cleanly after that, too" stop_psrd
refuses "a cache that cannot be written is refused at the start" 3 'cache folder /proc/psr cannot be made.*--cache DIR' \
	timeout 30 psrd --models "$work/sizes" --cache /proc/psr --listen 127.0.0.1:0

# --- without psr-model ---
mkdir "$work/alone"
cp "$BUILD/bin/psrd" "$work/alone"
(
	PATH=$work/alone:/usr/bin:/bin
	type -P psr-model
) >"$work/out" && skip "psrd without psr-model says so" "psr-model is installed in $(cat "$work/out")"
if [ ! -s "$work/out" ]; then
	search=$PATH PATH=$work/alone:/usr/bin:/bin
	start
	PATH=$search
	refuses "psrd without psr-model says so" 3 "psr-model.* is neither beside psrd nor in PATH" shot --model later --hash
	check "and serves what needs none" shot --model dice --hash
	check "psrd without psr-model stops cleanly" stop_psrd
fi

# --- a build that is ended while it writes: a stand-in for psr-model that stays in the middle of it ---
mkdir "$work/stuck"
cp "$BUILD/bin/psrd" "$work/stuck"
printf '#!/bin/sh\necho part >"$(dirname "$4")/.psr-$$-0.tmp"\necho "write 1 2" >&3\nexec sleep 60\n' >"$work/stuck/psr-model"
chmod +x "$work/stuck/psr-model"
search=$PATH PATH=$work/stuck:$PATH
start
PATH=$search
shot --model later --hash >"$work/later" 2>&1 &
waiting=$!
has_part() { [ -n "$(find "$cache" -name '*.tmp*')" ]; }
check "a build is writing" wait_for 20 has_part
check "SIGTERM while a build writes ends psrd cleanly" stop_psrd
wait $waiting
is "who waited for it is told, by exit status 6" 6 $?
is "what it had written is removed" "" "$(find "$cache" -name '*.tmp*')"

# --- during a build ---
psr-model make wheel -o "$models/wheel.glb" >"$work/out"
start --listen "unix:$work/socket"
is "it serves on a Unix socket too" "unix:$work/socket" "$(sed -n 's/^READY //p' "$work/ready" | grep unix)"
is "which is nobody else's" 600 "$(stat -c %a "$work/socket")"
check "the socket is served" psr shot --server "unix:$work/socket" --model dice --hash
refuses "a second psrd leaves a socket that answers alone" 6 "unix:$work/socket" \
	timeout 30 psrd --models "$models" --listen "unix:$work/socket"
shot --model wheel --hash >"$work/wheel" 2>&1 &
waiting=$!
check "a long build begins" wait_for 20 is_building wheel.glb
check "another model is drawn" shot --model dice --hash
check "while it goes on" [ -n "$(children)" ]
check "SIGTERM during a build ends psrd cleanly" stop_psrd
wait $waiting
is "who waited is told, by exit status 6" 6 $?
check "and why" grep -q "shutting down" "$work/wheel"
is "no child is left" "" "$(children)"
is "nothing temporary is left in the cache" "" "$(find "$cache" -name '*.tmp*')"
check "the socket is removed" [ ! -e "$work/socket" ]

# --- a file, without a psrd ---
export XDG_CACHE_HOME=$work/home
needle 0.3 >"$work/alone.obj"
check "a file is drawn without a server" psr shot "$work/alone.obj" --size 160x120 --hash -o "$work/alone.png"
PSR_SERVER=unix:/nowhere psr turntable "$work/alone.obj" --size 80x60 --sheet 2x2 -o "$work/sheet.png" 2>"$work/err"
is "a turntable of a file asks no server" "0 " "$? $(cat "$work/err")"
psr shot "$work/alone.obj" --instance alone,rotate=Y:90 --size 160x120 -o "$work/moved.png"
differ() { ! cmp -s "$1" "$2"; }
check "an instance of the file is turned" differ "$work/alone.png" "$work/moved.png"
refuses "a file that is not there" 3 "no such file" psr shot "$work/nowhere.ply" -o "$work/a.png"
refuses "a file of no format" 4 "psr reads no files of this kind" psr shot tests/e2e/lib.sh -o "$work/a.png"
refuses "two files" 2 "one file at a time" psr shot "$work/alone.obj" "$work/alone.obj" -o "$work/a.png"
refuses "a file and --replay" 2 "it excludes" psr shot "$work/alone.obj" --replay "$work/r.json" -o "$work/a.png"
is_over() { ! pgrep -f "psrd --models $work --listen" >/dev/null; }
check "no psrd is left" wait_for 10 is_over
unset XDG_CACHE_HOME

# --- a psrd that was killed ---
start --listen "unix:$work/socket"
shot --model wheel --hash >"$work/wheel" 2>&1 &
waiting=$!
check "the build begins again" wait_for 20 is_building wheel.glb
kill -KILL "$psrd_pid"
wait "$psrd_pid" 2>/dev/null
psrd_pid=
wait $waiting
is "a client of a psrd that was killed ends with 6" 6 $?
is_alone() { [ -z "$(children)" ]; }
check "its child ends with it" wait_for 10 is_alone
check "its socket is left" [ -S "$work/socket" ]
start --listen "unix:$work/socket"
is "the next psrd takes the dead socket over" "$second" "$(server=unix:$work/socket color needle)"
check "and stops cleanly" stop_psrd
