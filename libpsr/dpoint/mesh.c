#include "mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "cut.h"

#define MOST_GRAINS (1u << 27)
#define SKEW 0.004f    /* two triangles are a rectangle, but for this part */
#define LINEAR 0.9995f /* cosine: of 1.8 degrees */

/* A strip beside an open edge, in the triangle's plane, as wide as a cell. */
static int put_strip(const struct cutting *c, int side)
{
	const struct corner *a = c->corner[side], *b = c->corner[(side + 1) % 3], *other = c->corner[(side + 2) % 3];
	const uint32_t n = cut_parts(c, side);
	double along[3], in[3], out[3], width = c->options->cell;

	v3d_sub(along, b->at, a->at);
	v3d_sub(in, other->at, a->at);
	v3d_add_scaled(out, in, -v3d_dot(in, along) / v3d_dot(along, along), along);
	if (!(v3d_dot(along, along) > 0) || v3d_normalize(out, out) == 0)
		return PSR_OK;
	for (uint32_t i = 0; i < n; i++) {
		struct dpoint_cell *cell = dpoint_surface_cell(c->surface);

		if (cell == NULL)
			return PSR_ERR_MEMORY;
		for (int p = 0; p < 4; p++) {
			const double part = (double)(i + (p == 1 || p == 2)) / n, away = p < 2 ? 0 : -width;

			for (int k = 0; k < 3; k++)
				cell->corner[p][k] = (float)(a->at[k] + part * along[k] + away * out[k]);
		}
		for (int k = 0; k < 3; k++)
			cell->normal[k] = (float)a->normal[k];
		cell->part = DPOINT_BEYOND;
		cell->attr = 0;
	}
	return PSR_OK;
}

static void look_at(struct cutting *c, const struct corners *corners, const struct psr_mesh *mesh, uint32_t t)
{
	for (int i = 0; i < 3; i++)
		c->corner[i] = &corners->corner[corners->of[3 * (size_t)t + (size_t)i]];
	c->triangle = t;
	c->material = mesh->triangle_material[t];
}

static int is_bounded(const struct dpoint_mesh_options *options)
{
	return options->cover != NULL && options->cover->error > 0;
}

static int refuse_pieces(const struct dpoint_mesh_options *options, struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_LIMIT, "the surface would be covered in more than %u pieces of %g, or smaller ones where"
	                " its colours change%s; use a lower resolution%s, or blocks", CUT_MOST_PIECES, options->cell,
	                is_bounded(options) ? ", or the error asks for it" : "",
	                is_bounded(options) ? ", a greater error" : "");
}

/* dpoint_sample_trimmed() has the pieces of a patch, and its facets. */
static int is_of_patch(const struct psr_mesh *mesh, uint32_t t)
{
	return mesh->triangle_patch != NULL && mesh->triangle_patch[t] != UINT32_MAX;
}

/* Whether any triangle is of no patch. */
static int has_own(const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		if (!is_of_patch(mesh, t))
			return 1;
	return 0;
}

/* Before anything is cut: what is too much is told at once. */
static int check(const struct corners *corners, const struct psr_mesh *mesh, const struct dpoint_mesh_options *options,
                 struct psr_error *err)
{
	struct cutting c = { .options = options };
	uint64_t n_pieces = 0, n_grains = 0;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		if (is_of_patch(mesh, t))
			continue;
		look_at(&c, corners, mesh, t);
		if (cut_plan(&c, 0) > CUT_MOST_PARTS)
			return psr_fail(err, PSR_ERR_LIMIT, "triangle %u has a side of more than %d pieces of %g; use a lower resolution,"
			                " or blocks", t, CUT_MOST_PARTS, options->cell);
		n_pieces += (uint64_t)c.n * (c.n / c.ratio + 1) / 2;
		if (c.grains > 1)
			n_grains += (uint64_t)c.n * c.grains * (c.n / c.ratio) * c.grains / 2;
	}
	if (n_pieces > CUT_MOST_PIECES)
		return refuse_pieces(options, err);
	if (n_grains > MOST_GRAINS)
		return psr_fail(err, PSR_ERR_LIMIT, "textures would be looked at in %llu places, of which %u at most are; use a lower"
		                " resolution, or blocks", (unsigned long long)n_grains, MOST_GRAINS);
	return PSR_OK;
}

