#define _GNU_SOURCE
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "obj.h"

#define LOW_BITS 20    /* of a vertex's index, as x; the rest is y: integers that a float holds */
#define LONGEST_NEW 24 /* "v ", the number, " 0" and the line's end */
#define MAX_WORDS 7    /* x y z w and a colour */

struct word {
	const uint8_t *at;
	size_t n;
};

struct reader {
	struct obj *obj;
	const char *path;
	const uint8_t *at, *end;
	uint64_t line;
	locale_t locale;
};

int obj_is(const char *path)
{
	return import_path_ends_with(path, ".obj");
}

static int is_end(uint8_t c)
{
	return c == '\n' || c == '\r';
}

static int is_blank(uint8_t c)
{
	return c == ' ' || c == '\t';
}

/* "v" and a blank, after any blanks. */
static int is_vertex(const uint8_t *at, const uint8_t *end)
{
	while (at < end && is_blank(*at))
		at++;
	return end - at >= 2 && at[0] == 'v' && is_blank(at[1]);
}

/* Moves *at over a backslash and the line end after it; returns 0 if there is none. */
static int skip_continuation(const uint8_t **at, const uint8_t *end)
{
	const uint8_t *p = *at + 1;

	if (**at != '\\' || p >= end || !is_end(*p))
		return 0;
	p += *p == '\r' && p + 1 < end && p[1] == '\n' ? 2 : 1;
	*at = p;
	return 1;
}

static int is_number(const struct word *word)
{
	const uint8_t c = word->at[0];

	return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.' ||
	       (word->n >= 3 && (strncasecmp((const char *)word->at, "nan", 3) == 0 ||
	                         strncasecmp((const char *)word->at, "inf", 3) == 0));
}

/* Reads the numbers after "v" up to the first other word; leaves the reader at the end of the line. */
static unsigned take_words(struct word word[MAX_WORDS], struct reader *r)
{
	unsigned n = 0;
	int is_over = 0;

	while (is_blank(*r->at))
		r->at++;
	r->at++;
	while (r->at < r->end && !is_end(*r->at)) {
		struct word w = { r->at, 0 };

		if (skip_continuation(&r->at, r->end)) {
			r->line++;
			continue;
		}
		if (is_blank(*r->at)) {
			r->at++;
			continue;
		}
		while (r->at < r->end && !is_end(*r->at) && !is_blank(*r->at) && *r->at != '#') {
			const uint8_t *p = r->at;

			if (w.n > 0 && skip_continuation(&p, r->end))
				break;
			r->at++;
			w.n++;
		}
		if (w.n == 0) /* a comment */
			while (r->at < r->end && !is_end(*r->at))
				r->at++;
		is_over = is_over || w.n == 0 || !is_number(&w);
		if (!is_over && n < MAX_WORDS)
			word[n++] = w;
	}
	return n;
}

/* Some programs write a decimal comma. */
static int read_number(double *x, const struct word *word, locale_t locale)
{
	uint8_t text[64];

	if (import_number(x, word->at, word->n, locale))
		return 1;
	if (word->n > sizeof text)
		return 0;
	for (size_t i = 0; i < word->n; i++)
		text[i] = word->at[i] == ',' ? '.' : word->at[i];
	return import_number(x, text, word->n, locale);
}

