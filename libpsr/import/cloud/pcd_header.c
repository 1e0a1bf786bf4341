#include <string.h>
#include "pcd.h"

#define MAX_COUNT 65536 /* values of a field */
#define MAX_WORDS (PCD_MAX_FIELDS + 1)

/* A line of the header, in words. */
struct line {
	unsigned number, n;
	struct {
		const uint8_t *at;
		size_t n;
	} word[MAX_WORDS];
};

/* Which lines were read; FIELDS and DATA must be there. */
enum { HAS_FIELDS = 1, HAS_SIZE = 2, HAS_TYPE = 4, HAS_COUNT = 8, HAS_WIDTH = 16, HAS_HEIGHT = 32, HAS_POINTS = 64,
	   HAS_DATA = 128 };

struct reading {
	struct pcd *pcd;
	struct psr_error *err;
	locale_t locale;
	struct line line;
	uint64_t at; /* in the file */
	unsigned has;
	uint64_t width, height, points;
};

static int is_blank(uint8_t c)
{
	return c == ' ' || c == '\t' || c == '\r';
}

static int is_word(const struct line *line, unsigned i, const char *text)
{
	return line->word[i].n == strlen(text) && memcmp(line->word[i].at, text, line->word[i].n) == 0;
}

/* Splits the next line; a comment has no words. Returns 0 at the end of the file, or for a line of too many words. */
static int next_line(struct reading *r)
{
	const uint8_t *b = r->pcd->bytes;
	const uint64_t n_bytes = r->pcd->n_there;
	struct line *line = &r->line;

	line->n = 0;
	line->number++;
	if (r->at == n_bytes)
		return 0;
	while (r->at < n_bytes && b[r->at] != '\n') {
		const uint64_t first = r->at;

		if (is_blank(b[r->at])) {
			r->at++;
			continue;
		}
		while (r->at < n_bytes && b[r->at] != '\n' && !is_blank(b[r->at]))
			r->at++;
		if (line->n == MAX_WORDS)
			return 0;
		line->word[line->n].at = b + first;
		line->word[line->n++].n = (size_t)(r->at - first);
	}
	r->at += r->at < n_bytes;
	if (line->n && line->word[0].at[0] == '#')
		line->n = 0;
	return 1;
}

static int fail(const struct reading *r, const char *what)
{
	return psr_fail(r->err, PSR_ERR_FORMAT, "%s: line %u: %s", r->pcd->path, r->line.number, what);
}

/* A whole number of 0..most. */
static int whole(const struct reading *r, unsigned i, double most, uint64_t *to)
{
	double x;

	if (!import_number(&x, r->line.word[i].at, r->line.word[i].n, r->locale) || !(x >= 0 && x <= most))
		return 0;
	*to = (uint64_t)x;
	return (double)*to == x;
}

static int read_fields(struct reading *r)
{
	struct pcd *pcd = r->pcd;

	pcd->n_fields = r->line.n - 1;
	if (pcd->n_fields == 0)
		return fail(r, "FIELDS names no field");
	for (unsigned i = 0; i < pcd->n_fields; i++)
		pcd->field[i] = (struct pcd_field){ .name = r->line.word[i + 1].at, .name_length = r->line.word[i + 1].n,
			                                .type = 'F', .size = 4, .count = 1 };
	return PSR_OK;
}

/* SIZE, TYPE and COUNT have a word a field. */
static int read_column(struct reading *r, unsigned which)
{
	struct pcd *pcd = r->pcd;

	if (!(r->has & HAS_FIELDS) || r->line.n - 1 != pcd->n_fields)
		return fail(r, "SIZE, TYPE and COUNT come after FIELDS, with a value for each of its names");
	for (unsigned i = 0; i < pcd->n_fields; i++) {
		struct pcd_field *f = &pcd->field[i];
		uint64_t x = 0;

		if (which == HAS_TYPE) {
			if (!is_word(&r->line, i + 1, "F") && !is_word(&r->line, i + 1, "I") && !is_word(&r->line, i + 1, "U"))
				return fail(r, "a TYPE is F, I or U");
			f->type = (char)*r->line.word[i + 1].at;
			continue;
		}
		if (!whole(r, i + 1, MAX_COUNT, &x) || x == 0)
			return fail(r, which == HAS_SIZE ? "a SIZE is 1, 2, 4 or 8" : "a COUNT is 1 to 65536");
		if (which == HAS_SIZE && x != 1 && x != 2 && x != 4 && x != 8)
			return fail(r, "a SIZE is 1, 2, 4 or 8");
		*(which == HAS_SIZE ? &f->size : &f->count) = (unsigned)x;
	}
	return PSR_OK;
}

static int read_viewpoint(struct reading *r)
{
	static const double origin[7] = { 0, 0, 0, 1, 0, 0, 0 };

	for (unsigned i = 0; i + 1 < r->line.n && i < 7; i++) {
		double x;

		if (!import_number(&x, r->line.word[i + 1].at, r->line.word[i + 1].n, r->locale))
			return fail(r, "VIEWPOINT takes seven numbers");
		r->pcd->has_viewpoint |= x != origin[i];
	}
	return PSR_OK;
}

static int read_data(struct reading *r)
{
	static const char *const names[] = { "ascii", "binary", "binary_compressed" };

	for (int i = 0; r->line.n == 2 && i < 3; i++)
		if (is_word(&r->line, 1, names[i])) {
			r->pcd->data = (enum pcd_data)i;
			return PSR_OK;
		}
	return fail(r, "DATA is ascii, binary or binary_compressed");
}

