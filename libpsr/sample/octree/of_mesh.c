#include <math.h>
#include <stdlib.h>
#include "of_mesh.h"
#include "facet.h"
#include "lean.h"
#include "octree/build/voxels.h"
#include "surface/material.h"
#include "surface/surface.h"
#include "surface/texture.h"
#include "base/array.h"
#include "base/direction.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "model/blocks.h"

#define SIDES 100 /* a tree is one-sided if one leaf of so many holds two sides, at most: gaps of one are filled */
#define DIAGONAL 1.4142135623730951 /* of a face of a leaf: the diameter of filters, as for samples of a lattice */
#define ROUNDING 1e-6               /* of normals: no line goes between two triangles */
#define REACH (0.8660254037844386 + ROUNDING) /* of offsets: half of a leaf's own diagonal */
#define FACES 3 /* that meet in a leaf: a corner */

struct leaf_maker {
	const struct psr_mesh *mesh;
	const struct octree_build_options *options;
	struct psr_error *err;
	struct octree_surface surface;
	struct surface look;
	uint8_t *is_turned;
	int levels;
	double side, scale;        /* leaves: along the cube, and a unit of the mesh */
	struct octree_maker maker;
	uint64_t room;
	struct facet *facet;       /* of the leaf that is made */
	size_t n_facets, facets_room;
	struct lean lean;
	struct octree_mesh_report report;
};

/* ---- facets ---- */

static void find_place(struct surface_place *place, const struct facet *facet, const double at[3])
{
	double e1[3], e2[3], d[3], n[3], a[3], b[3], nn;

	v3d_sub(e1, facet->corner[1], facet->corner[0]);
	v3d_sub(e2, facet->corner[2], facet->corner[0]);
	v3d_sub(d, at, facet->corner[0]);
	v3d_cross(n, e1, e2);
	nn = v3d_dot(n, n);
	v3d_cross(a, d, e2);
	v3d_cross(b, e1, d);
	place->u = nn > 0.0 ? fmin(fmax(v3d_dot(a, n) / nn, 0.0), 1.0) : 0.0;
	place->v = nn > 0.0 ? fmin(fmax(v3d_dot(b, n) / nn, 0.0), 1.0 - place->u) : 0.0;
}

/* Adds up what is opaque of the facet, by triangles of its fan. */
static void add_up(const struct leaf_maker *m, struct facet *facet, const struct clip *clip)
{
	const int may_miss = m->mesh->material[m->mesh->triangle_material[facet->triangle]].alpha != PSR_ALPHA_OPAQUE;
	struct surface_place place = { .prim = facet->triangle };

	facet->area = 0.0;
	v3d_set(facet->middle, 0.0, 0.0, 0.0);
	for (int i = 0; i + 2 < clip->n; i++) {
		double centroid[3];
		const double area = clip_fan(clip, i, centroid);

		if (may_miss) {
			find_place(&place, facet, centroid);
			if (texture_is_absent(m->mesh, facet->triangle, place.u, place.v))
				continue;
		}
		facet->area += area;
		v3d_add_scaled(facet->middle, facet->middle, area, centroid);
	}
	if (facet->area > 0.0)
		v3d_scale(facet->middle, facet->middle, 1.0 / facet->area);
}

static void look_at(const struct leaf_maker *m, struct facet *facet)
{
	struct surface_place place = { .prim = facet->triangle };
	uint64_t word;

	find_place(&place, facet, facet->middle);
	word = surface_look(&m->look, &place, DIAGONAL, facet->normal);
	material_decode(&facet->look, word);
	for (int c = 0; c < 3; c++)
		facet->normal[c] = m->is_turned[facet->triangle] ? -facet->normal[c] : facet->normal[c];
}

