# What scripts with a window share; they source it after lib.sh: a screen of Xvfb, screenshots of the viewer, pixels of the
# screen. A script defines read_screen, which puts the pixels that the viewer drew into $work/screen.ppm.
here=$PWD
view_pid= xvfb_pid= compositor_pid= n_shots=0 command=
export LSAN_OPTIONS=suppressions=$here/tests/tools/view.supp:print_suppressions=0

needs() { # claim program...: ends the script where one is not there
	local claim=$1 program
	shift
	for program; do
		if ! type -P "$program" >/dev/null; then
			skip "$claim" "$program is not there"
			exit
		fi
	done
}
end_window() {
	local pid
	for pid in $view_pid $compositor_pid $xvfb_pid; do kill "$pid" 2>/dev/null; done
	finish
}
within() { # seconds command...: tries it until it succeeds
	local tries=$(($1 * 20))
	shift
	for _ in $(seq $tries); do
		"$@" >/dev/null 2>&1 && return 0
		sleep 0.05
	done
	return 1
}
open_screen() { # WIDTHxHEIGHT
	trap 'end_window; exit $?' EXIT
	mkdir "$work/screen" "$work/shots"
	Xvfb -noreset -displayfd 3 -screen 0 "$1x24" -fbdir "$work/screen" 3>"$work/display" 2>/dev/null &
	xvfb_pid=$!
	within 10 test -s "$work/display"
	DISPLAY=:$(cat "$work/display")
	export DISPLAY
}
read_pixels() { # x y width height, of the screen
	python3 tests/tools/screen.py "$work/screen/Xvfb_screen0" "$@" "$work/screen.ppm"
}
shot() { # takes a screenshot, which waits until the picture is sharp; sets $command
	n_shots=$((n_shots + 1))
	xdotool key F2
	within 20 test -s "$work/shots/psr-view-$n_shots.png"
	within 1 grep -q "psr-view-$n_shots.png" "$work/view.log"
	command=$(grep "^psr shot.*psr-view-$n_shots.png" "$work/view.log")
	xdotool key Shift_L # the note goes
}
draws_the_same() { # the screenshot's command draws the screenshot
	sh -c "${command% -o *} -o '$work/true.png'" 2>/dev/null && cmp "$work/true.png" "$work/shots/psr-view-$n_shots.png"
}
ends() { # claim: the viewer ends with status 0
	local status
	wait $view_pid
	status=$?
	view_pid=
	if [ $status -eq 0 ]; then ok "$1"; else not_ok "$1" "exit status $status: $(head -n 40 "$work/view.err")"; fi
}
screen_is() { read_screen && cmp -s "$work/screen.ppm" "$1"; }
is_true() { # claim: screenshot, its command and the screen agree
	shot
	check "$1: psr shot draws the same, bit for bit" draws_the_same
	sh -c "${command% -o *} -o '$work/true.ppm'" 2>/dev/null
	check "$1: and the screen has it" within 5 screen_is "$work/true.ppm"
}
said() { sed -n "s/.*--$1 \([^ ]*\).*/\1/p" <<<"$command"; } # the value of an option of $command
differs() { # claim a b
	if [ "$2" != "$3" ]; then ok "$1"; else not_ok "$1" "'$2' twice"; fi
}
length() { awk -v a="$1" -v b="$2" 'BEGIN { split(a, p, ","); split(b, q, ",")
	print sqrt((p[1] - q[1]) ^ 2 + (p[2] - q[2]) ^ 2 + (p[3] - q[3]) ^ 2) }'; }
