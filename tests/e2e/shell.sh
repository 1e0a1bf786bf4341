#!/bin/bash
# What a shell knows of the programs: completion made from their option tables, and defaults from ~/.config/psr/psr.conf.
. "$(dirname "$0")/lib.sh"
mkdir "$work/models" "$work/config" "$work/config/psr"
cp tests/golden/dice.psr "$work/models"
start_psrd --models "$work/models"
psr=$(command -v psr)

has() { # claim pattern text
	if grep -q -- "$2" <<<"$3"; then ok "$1"; else not_ok "$1" "no '$2' in: $3"; fi
}

# --- bash ---
. client/completion/psr.bash
shopt -s extglob
complete_line() { # words...: what may stand for the last one
	COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
	_psr "$1" 2>/dev/null # compopt is for real completions
	echo "${COMPREPLY[*]}"
}
compopt() { :; }
has "commands" '^list shot turntable view test bench.* --help --version$' "$(complete_line psr '')"
is "a command from its first letters" "turntable" "$(complete_line psr tu)"
is "options from their first letters" "--ambient" "$(complete_line psr shot --am)"
is "values of an option" "draft" "$(complete_line psr shot --quality d)"
is "and after its letter" "good" "$(complete_line psr shot -q g)"
is "models of a server" "dice" "$(complete_line psr shot --server "$server" --model d)"
is "options of psrd" "--max-clients" "$(complete_line psrd --max-cl)"
if command -v psr-model >/dev/null; then
	is "options of a command of psr-model" "--resolution" "$(complete_line psr-model build --res)"
else
	skip "options of a command of psr-model" "this configuration has no psr-model"
fi
is "files" "$work/models" "$(complete_line psr shot -o "$work/mod")"
all_have_options=yes
for command in $(psr --completions | cut -f 1); do
	[ "$command" = view ] || psr "$command" --completions | grep -q -- '^--server	s	ADDR		Where psrd listens$' \
		|| all_have_options="no: $command"
done
is "every command tells its options" yes "$all_have_options"

# --- zsh ---
if command -v zsh >/dev/null; then
	mkdir "$work/zsh"
	cat >"$work/zsh/try" <<-'END'
		zmodload zsh/zpty
		zpty shell zsh -f -i
		zpty -w shell "told() { print -r -- \"TOLD<\$BUFFER>END\"; BUFFER=; zle -I; }; zle -N told; bindkey '^X' told"
		zpty -w shell "PROMPT= fpath=($1 \$fpath); autoload -U compinit; compinit -u -d $2; zstyle ':completion:*' list-prompt ''; LISTMAX=1000; echo BEGIN"
		zpty -r shell line '*BEGIN*BEGIN*'
		zpty -w -n shell "$3"$'\t\030'
		zpty -r shell line '*TOLD<psr*>END*'
		print -r -- "$line"
	END
	complete_in_zsh() { timeout 60 zsh -f "$work/zsh/try" "$PWD/client/completion" "$work/zsh/dump" "$1" | tr -d '\r\a'; }
	has "zsh: a command" 'TOLD<psr turntable' "$(complete_in_zsh 'psr tu')"
	has "zsh: an option" '--ambient' "$(complete_in_zsh 'psr shot --amb')"
	has "zsh: a value" 'draft' "$(complete_in_zsh 'psr shot --quality dr')"
	has "zsh: a model" 'dice' "$(complete_in_zsh "psr shot --server $server --model d")"
else
	skip "completion in zsh" "zsh is not there"
fi

# --- ~/.config/psr/psr.conf ---
export XDG_CONFIG_HOME=$work/config
conf=$work/config/psr/psr.conf
size() { psr "$@" --report - -o "$work/a.png" 2>/dev/null | tr -d '[:space:]' | grep -o '"size":\[[^]]*\]' | head -n 1; }
printf '# mine\nserver = %s\n\n[shot]\nsize = 96x80\nmodel=dice\n[turntable]\nframes = 2\n' "$server" >"$conf"
is "a server and a size of its own" '"size":[96,80]' "$(size shot)"
is "the command line wins" '"size":[64,48]' "$(size shot --size 64x48)"
has "--help shows it" 'pixels. \[96x80\]' "$(psr shot --help)"
has "another command has its own section" 'fit. \[2\]' "$(psr turntable --help)"
has "PSR_SERVER is nearer than the file" 'cannot connect to unix:/nowhere' "$(PSR_SERVER=unix:/nowhere psr list 2>&1)"
psr shot --size 40x40 --report "$work/r.json" -o "$work/r.png"
check "a report is replayed as it is" psr shot --replay "$work/r.json" -o "$work/s.png"
check "with the same bytes" cmp "$work/r.png" "$work/s.png"
refused() { # claim text sentence
	printf "$2" >"$conf"
	psr shot --model dice -o "$work/b.png" >/dev/null 2>"$work/err"
	is "$1: status" 2 $?
	has "$1: what and where" "psr.conf, line $3" "$(cat "$work/err")"
}
refused "an unknown option" 'server = unix:/x\n[shot]\nsizee = 3x3\n' '3: unknown option sizee; did you mean size'
refused "an unknown section" '[short]\nsize = 3x3\n' '1: there is no section \[short\]'
refused "a value out of range" 'timeout = 0\n' "1: --timeout: '0' is out of range"
refused "no line of the kind" '\nserver\n' "2: 'server' is not .name = value."
printf 'server = %s\nsize = 64x48\n' "$server" >"$conf"
refuses "an option above all sections is one of every command" 2 "psr.conf, line 2: unknown option size" psr list
rm "$conf"