/* Returns 0 without memory. */
static int find_facets(struct leaf_maker *m, const uint32_t at[3], const uint32_t *triangle, size_t n)
{
	unsigned is_last = 0;

	for (int c = 0; c < 3; c++)
		is_last |= (unsigned)(at[c] == ((uint32_t)1 << m->levels) - 1) << c;
	m->n_facets = 0;
	for (size_t i = 0; i < n; i++) {
		struct facet *facet;
		struct clip clip;

		if (!ARRAY_ROOM(m->facet, m->n_facets, m->facets_room))
			return 0;
		facet = &m->facet[m->n_facets];
		facet->triangle = triangle[i];
		for (int k = 0; k < 3; k++)
			for (int c = 0; c < 3; c++)
				facet->corner[k][c] =
					octree_surface_place(&m->surface, m->mesh->triangle[triangle[i]][k], c, m->side, m->scale) - at[c];
		clip_triangle(&clip, (const double(*)[3])facet->corner);
		if (clip.n == 0 || clip_is_next_ones(&clip, is_last))
			continue;
		add_up(m, facet, &clip);
		if (!(facet->area > 0.0))
			continue;
		look_at(m, facet);
		m->n_facets++;
	}
	return 1;
}

/* ---- a leaf ---- */

/* Returns how far along the normal the line through the leaf's middle meets a triangle, in leaves; INFINITY: nowhere. */
static double meet(const struct facet *facet, const float normal[3])
{
	const double middle[3] = { 0.5, 0.5, 0.5 }, dir[3] = { normal[0], normal[1], normal[2] };
	double e1[3], e2[3], p[3], q[3], d[3], det, u, v;

	v3d_sub(e1, facet->corner[1], facet->corner[0]);
	v3d_sub(e2, facet->corner[2], facet->corner[0]);
	v3d_cross(p, dir, e2);
	det = v3d_dot(e1, p);
	if (det == 0.0)
		return INFINITY;
	v3d_sub(d, middle, facet->corner[0]);
	u = v3d_dot(d, p) / det;
	v3d_cross(q, d, e1);
	v = v3d_dot(dir, q) / det;
	return u >= -ROUNDING && v >= -ROUNDING && u + v <= 1.0 + ROUNDING ? v3d_dot(e2, q) / det : INFINITY;
}

/* Of facets, times their areas. The lobes' squared widths are added by what they mirror. */
struct look_sums {
	double area, color[3];
	double metallic, open, rest, reflected, mirrored, width2, plain_width2;
};

static void add_look(struct look_sums *sums, const struct look *look, double area)
{
	const double metallic = (double)look->metallic, rest = 1.0 - metallic, reflected = rest * (double)look->reflectance;
	const double width = (double)look->roughness * (double)look->roughness;
	double mirrored = 3.0 * reflected;

	sums->area += area;
	for (int c = 0; c < 3; c++) {
		sums->color[c] += area * (double)look->base[c];
		mirrored += metallic * (double)look->base[c];
	}
	sums->metallic += area * metallic;
	sums->open += area * (double)look->open;
	sums->rest += area * rest;
	sums->reflected += area * reflected;
	sums->mirrored += area * mirrored;
	sums->width2 += area * mirrored * width * width;
	sums->plain_width2 += area * width * width;
}

/* A place within a leaf of one look has that look's lobe, whatever the normals are around: as samples of blocks do. */
static uint32_t material_of(const struct look_sums *sums)
{
	const double width2 = sums->mirrored > 0.0 ? sums->width2 / sums->mirrored : sums->plain_width2 / sums->area;
	const struct look look = { .metallic = (float)(sums->metallic / sums->area),
		                       .open = (float)(sums->open / sums->area),
		                       .reflectance = sums->rest > 0.0 ? (float)(sums->reflected / sums->rest)
		                                                       : (float)MATERIAL_DIELECTRIC,
		                       .roughness = (float)sqrt(sqrt(width2)) };

	return (uint32_t)(material_encode(&look) >> 40);
}

/* Whether a highlight may be brighter than white: F0 / (4 a^2), a being the roughness squared. */
static int shines(const struct look_sums *sums)
{
	return sums->mirrored * sums->mirrored > 12.0 * sums->area * sums->width2;
}

static double find_offset(const struct leaf_maker *m, const float normal[3], const double middle[3])
{
	double nearest = INFINITY;

	for (size_t i = 0; i < m->n_facets; i++) {
		const double t = meet(&m->facet[i], normal);

		nearest = fabs(t) < fabs(nearest) ? t : nearest;
	}
	if (fabs(nearest) <= REACH)
		return nearest;
	nearest = 0.0;
	for (int c = 0; c < 3; c++)
		nearest += (middle[c] - 0.5) * (double)normal[c];
	return nearest;
}

