# Lines of at most 100 columns: sentences are wrapped, and a table that is wider is printed in parts below each other, each
# with the first column. Columns are what all rows have blanks (or "|") between; rows that have none in common are wrapped.
BEGIN { most = 100 }

function is_sentence(line) {
	sub(/^ */, "", line)
	return line !~ /  / && line !~ / \|( |$)/ && split(line, words, " ") > 3
}

# Sentences that follow each other are one if any of them is too long.
function print_sentences(   i) {
	for (i = 1; i <= n_sentences; i++)
		if (is_long)
			joined = joined (i > 1 ? " " : "") sentence[i]
		else
			print sentence[i]
	if (is_long)
		print_wrapped(joined)
	joined = ""
	n_sentences = is_long = 0
}

# A word that is longer than a line stays whole.
function print_wrapped(line,   cut, text) {
	while (length(line) > most) {
		cut = most + 1
		while (cut > 1 && substr(line, cut, 1) != " ")
			cut--
		if (cut == 1)
			cut = index(line " ", " ")
		text = substr(line, 1, cut - 1)
		sub(/ +$/, "", text)
		print text
		line = substr(line, cut + 1)
	}
	if (line != "")
		print line
}

# kind[p]: 2 if some row has a "|" at p, 1 if all have blanks, 0 if some row has anything else.
function find_columns(   i, p, c) {
	for (p = 1; p <= width; p++) {
		kind[p] = 1
		for (i = 1; i <= n_rows && kind[p]; i++) {
			c = substr(row[i], p, 1)
			kind[p] = c == "|" ? 2 : c == " " || c == "" ? kind[p] : 0
		}
	}
	kind[width + 1] = 2
	for (p = 2; p <= width && !(kind[p] == 2 || kind[p] && kind[p + 1]); p++)
		;
	first = kind[p] == 1 ? p : p - 1
}

# Where the part that begins at `from` ends: at a "|" in its second half if there is one, else as evenly as columns allow.
function end_of_part(from,   room, parts, even, p, best) {
	room = most - first
	if (width - from < room)
		return width
	parts = int((width - from) / room) + 1
	even = from + int((width - from) / parts)
	for (p = from + room - 1; p > from + room / 2; p--)
		if (kind[p + 1] == 2)
			return p
	best = from + room - 1
	for (p = best; p > from; p--)
		if (kind[p + 1] && (!kind[best + 1] || p >= even))
			best = p
	return best
}

function print_part(from, to,   i, text) {
	for (i = 1; i <= n_rows; i++) {
		text = sprintf("%-*s", first, substr(row[i], 1, first)) substr(row[i], from, to - from + 1)
		sub(/ +$/, "", text)
		if (text != "")
			print text
	}
}

function print_rows(   i, from, to) {
	if (width > most)
		find_columns()
	if (width <= most || first >= most) {
		for (i = 1; i <= n_rows; i++)
			print_wrapped(row[i])
	} else {
		for (from = first + 1; from <= width; from = to + 1) {
			if (from > first + 1)
				print ""
			to = end_of_part(from)
			print_part(from, to)
		}
	}
	n_rows = width = 0
}

/^ *$/ { print_sentences(); print_rows(); print; next }
is_sentence($0) { print_rows(); sentence[++n_sentences] = $0; is_long = is_long || length($0) > most; next }
{ print_sentences(); row[++n_rows] = $0; if (length($0) > width) width = length($0) }
END { print_sentences(); print_rows() }
