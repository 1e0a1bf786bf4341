# Completion in bash for psr, psr-model, psrd and the viewers. Each prints its own options with --completions: a line
# `--name TAB letter TAB argument TAB words TAB help`, or `name` for a command.

_psr_models() {
	local i server=()
	for ((i = 1; i < COMP_CWORD - 1; i++)); do
		case ${COMP_WORDS[i]} in -s | --server) server=(--server "${COMP_WORDS[i + 1]}") ;; esac
	done
	# A server that does not answer must not hold up the shell.
	timeout 2 "$1" list "${server[@]}" 2>/dev/null | awk 'NR > 1 { print $1 }'
}

# Sets COMPREPLY to words that begin with the second argument.
_psr_words() {
	mapfile -t COMPREPLY < <(compgen -W "$1" -- "$2")
}

_psr_value() {
	local program=$1 argument=$2 words=$3 current=$4
	case $words,$argument in
	@models,*) case $program in */psr | psr) ;; */*) program=${program%/*}/psr ;; *) program=psr ;; esac
		_psr_words "$(_psr_models "$program")" "$current" ;;
	?*,*) _psr_words "$words" "$current" ;;
	*,DIR*) mapfile -t COMPREPLY < <(compgen -d -- "$current") && compopt -o filenames ;;
	*,*FILE* | *,OUT* | *,REPORT | *,FRAME*) mapfile -t COMPREPLY < <(compgen -f -- "$current") && compopt -o filenames ;;
	esac
}

_psr() {
	local program=$1 current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
	local run=("$program") name letter argument words help options=() tab=$'\t'
	COMPREPLY=()
	case ${program##*/} in
	psr | psr-model)
		if ((COMP_CWORD == 1)); then
			_psr_words "$("$program" --completions 2>/dev/null | cut -f 1) --help --version" "$current"
			return
		fi
		run+=("${COMP_WORDS[1]}") ;;
	esac
	# Tabs are white space, which `read` would take as one.
	while IFS=$'\x1f' read -r name letter argument words help; do
		options+=("$name")
		if [[ -n $argument && ($previous == "$name" || (-n $letter && $previous == "-$letter")) ]]; then
			_psr_value "$program" "$argument" "$words" "$current"
			return
		fi
	done < <("${run[@]}" --completions 2>/dev/null | tr "$tab" '\037')
	if [[ $current == -* ]]; then
		_psr_words "${options[*]}" "$current"
	else
		mapfile -t COMPREPLY < <(compgen -f -- "$current") && compopt -o filenames
	fi
}

complete -F _psr psr psr-model psrd psr-view psr-view-term