static int read_size(struct reading *r, uint64_t *to)
{
	if (r->line.n != 2 || !whole(r, 1, 0x1p53, to))
		return fail(r, "WIDTH, HEIGHT and POINTS take a whole number");
	return PSR_OK;
}

static int read_line(struct reading *r)
{
	static const struct {
		const char *name;
		unsigned has;
	} lines[] = { { "FIELDS", HAS_FIELDS }, { "COLUMNS", HAS_FIELDS }, { "SIZE", HAS_SIZE },     { "TYPE", HAS_TYPE },
		          { "COUNT", HAS_COUNT },   { "WIDTH", HAS_WIDTH },    { "HEIGHT", HAS_HEIGHT }, { "POINTS", HAS_POINTS },
		          { "DATA", HAS_DATA } };
	unsigned which = 0;

	for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
		which = is_word(&r->line, 0, lines[i].name) ? lines[i].has : which;
	if (r->has & which)
		return fail(r, "this line stands twice");
	r->has |= which;
	switch (which) {
	case HAS_FIELDS:
		return read_fields(r);
	case HAS_SIZE:
	case HAS_TYPE:
	case HAS_COUNT:
		return read_column(r, which);
	case HAS_WIDTH:
		return read_size(r, &r->width);
	case HAS_HEIGHT:
		return read_size(r, &r->height);
	case HAS_POINTS:
		return read_size(r, &r->points);
	case HAS_DATA:
		return read_data(r);
	default: /* VERSION, and what later versions may bring */
		return is_word(&r->line, 0, "VIEWPOINT") ? read_viewpoint(r) : PSR_OK;
	}
}

static int check_fields(struct reading *r)
{
	struct pcd *pcd = r->pcd;

	for (unsigned i = 0; i < pcd->n_fields; i++) {
		struct pcd_field *f = &pcd->field[i];

		if (f->type == 'F' && f->size < 4)
			return psr_fail(r->err, PSR_ERR_FORMAT, "%s: the PCD header has a float of %u bytes; 4 and 8 are known",
			                pcd->path, f->size);
		f->column = pcd->columns;
		f->offset = pcd->record;
		pcd->columns += f->count;
		pcd->record += (uint64_t)f->size * f->count;
	}
	return PSR_OK;
}

/* A value of text takes a character and a blank, which the last one may lack. */
static int check_points(struct reading *r)
{
	struct pcd *pcd = r->pcd;
	const uint64_t left = pcd->n_bytes - pcd->body;
	const uint64_t room = pcd->data == PCD_ASCII ? (left + 1) / (2 * pcd->columns) : left / pcd->record;

	if (r->has & HAS_WIDTH) {
		const uint64_t height = r->has & HAS_HEIGHT ? r->height : 1;

		if (r->has & HAS_POINTS && (height == 0 || r->points / height != r->width || r->points % height != 0))
			return psr_fail(r->err, PSR_ERR_FORMAT, "%s: the PCD header promises %llu points, but a width of %llu and a "
			                "height of %llu", pcd->path, (unsigned long long)r->points, (unsigned long long)r->width,
			                (unsigned long long)height);
		if (height != 0 && r->width > pcd->most / height)
			return psr_fail(r->err, PSR_ERR_LIMIT, "%s: more than %llu points", pcd->path,
			                (unsigned long long)pcd->most);
		r->points = r->width * height;
	}
	pcd->n_points = r->points;
	if (pcd->n_points == 0)
		return psr_fail(r->err, PSR_ERR_FORMAT, "%s: the PCD header promises no points", pcd->path);
	if (pcd->n_points > pcd->most)
		return psr_fail(r->err, PSR_ERR_LIMIT, "%s: more than %llu points", pcd->path,
		                (unsigned long long)pcd->most);
	if (pcd->data != PCD_COMPRESSED && pcd->n_points > room)
		return psr_fail(r->err, PSR_ERR_FORMAT,
		                "%s: the PCD header promises %llu points, but the file has room for only %llu; is it cut short?",
		                pcd->path, (unsigned long long)pcd->n_points, (unsigned long long)room);
	return PSR_OK;
}

static int read_lines(struct reading *r)
{
	while (!(r->has & HAS_DATA)) {
		if (!next_line(r))
			return fail(r, r->line.n ? "too many words" : "the PCD header ends without DATA");
		const int rc = r->line.n ? read_line(r) : PSR_OK;

		if (rc != PSR_OK)
			return rc;
	}
	if (!(r->has & HAS_FIELDS))
		return fail(r, "the PCD header has no FIELDS");
	r->pcd->body = r->at;
	r->pcd->data_line = r->line.number;
	const int rc = check_fields(r);

	return rc == PSR_OK ? check_points(r) : rc;
}

int pcd_header_read(struct pcd *pcd, struct psr_error *err)
{
	struct reading r = { .pcd = pcd, .err = err };

	r.locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	if (r.locale == (locale_t)0)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a locale", pcd->path);
	const int rc = read_lines(&r);

	freelocale(r.locale);
	return rc;
}

const struct pcd_field *pcd_find(const struct pcd *pcd, const char *name)
{
	for (unsigned i = 0; i < pcd->n_fields; i++)
		if (pcd->field[i].name_length == strlen(name) && memcmp(pcd->field[i].name, name, strlen(name)) == 0)
			return &pcd->field[i];
	return NULL;
}
