#!/bin/bash
# not for threads
# Documents: lines fit a page, links lead somewhere, the map and decisions are short, the index has every decision, the
# page of hard cases every test, and wide tables fold.
. "$(dirname "$0")/lib.sh"

MOST_COLUMNS=100
MOST_MAP=200     # lines of the map of the house
MOST_DECISION=40 # lines of a decision
mapfile -t pages < <(git ls-files -- '*.md' 2>/dev/null || find . -path ./build -prune -o -name '*.md' -print)

none() { # claim command...: each line that the command prints is against the claim
	local claim=$1 found
	shift
	found=$("$@" | head -n 20)
	if [ -z "$found" ]; then ok "$claim"; else not_ok "$claim" "${found//$'\n'/$'\n'# }"; fi
}

# Characters, not bytes, whatever the locale.
long_lines() {
	perl -CSD -ne 'chomp; print "$ARGV:$.: ", length, " columns\n" if length > '$MOST_COLUMNS'; close ARGV if eof' "$@"
}

# The targets of [text](target) outside of code, without those of other hosts and of this page's own headings.
dead_links() {
	perl -MFile::Basename -ne '
		if (/^```/) { $in_code = !$in_code }
		elsif (!$in_code) {
			s/`[^`]*`//g;
			for (/\]\(([^)]+)\)/g) {
				next if m{://|^mailto:};
				s/#.*//;
				print "$ARGV: $_\n" unless $_ eq "" || -e dirname($ARGV) . "/$_";
			}
		}
		$in_code = 0 if eof' "$@"
}

long_pages() { # most page...
	local most=$1
	shift
	awk -v most="$most" '
		FNR > most { n[FILENAME] = FNR }
		END { for (page in n) print page ": " n[page] " lines" }' "$@"
}

not_in_index() { # decision...
	local page index
	index=$(<docs/decisions/README.md)
	for page; do
		[[ $index == *"(${page##*/})"* ]] || echo "$page"
	done
}

# Lines with < are tests that the page lacks, with > what it has and is no test.
other_hard_cases() {
	diff <(grep -ho 'cmocka_unit_test([a-z0-9_]*' tests/hard/*.c | sed 's/.*(//' | sort) \
		<(grep -oE '^  `[a-z0-9_]+`$' docs/stability.md | tr -d ' `' | sort) | grep '^[<>]'
}

# Twenty columns of two rows after a label: 189 columns of text.
wide_table() {
	local row
	for row in one another; do
		printf '%-9s' "$row"
		for i in {1..20}; do printf ' %8s' "$row$i"; done
		echo
	done
}
lost_words() { # table: words that fold.awk leaves out
	comm -23 <(tr -s ' ' '\n' <"$1" | sort -u) <(awk -f docs/fold.awk "$1" | tr -s ' ' '\n' | sort -u)
}

check "there are documents" test ${#pages[@]} -gt 0
none "no line of a document has more than $MOST_COLUMNS columns" long_lines "${pages[@]}"
none "every relative link of a document leads to a file" dead_links "${pages[@]}"
none "docs/architecture.md has at most $MOST_MAP lines" long_pages $MOST_MAP docs/architecture.md
none "a decision has at most $MOST_DECISION lines" long_pages $MOST_DECISION docs/decisions/[0-9]*.md
none "the index of decisions has every one" not_in_index docs/decisions/[0-9]*.md
none "docs/stability.md has each test of tests/hard once, and no other" other_hard_cases

wide_table >"$work/table"
awk -f docs/fold.awk "$work/table" >"$work/folded"
none "a table that is folded fits a page" long_lines "$work/folded"
none "and has all of its columns" lost_words "$work/table"
check "with the first column in each part" test "$(grep -c '^another ' "$work/folded")" -gt 1

printf 'a sentence of words and %0120d, which is none of them\n' 7 >"$work/long"
none "a word that is longer than a line stays whole" lost_words "$work/long"