/* Of a triangle with holes, which its material's alpha cuts, the pieces that are there. */
static int put_pieces_as_facets(struct dpoint_surface *surface, struct dpoint_surface *pieces, const struct cutting *c)
{
	struct cutting all = *c;
	int rc;

	all.surface = pieces;
	all.view = NULL;
	cut_plan(&all, 0);
	all.least_turned = UINT32_MAX;
	pieces->n_cells = pieces->n_candidates = 0;
	rc = cut(&all);
	for (size_t i = 0; i < pieces->n_cells && rc == PSR_OK; i++) {
		const float (*corner)[3] = (const float (*)[3])pieces->cell[i].corner;

		if (pieces->cell[i].part == DPOINT_BEYOND)
			continue;
		rc = facets_add(&surface->facets, corner[0], corner[1], corner[2]);
		if (rc == PSR_OK && memcmp(corner[2], corner[3], sizeof corner[2]) != 0)
			rc = facets_add(&surface->facets, corner[0], corner[2], corner[3]);
	}
	return rc;
}

static void floats_of(float corner[3][3], const struct cutting *c)
{
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			corner[i][k] = (float)c->corner[i]->at[k];
}

static int put_facet(struct dpoint_surface *surface, const struct cutting *c)
{
	float corner[3][3];

	floats_of(corner, c);
	return facets_add(&surface->facets, corner[0], corner[1], corner[2]);
}

static int put_facets(struct cutting *c, const struct corners *corners, const struct psr_mesh *mesh)
{
	struct dpoint_surface pieces;
	int rc = PSR_OK;

	dpoint_surface_init(&pieces);
	for (uint32_t t = 0; t < mesh->n_triangles && rc == PSR_OK; t++) {
		if (is_of_patch(mesh, t))
			continue;
		look_at(c, corners, mesh, t);
		if (c->options->look != NULL && mesh->material[c->material].alpha != PSR_ALPHA_OPAQUE)
			rc = put_pieces_as_facets(c->surface, &pieces, c);
		else
			rc = put_facet(c->surface, c);
	}
	dpoint_surface_fini(&pieces);
	return rc == PSR_OK ? facets_sort(&c->surface->facets) : rc;
}

/* How much higher one corner is than another, along a normal. */
static double slit_of(const struct cutting *c, const double normal[3])
{
	double low = INFINITY, high = -INFINITY;

	for (int i = 0; i < 3; i++) {
		const double height = v3d_dot(c->corner[i]->at, normal);

		low = fmin(low, height);
		high = fmax(high, height);
	}
	return high - low;
}

/* Adds the triangle to the faces if its normals lean from it; first: its first cell. */
static int put_face(const struct cutting *c, const struct corners *corners, const struct psr_mesh *mesh,
                    size_t first)
{
	const float slit = c->options->cover != NULL ? c->options->cover->slit : 0;
	struct dpoint_face *face;
	double most = 0;

	for (int i = 0; i < 3; i++)
		most = fmax(most, slit_of(c, c->corner[i]->normal));
	if (slit == 0 || !(most > (double)slit) || c->surface->n_cells == first)
		return PSR_OK;
	if (!ARRAY_ROOM(c->surface->face, c->surface->n_faces, c->surface->faces_room))
		return PSR_ERR_MEMORY;
	face = &c->surface->face[c->surface->n_faces++];
	*face = (struct dpoint_face){ .part = c->material, .first_cell = (uint32_t)first,
		                          .n_cells = (uint32_t)(c->surface->n_cells - first), .twin = UINT32_MAX };
	floats_of(face->corner, c);
	for (int i = 0; i < 3; i++) {
		for (int k = 0; k < 3; k++)
			face->normal[i][k] = (float)c->corner[i]->normal[k];
		face->bend[i] = corners_bend(corners, mesh, c->triangle, i);
	}
	return PSR_OK;
}