/* Sets a leaf's normal, and where its point is along it. */
static void set_plane(struct leaf_maker *m, uint64_t path, uint64_t leaf)
{
	struct octree *tree = m->maker.tree;
	double area = 0.0, normal[3] = { 0 }, middle[3] = { 0 };
	const float *own;
	float mean[3];

	for (size_t i = 0; i < m->n_facets; i++) {
		const struct facet *f = &m->facet[i];

		area += f->area;
		for (int c = 0; c < 3; c++) {
			normal[c] += f->area * (double)f->normal[c];
			middle[c] += f->area * f->middle[c];
		}
	}
	for (int c = 0; c < 3; c++) {
		mean[c] = (float)(normal[c] / area);
		middle[c] /= area;
	}
	tree->normal[leaf] = psr_direction_encode(mean);
	own = psr_direction_table()[tree->normal[leaf]];
	tree->offset[leaf] = (uint8_t)octree_offset_step(find_offset(m, own, middle));
	lean_add(&m->lean, path, own, m->facet, m->n_facets);
}

/* Whether more of the leaf's surface is unlit than lit: only that counts then, as in blends (surface/blend.h). */
static int is_mostly_unlit(const struct leaf_maker *m)
{
	double area[2] = { 0.0, 0.0 };

	for (size_t i = 0; i < m->n_facets; i++)
		area[m->facet[i].look.unlit] += m->facet[i].area;
	return area[1] > area[0];
}

/* The mean normal of two faces is nearest to both of them, but a mirror with it shows what neither of them does. */
static void set_leaf(struct leaf_maker *m, uint64_t path, uint64_t leaf)
{
	struct octree *tree = m->maker.tree;
	struct look_sums sums = { 0 };
	int is_unlit;

	m->report.n_both += (uint64_t)facets_keep_side(m->facet, &m->n_facets);
	is_unlit = is_mostly_unlit(m);
	for (size_t i = 0; i < m->n_facets; i++)
		if (m->facet[i].look.unlit == is_unlit)
			add_look(&sums, &m->facet[i].look, m->facet[i].area);
	for (int c = 0; c < 3; c++)
		tree->color[leaf][c] = psr_linear_to_srgb((float)(sums.color[c] / sums.area));
	octree_put_material(tree->material[leaf], is_unlit ? OCTREE_UNLIT : material_of(&sums));
	if (!is_unlit && shines(&sums))
		for (int face = 1; face < FACES && facets_keep_face(m->facet, &m->n_facets); face++)
			;
	set_plane(m, path, leaf);
}

static int leaf_room(struct leaf_maker *m, uint64_t leaf)
{
	struct octree *tree = m->maker.tree;
	const uint64_t more = leaf + leaf / 4 + 4096;
	void *normal, *color, *offset, *material;

	if (leaf < m->room)
		return 1;
	if ((normal = realloc(tree->normal, more * sizeof *tree->normal)) != NULL)
		tree->normal = normal;
	if ((color = realloc(tree->color, more * sizeof *tree->color)) != NULL)
		tree->color = color;
	if ((offset = realloc(tree->offset, more)) != NULL)
		tree->offset = offset;
	if ((material = realloc(tree->material, more * sizeof *tree->material)) != NULL)
		tree->material = material;
	if (normal == NULL || color == NULL || offset == NULL || material == NULL)
		return 0;
	m->room = more;
	return 1;
}

static int make_leaf(uint64_t path, const uint32_t *triangle, size_t n, void *userdata)
{
	struct leaf_maker *m = userdata;
	const uint64_t leaf = m->maker.tree->n_leaves;
	uint32_t at[3];

	octree_place(path, at);
	if (!leaf_room(m, leaf) || !find_facets(m, at, triangle, n))
		return psr_fail(m->err, PSR_ERR_MEMORY, "no memory for an octree of %llu leaves", (unsigned long long)leaf);
	if (leaf % 1024 == 0) {
		if (psr_is_cancelled(m->options->cancel))
			return psr_fail(m->err, PSR_ERR_CANCELLED, "cancelled");
		if (m->options->on_progress != NULL)
			m->options->on_progress("leaves", leaf, 0, m->options->userdata);
	}
	if (m->n_facets == 0)
		return PSR_OK;
	set_leaf(m, path, leaf);
	return octree_maker_put(&m->maker, path, m->err);
}

