#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "text.h"
#include "import/import.h"

#define RUN ((uint64_t)16384) /* bytes */

void text_rewind(struct text_points *t)
{
	feed_seek(&t->feed, t->first);
	t->line = t->first_line;
	t->n_read = t->left = t->run = 0;
}

static int fail_end(const struct text_points *t, struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_FORMAT, "%s: line %llu promises %llu points, but the file has only %llu more; is it cut "
	                "short?", t->feed.path, (unsigned long long)t->promised_line, (unsigned long long)t->promised,
	                (unsigned long long)(t->promised - t->left));
}

/* Reads a line of exactly n numbers. */
static int read_numbers(struct text_points *t, struct text_row *row, unsigned n, struct psr_error *err)
{
	const uint8_t *line;
	size_t length;
	int rc = text_next_line(t, &line, &length, err);

	if (rc == PSR_OK && line == NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: line %llu: the file ends before a scan begins; is it cut short?",
		                t->feed.path, (unsigned long long)t->line);
	if (rc == PSR_OK)
		rc = text_split(row, t, line, length, err);
	if (rc == PSR_OK && row->n != n)
		rc = text_fail(t, err, "%u numbers instead of %u%s", row->n, n,
		               n == 1 ? ", which say how many points come" : " of the header of a scan");
	return rc;
}

static int read_count(struct text_points *t, uint64_t *count, struct psr_error *err)
{
	struct text_row row;
	int rc = read_numbers(t, &row, 1, err);

	if (rc != PSR_OK)
		return rc;
	if (!(row.value[0] >= 0.0 && row.value[0] <= 0x1p40) || row.value[0] != floor(row.value[0]))
		return text_fail(t, err, "%g is not a number of points", row.value[0]);
	*count = (uint64_t)row.value[0];
	return PSR_OK;
}

/* The matrix takes rows: x' = x m00 + y m10 + z m20 + m30. */
static int read_matrix(struct text_points *t, struct psr_error *err)
{
	struct text_row row;
	int rc = PSR_OK;

	for (int i = 0; i < 4 && rc == PSR_OK; i++) /* the scanner's place and axes */
		rc = read_numbers(t, &row, 3, err);
	for (int i = 0; i < 4 && rc == PSR_OK; i++) {
		rc = read_numbers(t, &row, 4, err);
		for (int c = 0; c < 3 && rc == PSR_OK; c++) {
			t->matrix[c][i] = row.value[c];
			if (!isfinite(row.value[c]))
				rc = text_fail(t, err, "the matrix of the scan is not finite");
		}
	}
	return rc;
}

static int read_scan(struct text_points *t, struct psr_error *err)
{
	uint64_t columns = 0, rows = 1;
	int rc = read_count(t, &columns, err);

	t->promised_line = t->line;
	if (t->kind == TEXT_PTX) {
		if (rc == PSR_OK)
			rc = read_count(t, &rows, err);
		if (rc == PSR_OK && rows != 0 && columns > UINT64_MAX / rows)
			rc = text_fail(t, err, "too many points");
		if (rc == PSR_OK)
			rc = read_matrix(t, err);
	}
	t->promised = t->left = columns * rows;
	return rc;
}

static int is_blank_to_the_end(struct text_points *t, int *is_end, struct psr_error *err)
{
	const uint8_t *line;
	size_t n;
	int rc = PSR_OK;

	for (*is_end = 1; rc == PSR_OK && *is_end;) {
		rc = feed_need(&t->feed, FEED_LINE, err);
		if (rc != PSR_OK || feed_is_at_end(&t->feed))
			break;
		const size_t before = t->feed.next;

		rc = feed_line(&t->feed, &line, &n, err);
		if (rc == PSR_OK && !text_is_comment(line, n)) {
			t->feed.next = before; /* feed_need() has made room, so that the window is the same */
			*is_end = 0;
			break;
		}
		t->line++;
	}
	return rc;
}

/* Goes to the next scan that has points. */
static int begin_scan(struct text_points *t, int *is_there, struct psr_error *err)
{
	int rc = PSR_OK, is_end = 0;

	while (rc == PSR_OK && t->left == 0) {
		rc = is_blank_to_the_end(t, &is_end, err);
		if (rc != PSR_OK || is_end)
			break;
		rc = read_scan(t, err);
	}
	*is_there = rc == PSR_OK && !is_end;
	return rc;
}

static void move(const struct text_points *t, double at[3])
{
	const double p[3] = { at[0], at[1], at[2] };

	for (int c = 0; c < 3; c++)
		at[c] = p[0] * t->matrix[c][0] + p[1] * t->matrix[c][1] + p[2] * t->matrix[c][2] + t->matrix[c][3];
}

/* A run begins behind the first end of a line in it. */
static int skip_runs(struct text_points *t, struct psr_error *err)
{
	const uint64_t at = t->feed.at + t->feed.next;
	const uint8_t *line;
	size_t n;

	if (at < t->first + (t->run + 1) * RUN)
		return PSR_OK;
	t->run += t->step;
	feed_seek(&t->feed, t->first + t->run * RUN < t->feed.n_bytes ? t->first + t->run * RUN : t->feed.n_bytes);
	return feed_line(&t->feed, &line, &n, err);
}