/* Whether the face and the next one beyond a side are a rectangle, in which normals between corners are linear. */
static int is_rectangle(const struct dpoint_face *face, int side, const float next[3], const float next_normal[3])
{
	const int a = side, b = (side + 1) % 3, c = (side + 2) % 3;
	float x[3], y[3], d[3], normal[3];

	v3f_sub(x, face->corner[a], face->corner[c]);
	v3f_sub(y, face->corner[b], face->corner[c]);
	v3f_add(d, face->corner[c], x);
	v3f_add(d, d, y);
	v3f_sub(d, d, next);
	v3f_add(normal, face->normal[a], face->normal[b]);
	v3f_sub(normal, normal, face->normal[c]);
	v3f_normalize(normal, normal);
	return fabsf(v3f_dot(x, y)) <= SKEW * v3f_length(x) * v3f_length(y) &&
	       v3f_length(d) <= SKEW * fminf(v3f_length(x), v3f_length(y)) && v3f_dot(normal, next_normal) >= LINEAR;
}

/* face_of: by triangle. */
static void find_twin(struct dpoint_surface *surface, uint32_t triangle, const uint32_t *face_of,
                      const struct corners *corners)
{
	struct dpoint_face *face = &surface->face[face_of[triangle]];

	for (int i = 0; i < 3 && face->twin == UINT32_MAX; i++) {
		const uint32_t next = corners->next[3 * (size_t)triangle + (size_t)i];
		const uint32_t f = next != UINT32_MAX ? face_of[next / 3] : UINT32_MAX;
		struct dpoint_face *other = f != UINT32_MAX ? &surface->face[f] : NULL;
		const int beyond = (int)(next % 3 + 2) % 3;

		if (other == NULL || other->twin != UINT32_MAX || other->part != face->part ||
		    face->bend[i] > SKEW || !is_rectangle(face, i, other->corner[beyond], other->normal[beyond]))
			continue;
		face->twin = f;
		face->shared = i;
		other->twin = face_of[triangle];
		other->shared = (int)(next % 3);
	}
}

static int put_cells(struct cutting *c, const struct corners *corners, const struct psr_mesh *mesh,
                     struct psr_error *err)
{
	uint32_t *face_of = malloc((mesh->n_triangles + (size_t)1) * sizeof *face_of);
	int rc = face_of != NULL ? PSR_OK : PSR_ERR_MEMORY;

	for (uint32_t t = 0; t < mesh->n_triangles && rc == PSR_OK; t++) {
		const size_t n_faces = c->surface->n_faces;
		size_t first;

		face_of[t] = UINT32_MAX;

		if (is_of_patch(mesh, t))
			continue;
		look_at(c, corners, mesh, t);
		first = c->surface->n_cells;
		cut_plan(c, corners->is_open[t]);
		rc = cut(c);
		if (rc == PSR_OK)
			rc = put_face(c, corners, mesh, first);
		if (c->surface->n_faces > n_faces)
			face_of[t] = (uint32_t)n_faces;
		for (int i = 0; i < 3 && rc == PSR_OK; i++)
			if (corners->is_open[t] >> i & 1)
				rc = put_strip(c, i);
		if (rc == PSR_ERR_LIMIT || (rc == PSR_OK && c->surface->n_cells > CUT_MOST_PIECES))
			rc = refuse_pieces(c->options, err);
	}
	for (uint32_t t = 0; t < mesh->n_triangles && rc == PSR_OK; t++)
		if (face_of[t] != UINT32_MAX)
			find_twin(c->surface, t, face_of, corners);
	free(face_of);
	return rc;
}

int dpoint_sample_mesh(struct dpoint_surface *surface, const struct psr_mesh *mesh,
                       const struct dpoint_mesh_options *options, struct psr_error *err)
{
	struct bound_view view = { .seen = NULL };
	struct cutting c = { .surface = surface, .options = options, .view = is_bounded(options) ? &view : NULL };
	struct corners corners;
	int rc;

	if (!has_own(mesh))
		return PSR_OK;
	rc = corners_init(&corners, mesh, options);
	if (rc == PSR_OK)
		rc = check(&corners, mesh, options, err);
	if (rc == PSR_OK)
		rc = put_facets(&c, &corners, mesh);
	if (rc == PSR_OK)
		rc = put_cells(&c, &corners, mesh, err);
	if (view.is_failed)
		rc = PSR_ERR_MEMORY;
	bound_view_fini(&view);
	surface->n_bad += corners.n_bad;
	corners_fini(&corners);
	return rc == PSR_ERR_MEMORY ? psr_fail(err, rc, "no memory for the pieces of the mesh") : rc;
}
