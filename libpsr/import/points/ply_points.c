#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "feed.h"
#include "ply_points.h"
#include "spread.h"
#include "base/srgb.h"
#include "import/ply/ply.h"

#define MOST_ROW ((size_t)1 << 28) /* bytes of a row */

struct ply_points {
	struct feed feed;
	uint8_t *head;            /* the file's first bytes: names point there */
	struct ply_header header;
	const struct ply_element *vertex;
	struct ply_rows rows;     /* over the feed's window */
	int position[3], normal[3];
	struct ply_colors colors;
	int has_color, has_normal;
	uint64_t first, row, step; /* first: the first vertex's byte; row: bytes of one; step: spread.h */
};

static int is_whole(const struct ply_points *p)
{
	return p->feed.at + p->feed.n == p->feed.n_bytes;
}

/* Moves the window on to the cursor. */
static int slide(struct ply_points *p, size_t need, struct psr_error *err)
{
	struct ply_cursor *c = &p->rows.cursor;
	int rc;

	p->feed.next = (size_t)(c->at - c->start);
	if (p->header.format == PLY_ASCII)
		c->lines_before += ply_count_lines(c);
	c->bytes_before += p->feed.next;
	rc = feed_need(&p->feed, need, err);
	c->start = p->feed.bytes;
	c->at = p->feed.bytes + p->feed.next;
	c->end = p->feed.bytes + p->feed.n;
	return rc;
}

/* Reads a row: again, with more of the file in the window, where it went on behind its end. */
static int next_row(struct ply_points *p, struct psr_error *err)
{
	struct ply_cursor *c = &p->rows.cursor;
	const uint64_t row = p->rows.at;

	/* Rows of a run are of one size, and the cursor may stand behind the last one. */
	for (size_t need = p->step > 1 ? (size_t)p->row + 1 : FEED_LINE;; need *= 2) {
		struct psr_error own;
		size_t at;
		int rc = PSR_OK;

		if ((size_t)(c->end - c->at) < need && !is_whole(p))
			rc = slide(p, need, err);
		if (rc != PSR_OK)
			return rc;
		at = (size_t)(c->at - c->start);
		rc = ply_rows_next(&p->rows, is_whole(p) ? err : &own);
		if (is_whole(p) || (rc == PSR_OK && c->at < c->end))
			return rc;
		c->at = c->start + at;
		p->rows.at = row;
		if (need > MOST_ROW)
			return ply_rows_fail(&p->rows, err, "takes more than %zu MB", MOST_ROW >> 20);
	}
}

/* Goes to the first vertex. */
static int go_to_first(struct ply_points *p, struct psr_error *err)
{
	struct ply_cursor *c = &p->rows.cursor;
	int rc = PSR_OK;

	feed_seek(&p->feed, p->header.body);
	c->start = c->at = c->end = p->feed.bytes;
	c->bytes_before = p->header.body;
	c->lines_before = p->header.n_lines;
	for (const struct ply_element *e = p->header.element; e < p->vertex && rc == PSR_OK; e++) {
		ply_rows_begin(&p->rows, e);
		while (e->n_properties > 0 && p->rows.at < e->n_rows && rc == PSR_OK)
			rc = next_row(p, err);
	}
	ply_rows_begin(&p->rows, p->vertex);
	p->first = c->bytes_before + (uint64_t)(c->at - c->start);
	return rc;
}

