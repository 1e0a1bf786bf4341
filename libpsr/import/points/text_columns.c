#define _GNU_SOURCE
#include <math.h>
#include <string.h>
#include <strings.h>
#include "text.h"
#include "import/import.h"

#define TRIED 1000 /* rows that tell a normal from a colour */

static int role_of(const uint8_t *word, size_t n)
{
	static const struct {
		const char *name;
		enum text_role role;
	} names[] = {
		{ "x", TEXT_X },           { "y", TEXT_Y },        { "z", TEXT_Z },         { "i", TEXT_INTENSITY },
		{ "intensity", TEXT_INTENSITY }, { "reflectance", TEXT_INTENSITY }, { "r", TEXT_RED }, { "g", TEXT_GREEN },
		{ "b", TEXT_BLUE },        { "red", TEXT_RED },    { "green", TEXT_GREEN }, { "blue", TEXT_BLUE },
		{ "nx", TEXT_NX },         { "ny", TEXT_NY },      { "nz", TEXT_NZ },       { "normal_x", TEXT_NX },
		{ "normal_y", TEXT_NY },   { "normal_z", TEXT_NZ },
	};

	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (strlen(names[i].name) == n && strncasecmp(names[i].name, (const char *)word, n) == 0)
			return (int)names[i].role;
	return -1;
}

static void forget_names(int column[TEXT_ROLES])
{
	for (int i = 0; i < TEXT_ROLES; i++)
		column[i] = -1;
}

/* Reads names of columns; without x, y and z they are none. */
static void read_names(struct text_points *t, const uint8_t *line, size_t n)
{
	const uint8_t *word, *at = line, *end = line + n;
	int column[TEXT_ROLES], role;
	size_t length;

	forget_names(column);
	for (int i = 0; (length = text_word(&word, &at, end)) > 0 && i < TEXT_MOST_COLUMNS; i++) {
		while (length > 0 && (*word == '#' || *word == '/' || *word == '"')) {
			word++;
			length--;
		}
		while (length > 0 && word[length - 1] == '"')
			length--;
		if (length == 0) { /* a mark by itself */
			i--;
			continue;
		}
		role = role_of(word, length);
		if (role >= 0 && column[role] < 0)
			column[role] = i;
	}
	if (column[TEXT_X] < 0 || column[TEXT_Y] < 0 || column[TEXT_Z] < 0)
		return;
	memcpy(t->column, column, sizeof column);
	t->has_names = 1;
}

static void place(struct text_points *t, enum text_role role, int first, int n)
{
	for (int i = 0; i < n; i++)
		t->column[(int)role + i] = first + i;
}

static void guess(struct text_points *t)
{
	const unsigned n = t->n_columns;

	place(t, TEXT_X, 0, 3);
	if (n == 4 || n == 7 || n == 10)
		place(t, TEXT_INTENSITY, 3, 1);
	if (n == 6 || n == 9)
		place(t, TEXT_RED, 3, 3);
	if (n == 7 || n == 10)
		place(t, TEXT_RED, 4, 3);
	if (n == 9 || n == 10)
		place(t, TEXT_NX, (int)n - 3, 3);
	t->may_be_normals = n == 6;
}

static int is_whole(const int column[TEXT_ROLES], enum text_role role)
{
	return column[role] >= 0 && column[role + 1] >= 0 && column[role + 2] >= 0;
}

/* Colours and normals have three parts; beside colours, intensities are not wanted. */
static void tidy(struct text_points *t)
{
	if (!is_whole(t->column, TEXT_RED))
		t->column[TEXT_RED] = -1;
	if (!is_whole(t->column, TEXT_NX))
		t->column[TEXT_NX] = -1;
	if (t->column[TEXT_RED] >= 0)
		t->column[TEXT_INTENSITY] = -1;
}

