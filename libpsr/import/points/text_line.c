#define _GNU_SOURCE
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "text.h"
#include "import/import.h"

#define SHOWN 40 /* characters of a word in an error text */

int text_fail(const struct text_points *t, struct psr_error *err, const char *format, ...)
{
	char text[PSR_ERROR_TEXT];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	return psr_fail(err, PSR_ERR_FORMAT, "%.300s: %s %llu: %.160s", t->feed.path, t->step > 1 ? "before byte" : "line",
	                (unsigned long long)(t->step > 1 ? t->feed.at + t->feed.next : t->line), text);
}

static int is_between(uint8_t c)
{
	return c == ' ' || c == ',' || c == ';' || (c >= '\t' && c <= '\r');
}

size_t text_word(const uint8_t **word, const uint8_t **at, const uint8_t *end)
{
	const uint8_t *p = *at;

	while (p < end && is_between(*p))
		p++;
	*word = p;
	while (p < end && !is_between(*p))
		p++;
	*at = p;
	return (size_t)(p - *word);
}

int text_is_comment(const uint8_t *line, size_t n)
{
	const uint8_t *word, *at = line;
	const size_t length = text_word(&word, &at, line + n);

	return length == 0 || word[0] == '#' || (length >= 2 && word[0] == '/' && word[1] == '/');
}

int text_next_line(struct text_points *t, const uint8_t **line, size_t *n, struct psr_error *err)
{
	int rc;

	do {
		rc = feed_line(&t->feed, line, n, err);
		t->line++;
	} while (rc == PSR_OK && *line != NULL && text_is_comment(*line, *n));
	return rc;
}

/* Shows what can be shown of a word. */
static void show(char out[SHOWN + 1], const uint8_t *word, size_t n)
{
	size_t i;

	for (i = 0; i < n && i < SHOWN; i++)
		out[i] = word[i] > ' ' && word[i] < 127 ? (char)word[i] : '?';
	out[i] = '\0';
}

static int is_digit(uint8_t c)
{
	return c >= '0' && c <= '9';
}

/* Whether a line's commas can only be decimal ones: three words or more, which blanks or semicolons part, none with a
 * point, some with one comma between digits, and no other commas. */
static int has_decimal_commas(const uint8_t *line, size_t n)
{
	const uint8_t *p = memchr(line, ',', n), *end = line + n;
	int n_words = 0, n_commas;

	if (p == NULL || memchr(line, '.', n) != NULL)
		return 0;
	for (p = line; p < end; p++) {
		if (*p != ',' && is_between(*p))
			continue;
		n_words++;
		for (n_commas = 0; p < end && (*p == ',' || !is_between(*p)); p++)
			if (*p == ',' && (++n_commas > 1 || p == line || p + 1 == end || !is_digit(p[-1]) || !is_digit(p[1])))
				return 0;
	}
	return n_words >= 3;
}

int text_split(struct text_row *row, const struct text_points *t, const uint8_t *line, size_t n, struct psr_error *err)
{
	const uint8_t *word, *at = line;
	char shown[SHOWN + 1];
	size_t length;

	row->n = 0;
	if (has_decimal_commas(line, n))
		return text_fail(t, err, "decimal commas: numbers have points here, and commas are between them");
	while ((length = text_word(&word, &at, line + n)) > 0 && row->n < TEXT_MOST_COLUMNS) {
		if (!import_number(&row->value[row->n], word, length, t->locale)) {
			show(shown, word, length);
			return text_fail(t, err, "\"%s\" is not a number", shown);
		}
		row->n++;
	}
	return PSR_OK;
}