static int find_roles(struct ply_points *p, struct psr_error *err)
{
	static const char *const position[3][2] = { { "x", NULL }, { "y", NULL }, { "z", NULL } };
	static const char *const normal[3][3] = {
		{ "nx", "normal_x", NULL }, { "ny", "normal_y", NULL }, { "nz", "normal_z", NULL }
	};

	p->vertex = ply_find_element(&p->header, "vertex");
	if (p->vertex == NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the PLY header has no element vertex", p->feed.path);
	if (p->vertex->n_rows == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: there are no points", p->feed.path);
	p->has_normal = 1;
	for (int c = 0; c < 3; c++) {
		const struct ply_property *property = &p->header.property[p->vertex->first_property];

		p->position[c] = ply_find_property(&p->header, p->vertex, position[c]);
		p->normal[c] = ply_find_property(&p->header, p->vertex, normal[c]);
		if (p->position[c] < 0 || property[p->position[c]].count_type != PLY_NO_TYPE)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: line %u: the element vertex has no property %s", p->feed.path,
			                p->vertex->line, position[c][0]);
		p->has_normal &= p->normal[c] >= 0 && property[p->normal[c]].count_type == PLY_NO_TYPE;
	}
	p->has_color = ply_colors_find(&p->colors, &p->header, p->vertex);
	return PSR_OK;
}

static int read_header(struct ply_points *p, struct psr_error *err)
{
	int rc = feed_need(&p->feed, FEED_WINDOW, err);

	if (rc != PSR_OK)
		return rc;
	p->head = malloc(p->feed.n);
	if (p->head == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the header", p->feed.path);
	memcpy(p->head, p->feed.bytes, p->feed.n);
	rc = ply_header_read(&p->header, p->feed.path, p->head, p->feed.n, p->feed.n_bytes, err);
	if (rc == PSR_OK)
		rc = ply_rows_init(&p->rows, p->feed.path, &p->header, p->head, p->feed.n, err);
	return rc == PSR_OK ? find_roles(p, err) : rc;
}

static void put_point(struct octree_point *to, const struct ply_points *p)
{
	const double *scalar = p->rows.scalar;

	*to = (struct octree_point){ .color = { 0 } };
	for (int c = 0; c < 3; c++) {
		to->at[c] = scalar[p->position[c]];
		if (p->has_normal)
			to->normal[c] = (float)scalar[p->normal[c]];
		if (p->has_color) {
			const double x = scalar[p->colors.property[c]], code = x * p->colors.scale[c];

			to->color[c] = p->colors.scale[c] == 0.0 ? psr_linear_to_srgb((float)x)
			                                         : (uint8_t)(code > 0.0 ? fmin(code + 0.5, 255.0) : 0.0);
		}
	}
}

static int go_back(void *userdata, struct psr_error *err)
{
	return go_to_first(userdata, err);
}

static void skip_runs(struct ply_points *p)
{
	struct ply_cursor *c = &p->rows.cursor;

	p->rows.at = spread_next(p->step, p->rows.at);
	if (p->rows.at >= p->vertex->n_rows)
		return;
	feed_seek(&p->feed, p->first + p->rows.at * p->row);
	c->start = c->at = c->end = p->feed.bytes;
	c->bytes_before = p->feed.at;
}

/* Rows of one size can be skipped; a run has a window of its own. */
static void set_part(struct ply_points *p, uint64_t part)
{
	p->step = p->header.format == PLY_ASCII ? 1 : spread_step(p->vertex->n_rows, part);
	for (unsigned i = 0; i < p->vertex->n_properties; i++) {
		const struct ply_property *property = &p->header.property[p->vertex->first_property + i];

		p->row += ply_type_size(property->type);
		if (property->count_type != PLY_NO_TYPE)
			p->step = 1;
	}
	if (p->step > 1 && SPREAD_RUN * p->row < FEED_WINDOW)
		p->feed.room = SPREAD_RUN * p->row > FEED_LINE ? (size_t)(SPREAD_RUN * p->row) : FEED_LINE;
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct ply_points *p = userdata;
	int rc = PSR_OK;

	for (*n = 0; *n < room && p->rows.at < p->vertex->n_rows && rc == PSR_OK;) {
		rc = next_row(p, err);
		if (rc == PSR_OK)
			put_point(&points[(*n)++], p);
		if (p->step > 1 && p->rows.at % SPREAD_RUN == 0)
			skip_runs(p);
	}
	return rc;
}

int ply_points_open(struct octree_source *out, const char *path, uint64_t part, struct psr_error *err)
{
	struct ply_points *p = calloc(1, sizeof *p);
	int rc;

	if (p == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read it", path);
	*out = (struct octree_source){ .name = path, .rewind = go_back, .read = read_points, .userdata = p };
	rc = feed_open(&p->feed, path, err);
	if (rc == PSR_OK)
		rc = read_header(p, err);
	if (rc == PSR_OK)
		rc = go_to_first(p, err);
	if (rc != PSR_OK) {
		ply_points_close(out);
		return rc;
	}
	out->has_color = p->has_color;
	out->has_normal = p->has_normal;
	set_part(p, part);
	out->n_points = (p->vertex->n_rows + p->step - 1) / p->step;
	return PSR_OK;
}

int ply_points_have_faces(const struct octree_source *source)
{
	const struct ply_points *p = source->userdata;
	const struct ply_element *faces = ply_find_element(&p->header, "face");
	const struct ply_element *strips = ply_find_element(&p->header, "tristrips");

	return (faces != NULL && faces->n_rows > 0) || (strips != NULL && strips->n_rows > 0);
}

void ply_points_close(struct octree_source *source)
{
	struct ply_points *p = source->userdata;

	if (p == NULL)
		return;
	feed_close(&p->feed);
	ply_rows_fini(&p->rows);
	free(p->head);
	free(p);
	source->userdata = NULL;
}
