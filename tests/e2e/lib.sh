# Shared by the end-to-end tests: TAP, and a psrd on a free port. $BUILD comes from tests/run.
set -u
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 1
: "${BUILD:?run through tests/run, or set BUILD to an absolute path}"
PATH=$BUILD/bin:$PATH
work=$(mktemp -d "${TMPDIR:-/tmp}/psr-e2e.XXXXXX")
test_number=0 failures=0 psrd_pid=
export XDG_CONFIG_HOME=$work # the user's own defaults are not the tests'
unset PSR_SERVER

finish() {
	stop_psrd
	rm -rf "$work"
	echo "1..$test_number"
	[ "$failures" -eq 0 ]
}
trap 'finish; exit $?' EXIT

ok() { # claim
	test_number=$((test_number + 1))
	echo "ok $test_number - $1"
}
not_ok() { # claim, what was seen
	test_number=$((test_number + 1)) failures=$((failures + 1))
	echo "not ok $test_number - $1"
	[ $# -lt 2 ] || printf '# %s\n' "$2"
}
skip() { # claim, reason
	test_number=$((test_number + 1))
	echo "ok $test_number - $1 # SKIP $2"
}
check() { # claim command...: the command must succeed
	local claim=$1
	shift
	if "$@" >"$work/out" 2>"$work/err"; then
		ok "$claim"
	else
		not_ok "$claim" "exit status $? of: $*"
		sed 's/^/# /' "$work/err" "$work/out" | head -n 20
	fi
}
is() { # claim expected got
	if [ "$3" = "$2" ]; then ok "$1"; else not_ok "$1" "'$3', expected '$2'"; fi
}
wait_for() { # seconds command...: until it succeeds
	local end=$((SECONDS + $1))
	shift
	until "$@"; do
		[ $SECONDS -lt $end ] || return 1
		sleep 0.1
	done
}
refuses() { # claim status pattern command...: fails with just this status and a message that matches
	local claim=$1 status=$2 pattern=$3 got
	shift 3
	"$@" >"$work/out" 2>"$work/err"
	got=$?
	if [ $got -eq "$status" ] && grep -qE -- "$pattern" "$work/err"; then
		ok "$claim: $(head -n 1 "$work/err")"
	else
		not_ok "$claim" "exit status $got (expected $status, /$pattern/) of: $*"
		sed 's/^/# /' "$work/err" | head -n 20
	fi
}

start_psrd() { # psrd's options; sets $server
	: >"$work/ready"
	psrd --listen 127.0.0.1:0 "$@" >"$work/ready" 2>"$work/psrd.log" &
	psrd_pid=$!
	for _ in $(seq 600); do
		grep -q '^READY' "$work/ready" && break
		kill -0 $psrd_pid 2>/dev/null || break
		sleep 0.05
	done
	server=$(sed -n 's/^READY //p' "$work/ready" | head -n 1)
	if [ -z "$server" ]; then
		sed 's/^/# /' "$work/psrd.log"
		not_ok "psrd starts" "no READY line"
		exit 1
	fi
}
stop_psrd() { # returns psrd's exit status
	[ -n "$psrd_pid" ] || return 0
	kill -TERM $psrd_pid 2>/dev/null
	wait $psrd_pid
	local status=$?
	psrd_pid=
	if [ $status -ne 0 ]; then sed 's/^/# psrd: /' "$work/psrd.log"; fi
	return $status
}

number() { # file key: the number of a key in a JSON file of ours
	[[ $(<"$1") =~ \"$2\":[[:space:]]*([-+0-9.eE]*) ]] && echo "${BASH_REMATCH[1]}"
}
array() { # file key: the numbers of an array in a JSON file of ours, apart by blanks
	tr -d '\n\t ' <"$1" | sed -n "s/.*\"$2\":\[\([^]]*\)\].*/\1/p" | tr ',' ' '
}
