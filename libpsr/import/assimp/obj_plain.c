#define _GNU_SOURCE
#include <string.h>
#include "import/ply/polygon.h"
#include "obj.h"

#define MOST_CORNERS 64

struct reader {
	struct import_mesh *im;
	const uint8_t *at, *end;
	uint32_t n; /* vertices so far */
	locale_t locale;
};

static int is_blank(uint8_t c)
{
	return c == ' ' || c == '\t';
}

/* Whether a keyword of one letter begins the line. */
static int has_keyword(const uint8_t *line, const uint8_t *end)
{
	return end - line >= 2 && is_blank(line[1]);
}

static int is_idle(uint8_t c)
{
	return c == '#' || c == '\n' || c == '\r';
}

static int is_name(uint8_t c)
{
	return c == 'o' || c == 'g';
}

/* A line end of its own, as on old Macs. */
static int has_lone_return(const uint8_t *at, const uint8_t *end)
{
	while ((at = memchr(at, '\r', (size_t)(end - at))) != NULL)
		if (++at == end || *at != '\n')
			return 1;
	return 0;
}

/* Looks at the beginnings of lines only. *n_vertices, *n_faces: how many there are if it is plain. */
static int looks_plain(const uint8_t *line, const uint8_t *end, uint64_t *n_vertices, uint64_t *n_faces)
{
	*n_vertices = *n_faces = 0;
	if (memchr(line, '\\', (size_t)(end - line)) != NULL || has_lone_return(line, end))
		return 0;
	while (line < end) {
		const uint8_t *next = memchr(line, '\n', (size_t)(end - line));
		const int is_key = has_keyword(line, end);

		if (*line == 'v' && is_key)
			++*n_vertices;
		else if (*line == 'f' && is_key)
			++*n_faces;
		else if (!is_idle(*line) && !(is_key && (*line == 's' || (is_name(*line) && *n_faces == 0))))
			return 0;
		line = next != NULL ? next + 1 : end;
	}
	return *n_vertices > 0 && *n_faces > 0;
}

/* Finds the next word of the line; returns its length, 0 at the line's end. */
static size_t next_word(struct reader *r, const uint8_t **word)
{
	while (r->at < r->end && is_blank(*r->at))
		r->at++;
	*word = r->at;
	while (r->at < r->end && !is_blank(*r->at) && *r->at != '\n' && *r->at != '\r')
		r->at++;
	return (size_t)(r->at - *word);
}

static int read_vertex(struct reader *r)
{
	double *p = r->im->mesh->position[r->n++];
	const uint8_t *word;

	for (int k = 0; k < 3; k++) {
		const size_t n = next_word(r, &word);

		/* Here # begins a comment; to import_number() it is a part of 1.#QNAN. */
		if (n == 0 || memchr(word, '#', n) != NULL || !import_number(&p[k], word, n, r->locale))
			return 0;
	}
	return next_word(r, &word) == 0;
}

/* Returns 0 if the word is not the number of a vertex. */
static int read_index(uint32_t *index, const struct reader *r, const uint8_t *word, size_t n)
{
	uint64_t x = 0;

	for (size_t i = 0; i < n && n < 11; i++) {
		if (word[i] < '0' || word[i] > '9')
			return 0;
		x = 10 * x + (uint64_t)(word[i] - '0');
	}
	*index = (uint32_t)(x - 1);
	return x >= 1 && x <= r->n;
}

static int read_face(struct reader *r, struct psr_error *err)
{
	struct psr_mesh *mesh = r->im->mesh;
	uint32_t corner[MOST_CORNERS], triangle = mesh->n_triangles;
	double point[MOST_CORNERS][3];
	unsigned cut[MOST_CORNERS][3], n = 0;
	const uint8_t *word;
	size_t length;
	int rc;

	while ((length = next_word(r, &word)) > 0) {
		if (n == MOST_CORNERS || !read_index(&corner[n], r, word, length))
			return 0;
		memcpy(point[n], mesh->position[corner[n]], sizeof point[n]);
		n++;
	}
	if (n < 3)
		return 0;
	rc = import_mesh_grow(r->im, 0, n - 2, 0, err);
	if (rc != PSR_OK)
		return rc;
	polygon_cut(cut, (const double(*)[3])point, n);
	for (unsigned i = 0; i + 2 < n; i++, triangle++)
		for (int c = 0; c < 3; c++)
			mesh->triangle[triangle][c] = corner[cut[i][c]];
	return 1;
}

static int read_lines(struct reader *r, struct psr_error *err)
{
	int rc = 1;

	while (r->at < r->end && rc == 1) {
		const uint8_t *next;
		const uint8_t key = *r->at;

		if (key == 'v' || key == 'f') {
			r->at++;
			rc = key == 'v' ? read_vertex(r) : read_face(r, err);
		}
		next = memchr(r->at, '\n', (size_t)(r->end - r->at));
		r->at = next != NULL ? next + 1 : r->end;
	}
	return rc;
}

int obj_read_plain(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct reader r = { .im = im, .at = bytes, .end = bytes + n_bytes };
	uint64_t n_vertices, n_faces;
	int rc;

	if (!looks_plain(bytes, r.end, &n_vertices, &n_faces))
		return 0;
	rc = import_mesh_grow(im, n_vertices, 0, 0, err);
	r.locale = rc == PSR_OK ? newlocale(LC_ALL_MASK, "C", (locale_t)0) : (locale_t)0;
	if (rc == PSR_OK && r.locale == (locale_t)0)
		rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory", im->path);
	if (rc == PSR_OK)
		rc = read_lines(&r, err);
	if (r.locale != (locale_t)0)
		freelocale(r.locale);
	if (rc != 1)
		im->mesh->n_vertices = im->mesh->n_triangles = 0;
	return rc;
}