static int put_vertex(struct reader *r, const struct word *word, unsigned n, struct psr_error *err)
{
	struct obj *obj = r->obj;
	const unsigned has_w = n == 4 || n == MAX_WORDS, first_color = 3 + has_w;
	double *p = obj->position[obj->n], x[4] = { 0.0, 0.0, 0.0, 1.0 };

	for (unsigned i = 0; i < 3 + has_w; i++)
		if (!read_number(&x[i], &word[i], r->locale))
			return psr_fail(err, PSR_ERR_FORMAT, "%s: line %" PRIu64 ": \"%.*s\" is no number", r->path, r->line,
			                word[i].n < 64 ? (int)word[i].n : 64, (const char *)word[i].at);
	for (unsigned i = 0; i < 3; i++)
		p[i] = x[i] / x[3];
	obj->n_text += (size_t)sprintf((char *)obj->text + obj->n_text, "v %u %u 0", obj->n & ((1u << LOW_BITS) - 1),
	                               obj->n >> LOW_BITS);
	for (unsigned i = first_color; n - first_color == 3 && i < n; i++) {
		size_t length = word[i].n;

		while (word[i].at[length - 1] == '\\') /* before the line's end it would join the next line */
			length--;
		obj->text[obj->n_text++] = ' ';
		memcpy(obj->text + obj->n_text, word[i].at, length);
		obj->n_text += length;
	}
	obj->n++;
	return PSR_OK;
}

/* Copies the rest of the line, continuations too, and its end. */
static void copy_line(struct reader *r)
{
	const uint8_t *start = r->at;

	while (r->at < r->end && !is_end(*r->at)) {
		if (skip_continuation(&r->at, r->end))
			r->line++;
		else
			r->at++;
	}
	if (r->at < r->end)
		r->line += *r->at++ == '\n';
	memcpy(r->obj->text + r->obj->n_text, start, (size_t)(r->at - start));
	r->obj->n_text += (size_t)(r->at - start);
}

static int read_lines(struct reader *r, struct psr_error *err)
{
	int rc = PSR_OK;

	while (r->at < r->end && rc == PSR_OK) {
		struct word word[MAX_WORDS];
		const struct reader start = *r;
		unsigned n;

		if (is_vertex(r->at, r->end)) {
			n = take_words(word, r);
			if (n >= 3)
				rc = put_vertex(r, word, n, err);
			else
				*r = start;
		}
		copy_line(r); /* of a vertex only its end */
	}
	return rc;
}

/* An upper bound. */
static uint64_t count_vertices(const uint8_t *bytes, size_t n_bytes)
{
	const uint8_t *end = bytes + n_bytes;
	uint64_t n = 0;

	for (const uint8_t *at = bytes; at < end; at++) {
		const uint8_t *v = memchr(at, 'v', (size_t)(end - at));

		if (v == NULL)
			break;
		at = v;
		n += at + 1 < end && is_blank(at[1]) && (at == bytes || is_end(at[-1]) || is_blank(at[-1]));
	}
	return n;
}

int obj_read(struct obj *obj, const char *path, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	const uint64_t most = count_vertices(bytes, n_bytes);
	struct reader r = { .obj = obj, .path = path, .at = bytes, .end = bytes + n_bytes, .line = 1 };
	int rc;

	memset(obj, 0, sizeof *obj);
	if (most > IMPORT_MAX_VERTICES)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %" PRIu64 " vertices", path, IMPORT_MAX_VERTICES);
	obj->text = malloc(n_bytes + most * LONGEST_NEW + 1);
	obj->position = malloc((most + 1) * sizeof *obj->position);
	r.locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	if (obj->text == NULL || obj->position == NULL || r.locale == (locale_t)0)
		rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %" PRIu64 " vertices", path, most);
	else
		rc = read_lines(&r, err);
	if (r.locale != (locale_t)0)
		freelocale(r.locale);
	if (rc != PSR_OK)
		obj_fini(obj);
	return rc;
}

void obj_fini(struct obj *obj)
{
	free(obj->text);
	free(obj->position);
	memset(obj, 0, sizeof *obj);
}

void obj_position(double out[3], const struct obj *obj, float x, float y)
{
	const uint64_t most = UINT64_C(1) << LOW_BITS;
	const uint64_t i = x >= 0.0f && x < (float)most && y >= 0.0f && y < (float)most
	                           ? (uint64_t)x | (uint64_t)y << LOW_BITS
	                           : UINT64_MAX;

	for (int c = 0; c < 3; c++)
		out[c] = i < obj->n ? obj->position[i][c] : (double)NAN;
}
