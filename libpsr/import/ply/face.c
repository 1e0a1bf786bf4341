#include <stdlib.h>
#include <string.h>
#include "ply.h"
#include "polygon.h"

/* The mesh under construction, and scratch memory for the largest face. */
struct target {
	struct import_mesh *im;
	struct ply_rows *rows;
	const struct ply_vertices *vertices;
	uint32_t material, first;   /* first: of the shared vertices */
	int is_shared, has_colors;  /* is_shared: no colors or coordinates by face, which need vertices of their own */
	unsigned has;               /* IMPORT_HAS_* */
	struct ply_colors colors;
	float color[4];             /* of this face */
	uint32_t *corner;           /* of this face */
	unsigned (*cut)[3];
	uint64_t capacity;
};

static void put_vertex(const struct target *t, uint32_t to, uint32_t from, const double *uv)
{
	struct psr_mesh *mesh = t->im->mesh;
	const struct ply_vertices *v = t->vertices;

	memcpy(mesh->position[to], v->position[from], sizeof v->position[from]);
	if (v->normal != NULL)
		memcpy(mesh->normal[to], v->normal[from], sizeof v->normal[from]);
	if (uv != NULL) {
		mesh->uv[0][to][0] = (float)uv[0];
		mesh->uv[0][to][1] = 1.0f - (float)uv[1];
	} else if (v->uv != NULL) {
		memcpy(mesh->uv[0][to], v->uv[from], sizeof v->uv[from]);
	}
	if (t->has_colors)
		memcpy(mesh->color[to], t->color, sizeof t->color);
	else if (v->color != NULL)
		memcpy(mesh->color[to], v->color[from], sizeof v->color[from]);
}

static int reserve(struct target *t, uint64_t n, struct psr_error *err)
{
	if (n <= t->capacity)
		return PSR_OK;
	if (!import_resize(&t->corner, n, sizeof *t->corner) || !import_resize(&t->cut, n, sizeof *t->cut))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a face of %llu corners", t->im->path,
		                (unsigned long long)n);
	t->capacity = n;
	return PSR_OK;
}

static int read_index(uint32_t *index, const struct target *t, double x, struct psr_error *err)
{
	if (!(x >= 0.0) || !(x < t->vertices->n))
		return ply_rows_fail(t->rows, err, "refers to vertex %.0f, but there are only %u", x, t->vertices->n);
	*index = (uint32_t)x;
	if ((double)*index != x)
		return ply_rows_fail(t->rows, err, "refers to vertex %g", x);
	return PSR_OK;
}

/* Adds the triangle of three corners of t->corner; uv: two values a corner, or NULL. */
static void put_triangle(const struct target *t, uint32_t to, uint32_t first_vertex, const unsigned cut[3],
                         const double *uv)
{
	struct psr_mesh *mesh = t->im->mesh;

	for (unsigned c = 0; c < 3; c++) {
		uint32_t from = t->corner[cut[c]];

		mesh->triangle[to][c] = t->is_shared ? t->first + from : first_vertex + c;
		if (!t->is_shared)
			put_vertex(t, first_vertex + c, from, uv != NULL ? uv + 2 * (size_t)cut[c] : NULL);
	}
	mesh->triangle_material[to] = t->material;
}

/* Adds the polygon of t->corner. */
static int put_polygon(struct target *t, uint32_t n, const double *uv, struct psr_error *err)
{
	const uint32_t first_triangle = t->im->mesh->n_triangles, first_vertex = t->im->mesh->n_vertices;
	double point[POLYGON_MAX_CLIP][3];
	int rc;

	rc = import_mesh_grow(t->im, t->is_shared ? 0 : 3 * ((uint64_t)n - 2), (uint64_t)n - 2, t->has, err);
	if (rc != PSR_OK)
		return rc;
	for (uint32_t i = 0; n > 3 && i < n && i < POLYGON_MAX_CLIP; i++)
		memcpy(point[i], t->vertices->position[t->corner[i]], sizeof point[i]);
	polygon_cut(t->cut, (const double(*)[3])point, n);
	for (uint32_t i = 0; i + 2 < n; i++)
		put_triangle(t, first_triangle + i, first_vertex + 3 * i, t->cut[i], uv);
	return PSR_OK;
}

static int target_init(struct target *t, struct import_mesh *im, struct ply_rows *rows,
                       const struct ply_vertices *vertices, uint32_t material, struct psr_error *err)
{
	const struct ply_list *uv = &rows->list[PLY_LIST_UV];
	int rc = PSR_OK;

	memset(t, 0, sizeof *t);
	t->im = im;
	t->rows = rows;
	t->vertices = vertices;
	t->material = material;
	/* Vertices' colors are finer than faces', unless all vertices have one color, a writer's default. */
	t->has_colors = (vertices->color == NULL || ply_vertices_are_one_color(vertices)) &&
	                ply_colors_find(&t->colors, rows->header, rows->element);
	t->is_shared = !t->has_colors && uv->property < 0;
	t->has = (vertices->uv != NULL || uv->property >= 0 ? IMPORT_HAS_UV0 : 0u) |
	         (vertices->color != NULL || t->has_colors ? IMPORT_HAS_COLOR : 0u);
	t->first = im->mesh->n_vertices;
	if (t->is_shared)
		rc = import_mesh_grow(im, vertices->n, 0, t->has, err);
	for (uint32_t i = 0; rc == PSR_OK && t->is_shared && i < vertices->n; i++)
		put_vertex(t, t->first + i, i, NULL);
	return rc;
}