/* ---- the whole ---- */

static void find_cube(struct octree_surface *surface, const struct psr_mesh *mesh)
{
	double high[3];

	for (int c = 0; c < 3; c++) {
		surface->low[c] = INFINITY;
		high[c] = -INFINITY;
	}
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int i = 0; i < 3; i++)
			for (int c = 0; c < 3; c++) {
				const double x = mesh->position[mesh->triangle[t][i]][c];

				surface->low[c] = fmin(surface->low[c], x);
				high[c] = fmax(high[c], x);
			}
	for (int c = 0; c < 3; c++)
		surface->edge = fmax(surface->edge, high[c] - surface->low[c]);
}

/* Leaves of one material have it once; of that of leaves without any, none. */
static void join_materials(struct octree *tree)
{
	const uint32_t first = octree_material(tree, 0);

	for (uint64_t i = 1; i < tree->n_leaves; i++)
		if (octree_material(tree, i) != first)
			return;
	if (first == OCTREE_MATTE) {
		free(tree->material);
	} else {
		void *one = realloc(tree->material, sizeof *tree->one_material);

		tree->one_material = one != NULL ? one : tree->material;
	}
	tree->material = NULL;
}

static int build(struct leaf_maker *m)
{
	const struct octree_room room = { m->options->memory, m->options->folder };
	int rc = octree_mesh_sides(&m->is_turned, &m->report.is_closed, m->mesh);

	m->lean = (struct lean){ m->mesh, m->is_turned, m->levels, calloc(OCTREE_LEAN_CELLS, sizeof *m->lean.cell) };
	if (rc == PSR_OK && m->lean.cell == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK)
		rc = surface_init(&m->look, m->mesh, ldexp(m->surface.edge, -m->levels));
	if (rc != PSR_OK)
		return psr_fail(m->err, rc, "no memory for a surface of %u triangles", m->mesh->n_triangles);
	m->side = ldexp(1.0, m->levels);
	m->scale = m->side / m->surface.edge;
	rc = octree_maker_init(&m->maker, m->levels, m->err);
	if (rc == PSR_OK)
		rc = octree_surface_walk(&m->surface, m->levels, &room, make_leaf, m, m->err);
	if (rc == PSR_OK && m->maker.tree->n_leaves == 0)
		rc = psr_fail(m->err, PSR_ERR_FORMAT, "nothing of the surface of %u triangles is opaque", m->mesh->n_triangles);
	if (rc == PSR_OK)
		join_materials(m->maker.tree);
	return rc;
}

int octree_of_mesh(struct octree **out, struct octree_mesh_report *report, const struct psr_mesh *mesh,
                   const struct octree_build_options *options, struct psr_error *err)
{
	struct psr_error own;
	struct leaf_maker m = { .mesh = mesh, .options = options, .err = err != NULL ? err : &own };
	int rc;

	if (mesh->n_triangles == 0)
		return psr_fail(err, PSR_ERR_ARG, "an octree of a mesh without triangles");
	m.surface = (struct octree_surface){ .position = (const double(*)[3])mesh->position,
		                                 .triangle = (const uint32_t(*)[3])mesh->triangle,
		                                 .n_triangles = mesh->n_triangles,
		                                 .cancel = options->cancel };
	find_cube(&m.surface, mesh);
	rc = octree_build_levels(&m.levels, options, "mesh", m.surface.edge, m.err);
	if (rc == PSR_OK)
		rc = build(&m);
	if (rc == PSR_OK) {
		*out = octree_maker_take(&m.maker);
		for (int c = 0; c < 3; c++)
			(*out)->low[c] = m.surface.low[c];
		(*out)->edge = m.surface.edge;
		(*out)->is_one_sided = m.report.is_closed && m.report.n_both * SIDES <= (*out)->n_leaves;
		if (report != NULL)
			*report = m.report;
		if ((*out)->is_one_sided && !lean_set(*out, &m.lean)) { /* one of both sides has no need of it */
			octree_destroy(*out);
			rc = psr_fail(m.err, PSR_ERR_MEMORY, "no memory for an octree");
		}
	}
	octree_maker_fini(&m.maker);
	surface_fini(&m.look);
	free(m.lean.cell);
	free(m.is_turned);
	free(m.facet);
	return rc;
}