static int starts_with_letter(const uint8_t *line, size_t n)
{
	const uint8_t *word, *at = line;
	const size_t length = text_word(&word, &at, line + n);
	const uint8_t c = length > 0 ? *word : 0;

	if (length >= 3 && (strncasecmp((const char *)word, "nan", 3) == 0 || strncasecmp((const char *)word, "inf", 3) == 0))
		return 0;
	return c == '"' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

int text_find_columns(struct text_points *t, struct psr_error *err)
{
	const uint8_t *line;
	struct text_row row;
	size_t n;
	int rc, is_there;

	forget_names(t->column);
	t->n_needed = 3;
	while (t->kind == TEXT_XYZ) {
		t->first = t->feed.at + t->feed.next;
		t->first_line = t->line;
		rc = feed_line(&t->feed, &line, &n, err);
		if (rc != PSR_OK)
			return rc;
		if (line == NULL)
			break;
		t->line++;
		if (!text_is_comment(line, n) && !starts_with_letter(line, n)) {
			rc = text_split(&row, t, line, n, err);
			if (rc != PSR_OK)
				return rc;
			if (row.n > 1 || row.value[0] != floor(row.value[0])) /* a number by itself counts the points */
				break;
		}
		read_names(t, line, n);
	}
	text_rewind(t);
	rc = text_next(t, &row, &is_there, err);
	if (rc != PSR_OK)
		return rc;
	if (!is_there)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: there are no points", t->feed.path);
	t->n_columns = row.n;
	if (!t->has_names)
		guess(t);
	tidy(t);
	for (int i = 0; i < TEXT_ROLES; i++)
		t->n_needed = t->column[i] >= (int)t->n_needed ? (unsigned)t->column[i] + 1 : t->n_needed;
	if (t->n_needed > row.n)
		return text_fail(t, err, "%u numbers, but the names of columns promise %u", row.n, t->n_needed);
	return PSR_OK;
}

static void note_color(struct text_points *t, const struct text_row *row)
{
	for (int c = 0; c < 3; c++) {
		const double x = row->value[t->column[TEXT_RED + c]];

		t->largest = x > t->largest ? x : t->largest;
	}
}

/* Six columns: are the last three of unit length? Four digits are enough. */
static int is_normal(const struct text_row *row)
{
	const double *n = row->value + 3;

	return fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0) < 0.01;
}

static void end_colors(struct text_points *t)
{
	gray_end(&t->gray);
	t->color_scale = t->largest <= 1.0 ? 255.0 : t->largest <= 255.0 ? 1.0 : 255.0 / 65535.0;
	if (t->column[TEXT_INTENSITY] >= 0 && t->gray.scale == 0.0)
		t->column[TEXT_INTENSITY] = -1;
}

int text_find_colors(struct text_points *t, struct psr_error *err)
{
	struct text_row row;
	int rc = PSR_OK, is_there = 1, n_normals = 0;

	text_rewind(t);
	while (t->may_be_normals && t->n_read < TRIED && (rc = text_next(t, &row, &is_there, err)) == PSR_OK && is_there)
		n_normals += is_normal(&row);
	if (rc != PSR_OK)
		return rc;
	if (t->may_be_normals && n_normals == (int)t->n_read) {
		place(t, TEXT_NX, 3, 3);
		t->column[TEXT_RED] = -1;
	}
	if (t->column[TEXT_RED] < 0 && t->column[TEXT_INTENSITY] < 0)
		return PSR_OK;
	if (!gray_begin(&t->gray))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for intensities", t->feed.path);
	text_rewind(t);
	while ((rc = text_next(t, &row, &is_there, err)) == PSR_OK && is_there) {
		if (t->column[TEXT_RED] >= 0)
			note_color(t, &row);
		else
			gray_note(&t->gray, row.value[t->column[TEXT_INTENSITY]]);
	}
	end_colors(t);
	return rc;
}

/* How many numbers a line begins with. */
static int count_numbers(const uint8_t *line, size_t n, locale_t locale)
{
	const uint8_t *word, *at = line;
	int count = 0;
	size_t length;
	double x;

	while (count < TEXT_MOST_COLUMNS && (length = text_word(&word, &at, line + n)) > 0 &&
	       import_number(&x, word, length, locale))
		count++;
	return count;
}

int text_looks_like_points(const uint8_t *bytes, size_t n_bytes)
{
	const uint8_t *line = bytes + import_mark(bytes, n_bytes), *end = bytes + n_bytes;
	locale_t locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	int n = 1; /* a number by itself says how many points there are */

	while (locale != (locale_t)0 && line < end && n == 1) {
		const uint8_t *stop = memchr(line, '\n', (size_t)(end - line));
		const size_t length = (size_t)((stop != NULL ? stop : end) - line);

		if (memchr(line, '\0', length) != NULL)
			break;
		if (!text_is_comment(line, length) && !starts_with_letter(line, length))
			n = count_numbers(line, length, locale);
		line += length + (stop != NULL);
	}
	if (locale != (locale_t)0)
		freelocale(locale);
	return n >= 3;
}