static void target_fini(struct target *t)
{
	free(t->corner);
	free(t->cut);
}

static int find_list(struct ply_rows *rows, int which, const char *const *names, struct psr_error *err)
{
	const int at = ply_find_property(rows->header, rows->element, names);

	if (at >= 0 && rows->header->property[rows->element->first_property + (unsigned)at].count_type != PLY_NO_TYPE)
		rows->list[which].property = at;
	else if (which == PLY_LIST_INDEX)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: line %u: the element \"%.*s\" has no list of vertex_indices",
		                rows->path, rows->element->line, (int)rows->element->name.n, rows->element->name.at);
	return PSR_OK;
}

static int read_face(struct target *t, struct psr_error *err)
{
	const struct ply_list *index = &t->rows->list[PLY_LIST_INDEX], *uv = &t->rows->list[PLY_LIST_UV];
	int rc;

	if (index->n > IMPORT_MAX_TRIANGLES)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: a face of more than %llu corners", t->im->path,
		                (unsigned long long)IMPORT_MAX_TRIANGLES);
	rc = reserve(t, index->n, err);
	for (uint64_t i = 0; i < index->n && rc == PSR_OK; i++)
		rc = read_index(&t->corner[i], t, index->item[i], err);
	if (rc != PSR_OK)
		return rc;
	if (index->n < 3) {
		t->im->mesh->n_dropped_primitives++;
		return PSR_OK;
	}
	if (t->has_colors)
		ply_colors_get(t->color, &t->colors, t->rows);
	return put_polygon(t, (uint32_t)index->n, uv->property >= 0 && uv->n == 2 * index->n ? uv->item : NULL, err);
}

static const char *const index_names[] = { "vertex_indices", "vertex_index", NULL };

int ply_faces_read(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                   uint32_t material, struct psr_error *err)
{
	static const char *const uv_names[] = { "texcoord", NULL };
	const uint32_t dropped = im->mesh->n_dropped_primitives;
	struct target t;
	int rc = find_list(rows, PLY_LIST_INDEX, index_names, err);

	if (rc == PSR_OK)
		rc = find_list(rows, PLY_LIST_UV, uv_names, err);
	if (rc != PSR_OK)
		return rc;
	rc = target_init(&t, im, rows, vertices, material, err);
	while (rc == PSR_OK && rows->at < rows->element->n_rows) {
		rc = ply_rows_next(rows, err);
		if (rc == PSR_OK)
			rc = read_face(&t, err);
	}
	target_fini(&t);
	if (im->mesh->n_dropped_primitives > dropped)
		import_mesh_warn(im, "faces of fewer than three corners were left out: %u",
		                 im->mesh->n_dropped_primitives - dropped);
	return rc;
}

/* Each vertex makes a triangle with the two vertices before it, every second one reversed; -1 begins a new strip.
 * Triangles with two equal vertices only turn a corner of the strip. */
static int read_strip(struct target *t, struct psr_error *err)
{
	static const unsigned even[3] = { 0, 1, 2 }, odd[3] = { 1, 0, 2 };
	const struct ply_list *index = &t->rows->list[PLY_LIST_INDEX];
	uint64_t length = 0;
	int rc;

	for (uint64_t i = 0; i < index->n; i++) {
		struct psr_mesh *mesh = t->im->mesh;
		uint32_t *v = t->corner;

		if (index->item[i] == -1.0) {
			length = 0;
			continue;
		}
		v[0] = v[1];
		v[1] = v[2];
		rc = read_index(&v[2], t, index->item[i], err);
		if (rc != PSR_OK)
			return rc;
		if (++length < 3 || v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
			continue;
		rc = import_mesh_grow(t->im, t->is_shared ? 0 : 3, 1, t->has, err);
		if (rc != PSR_OK)
			return rc;
		put_triangle(t, mesh->n_triangles - 1, mesh->n_vertices - 3, length % 2 == 1 ? even : odd, NULL);
	}
	return PSR_OK;
}

int ply_strips_read(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                    uint32_t material, struct psr_error *err)
{
	struct target t;
	int rc = find_list(rows, PLY_LIST_INDEX, index_names, err);

	if (rc != PSR_OK)
		return rc;
	rc = target_init(&t, im, rows, vertices, material, err);
	if (rc == PSR_OK)
		rc = reserve(&t, 3, err);
	if (rc == PSR_OK)
		memset(t.corner, 0, 3 * sizeof *t.corner);
	while (rc == PSR_OK && rows->at < rows->element->n_rows) {
		rc = ply_rows_next(rows, err);
		if (rc == PSR_OK && t.has_colors)
			ply_colors_get(t.color, &t.colors, rows);
		if (rc == PSR_OK)
			rc = read_strip(&t, err);
	}
	target_fini(&t);
	return rc;
}