static int next_row(struct text_points *t, struct text_row *row, int *is_there, struct psr_error *err)
{
	const uint8_t *line;
	size_t n;
	int rc = PSR_OK;

	*is_there = 1;
	if (t->kind != TEXT_XYZ) {
		rc = begin_scan(t, is_there, err);
		if (rc != PSR_OK || !*is_there)
			return rc;
	}
	if (t->step > 1)
		rc = skip_runs(t, err);
	if (rc == PSR_OK)
		rc = text_next_line(t, &line, &n, err);
	if (rc != PSR_OK)
		return rc;
	if (line == NULL) {
		*is_there = 0;
		return t->left > 0 ? fail_end(t, err) : PSR_OK;
	}
	rc = text_split(row, t, line, n, err);
	if (rc == PSR_OK && row->n < t->n_needed)
		rc = text_fail(t, err, "%u numbers, but a point has %u%s", row->n, t->n_needed,
		               feed_is_at_end(&t->feed) ? "; is the file cut short?" : "");
	t->left -= t->kind != TEXT_XYZ;
	return rc;
}

int text_next(struct text_points *t, struct text_row *row, int *is_there, struct psr_error *err)
{
	int rc;

	do
		rc = next_row(t, row, is_there, err);
	while (rc == PSR_OK && *is_there && t->kind == TEXT_PTX && row->value[0] == 0.0 && row->value[1] == 0.0 &&
	       row->value[2] == 0.0);
	if (rc != PSR_OK || !*is_there)
		return rc;
	t->n_read++;
	if (t->kind == TEXT_PTX)
		move(t, row->value);
	return PSR_OK;
}

/* ---- the source ---- */

static uint8_t code_of(double x)
{
	return (uint8_t)(x > 0.0 ? fmin(x + 0.5, 255.0) : 0.0);
}

static void put_point(struct octree_point *point, const struct text_points *t, const struct text_row *row)
{
	const int *column = t->column;

	*point = (struct octree_point){ .color = { 0 } };
	for (int c = 0; c < 3; c++) {
		point->at[c] = row->value[column[TEXT_X + c]];
		if (column[TEXT_RED] >= 0)
			point->color[c] = code_of(row->value[column[TEXT_RED + c]] * t->color_scale);
		else if (column[TEXT_INTENSITY] >= 0)
			point->color[c] = gray_code(&t->gray, row->value[column[TEXT_INTENSITY]]);
		if (column[TEXT_NX] >= 0)
			point->normal[c] = (float)row->value[column[TEXT_NX + c]];
	}
}

static int go_back(void *userdata, struct psr_error *err)
{
	(void)err;
	text_rewind(userdata);
	return PSR_OK;
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct text_points *t = userdata;
	struct text_row row;
	int rc = PSR_OK, is_there = 1;

	for (*n = 0; *n < room && rc == PSR_OK;) {
		rc = text_next(t, &row, &is_there, err);
		if (rc != PSR_OK || !is_there)
			break;
		put_point(&points[(*n)++], t, &row);
	}
	return rc;
}

/* How many points a text has is known behind its end alone; its first window tells how long lines are. */
static uint64_t estimate(struct text_points *t)
{
	uint64_t n = 0;

	text_rewind(t);
	if (feed_need(&t->feed, FEED_WINDOW, NULL) != PSR_OK || t->feed.n == 0)
		return 1;
	for (size_t i = 0; i < t->feed.n; i++)
		n += t->feed.bytes[i] == '\n';
	return (uint64_t)((double)(n + 1) * (double)(t->feed.n_bytes - t->first) / (double)t->feed.n);
}

/* Passes over the mark that some programs begin UTF-8 with. */
static int skip_mark(struct text_points *t, struct psr_error *err)
{
	const int rc = feed_need(&t->feed, IMPORT_MARK, err);

	if (rc != PSR_OK || t->feed.n < 2)
		return rc;
	if ((t->feed.bytes[0] == 0xff && t->feed.bytes[1] == 0xfe) || (t->feed.bytes[0] == 0xfe && t->feed.bytes[1] == 0xff))
		return psr_fail(err, PSR_ERR_FORMAT, "%s: UTF-16; save it as UTF-8, or as plain text", t->feed.path);
	t->feed.next = t->first = import_mark(t->feed.bytes, t->feed.n);
	return PSR_OK;
}

int text_points_open(struct octree_source *out, const char *path, enum text_kind kind, uint64_t part,
                     struct psr_error *err)
{
	struct text_points *t = calloc(1, sizeof *t);
	int rc;

	if (t == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read it", path);
	*out = (struct octree_source){ .name = path, .rewind = go_back, .read = read_points, .userdata = t };
	t->kind = kind;
	t->color_scale = 1.0;
	t->step = 1;
	t->locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	rc = feed_open(&t->feed, path, err);
	if (rc == PSR_OK && t->locale == (locale_t)0)
		rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a locale", path);
	if (rc == PSR_OK)
		rc = skip_mark(t, err);
	if (rc == PSR_OK)
		rc = text_find_columns(t, err);
	if (rc == PSR_OK)
		out->n_points = estimate(t);
	if (rc == PSR_OK && part > 0 && kind == TEXT_XYZ) {
		t->step = (out->n_points + part - 1) / part;
		t->feed.room = t->step > 1 ? FEED_LINE : t->feed.room;
	}
	if (rc == PSR_OK)
		rc = text_find_colors(t, err);
	if (rc != PSR_OK) {
		text_points_close(out);
		return rc;
	}
	out->has_color = t->column[TEXT_RED] >= 0 || t->column[TEXT_INTENSITY] >= 0;
	out->has_normal = t->column[TEXT_NX] >= 0;
	out->n_points = out->has_color ? t->n_read : out->n_points / t->step + 1;
	text_rewind(t);
	return PSR_OK;
}

void text_points_close(struct octree_source *source)
{
	struct text_points *t = source->userdata;

	if (t == NULL)
		return;
	feed_close(&t->feed);
	gray_fini(&t->gray);
	if (t->locale != (locale_t)0)
		freelocale(t->locale);
	free(t);
	source->userdata = NULL;
}
