/* The pieces of a mesh and of its patches, which threads make side by side. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/pool.h"
#include "building.h"
#include "dpoint/mesh.h"
#include "dpoint/trim_grid.h"
#include "dpoint/trimmed.h"
#include "model/blocks.h"
#include "sample/octree/of_mesh.h"
#include "surface/texture.h"

#define HEM 1e-4f         /* twice of what rims of patches are off at most (import/cad) */
#define TURN 0.6          /* of epsilon's sine: normals turn by so much along the side of a mesh's piece (0155) */
#define PER_PIXEL 8       /* facets of patches are off by this part of a pixel */
#define PER_ERROR 4       /* and by this part of an error that is asked for */
#define MARGIN 0.08f      /* of points of patches: from 2 degrees aslant no step between flat ones shows (0139) */

/* The look of a place in the middle of a piece, filtered over the piece; *attr without a normal. */
static int look_at(void *userdata, uint32_t triangle, double u, double v, uint64_t *attr)
{
	const struct building *b = userdata;
	const struct surface_place place = { .prim = triangle, .u = u, .v = v };
	float normal[3];

	if (b->mesh->material[b->mesh->triangle_material[triangle]].alpha != PSR_ALPHA_OPAQUE
	    && texture_is_absent(b->mesh, triangle, u, v))
		return 0;
	*attr = surface_look(&b->look, &place, 2.0 / b->options->resolution, normal) & ~(uint64_t)PSR_ATTR_NORMAL(UINT64_MAX);
	return 1;
}

static int is_opaque_alone(const struct psr_mesh *mesh)
{
	for (uint32_t m = 0; m < mesh->n_materials; m++)
		if (mesh->material[m].alpha != PSR_ALPHA_OPAQUE)
			return 0;
	return 1;
}

/* A closed surface that nothing shows the inside of is seen from outside. */
static int find_sides(struct building *b)
{
	const struct psr_mesh *mesh = b->mesh;
	uint8_t *is_turned = NULL;
	int is_closed = 0, n_turned = 0;
	int rc = octree_mesh_sides(&is_turned, &is_closed, mesh);

	for (uint32_t t = 0; t < mesh->n_triangles && rc == PSR_OK; t++)
		n_turned += is_turned[t];
	for (uint32_t m = 0; m < mesh->n_materials; m++)
		b->two_sided[m] = mesh->material[m].two_sided && !(is_closed && n_turned == 0 && is_opaque_alone(mesh));
	free(is_turned);
	return rc;
}

/* What changes within a pixel is not seen at the resolution. */
static void find_grains(struct building *b)
{
	for (uint32_t m = 0; m < b->mesh->n_materials; m++)
		b->grain[m] = b->look.is_plain[m] && b->mesh->color == NULL ? 0 : 2.0 / b->options->resolution;
}

struct place {
	size_t cell, candidate, facet;
};

/* A patch, and what comes of it. */
struct part {
	const struct psr_patch *patch; /* NULL: it has no look, and nothing to cover */
	uint64_t attr;
	struct dpoint_surface surface;
	struct place place; /* in the surface of all */
	struct psr_error err;
	int rc;
};

struct size {
	uint32_t n_triangles, patch;
};

struct parts {
	struct building *b;
	struct dpoint_cover_options cover;
	struct part *part;
	struct size *order; /* those of many triangles first, so that no thread begins the longest one last */
	uint32_t n;
	size_t n_cells; /* so far; beyond the limit no other part is begun */
	struct psr_error err;
	int rc;         /* of the mesh */
};

static int compare_sizes(const void *a, const void *b)
{
	const struct size *x = a, *y = b;

	if (x->n_triangles != y->n_triangles)
		return x->n_triangles > y->n_triangles ? -1 : 1;
	return x->patch < y->patch ? -1 : x->patch > y->patch;
}

static int parts_init(struct parts *p, struct building *b)
{
	*p = (struct parts){ .b = b, .cover = building_cover(b->options), .n = b->mesh->n_patches };
	p->part = calloc((size_t)p->n + 1, sizeof *p->part);
	p->order = malloc(((size_t)p->n + 1) * sizeof *p->order);
	if (p->part == NULL || p->order == NULL) {
		free(p->part);
		free(p->order);
		return psr_fail(b->err, PSR_ERR_MEMORY, "no memory for %u patches", p->n);
	}
	for (uint32_t i = 0; i < p->n; i++) {
		dpoint_surface_init(&p->part[i].surface);
		p->order[i] = (struct size){ b->mesh->patch[i].n_triangles, i };
	}
	qsort(p->order, p->n, sizeof *p->order, compare_sizes);
	return PSR_OK;
}

static void parts_fini(struct parts *p)
{
	for (uint32_t i = 0; i < p->n; i++)
		dpoint_surface_fini(&p->part[i].surface);
	free(p->part);
	free(p->order);
}

/* A patch looks as its first triangle does; one whose triangles are all without an area has no look. */
static void find_looks(struct parts *p)
{
	const struct psr_mesh *mesh = p->b->mesh;

	for (uint32_t t = 0; t < mesh->n_triangles && p->n > 0; t++) {
		const uint32_t i = mesh->triangle_patch[t];

		if (i != UINT32_MAX && p->part[i].patch == NULL && p->part[i].rc == PSR_OK) {
			p->part[i].rc = PSR_ERR_NOT_FOUND;
			if (look_at(p->b, t, 1.0 / 3, 1.0 / 3, &p->part[i].attr))
				p->part[i].patch = &mesh->patch[i];
		}
	}
	for (uint32_t i = 0; i < p->n; i++)
		p->part[i].rc = PSR_OK;
}

/* How far facets may be from the surface. */
static double facet_of(const struct dpoint_build_options *o)
{
	const double pixels = o->error > 0 ? fmin(1.0 / PER_PIXEL, o->error / PER_ERROR) : 1.0 / PER_PIXEL;

	return pixels * 2.0 / o->resolution;
}

static void sample_patch(struct parts *p, struct part *part)
{
	const struct psr_model_info *info = p->b->info;
	const struct dpoint_trimmed_options o = {
		.origin = { info->origin[0], info->origin[1], info->origin[2] }, .scale = 1 / info->scale,
		.cell = p->b->options->piece, .turn = 0.5 * (double)p->cover.sine, .delta = p->cover.delta,
		.hem = (double)fminf(HEM, 0.5f * p->cover.overhang), .facet = facet_of(p->b->options), .attr = part->attr,
	};

	if (part->patch == NULL || __atomic_load_n(&p->n_cells, __ATOMIC_RELAXED) > TRIM_MOST_CELLS)
		return;
	part->rc = dpoint_sample_trimmed(&part->surface, part->patch, &o, &part->err);
	__atomic_fetch_add(&p->n_cells, part->surface.n_cells, __ATOMIC_RELAXED);
}

static void sample_mesh(struct parts *p)
{
	struct building *b = p->b;
	const struct dpoint_mesh_options mesh = {
		.origin = { b->info->origin[0], b->info->origin[1], b->info->origin[2] }, .scale = 1 / b->info->scale,
		.cell = b->options->piece, .turn = TURN * (double)p->cover.sine, .delta = p->cover.delta, .grain_of = b->grain,
		.cover = &p->cover, .looks = BUILDING_LOOKS, .look = look_at, .userdata = b,
	};

	p->rc = dpoint_sample_mesh(&b->surface, b->mesh, &mesh, &p->err);
}

/* The mesh first: it takes longest. */
static void sample(int i, void *userdata)
{
	struct parts *p = userdata;

	if (i == 0)
		sample_mesh(p);
	else
		sample_patch(p, &p->part[p->order[i - 1].patch]);
}

/* Copies a part's cells, candidates and facets to where they are in those of all. */
static void append(int i, void *userdata)
{
	const struct parts *p = userdata;
	struct dpoint_surface *to = &p->b->surface, *from = &p->part[i].surface;
	const struct place *at = &p->part[i].place;

	memcpy(to->cell + at->cell, from->cell, from->n_cells * sizeof *from->cell);
	for (size_t c = 0; c < from->n_candidates; c++) {
		struct dpoint_candidate *candidate = &to->candidate[at->candidate + c];

		*candidate = from->candidate[c];
		candidate->cell += (uint32_t)at->cell;
	}
	memcpy(to->facets.facet + at->facet, from->facets.facet, from->facets.n * sizeof *from->facets.facet);
	dpoint_surface_fini(from);
}

/* Adds the parts after what is there. */
static int append_all(struct parts *p)
{
	struct dpoint_surface *all = &p->b->surface;
	struct place end = { all->n_cells, all->n_candidates, all->facets.n };

	for (uint32_t i = 0; i < p->n; i++) {
		const struct dpoint_surface *from = &p->part[i].surface;

		p->part[i].place = end;
		end.cell += from->n_cells;
		end.candidate += from->n_candidates;
		end.facet += from->facets.n;
		all->n_bad += from->n_bad;
		all->n_clamped += from->n_clamped;
	}
	if (!dpoint_surface_reserve(all, end.cell, end.candidate, end.facet))
		return PSR_ERR_MEMORY;
	all->n_cells = end.cell;
	all->n_candidates = end.candidate;
	all->facets.n = end.facet;
	psr_pool_for(p->b->options->pool, (int)p->n, append, p);
	return PSR_OK;
}

/* The error of the first that has one. */
static int join(struct parts *p)
{
	struct building *b = p->b;
	int rc = PSR_OK;

	if (p->rc != PSR_OK)
		return psr_fail(b->err, p->rc, "%s", p->err.text);
	for (uint32_t i = 0; i < p->n; i++)
		if (p->part[i].rc != PSR_OK)
			return psr_fail(b->err, p->part[i].rc, "%s", p->part[i].err.text);
	if (p->n_cells > TRIM_MOST_CELLS)
		return dpoint_trimmed_refuse(b->options->piece, b->err);
	if (p->n > 0) {
		b->surface.margin = MARGIN;
		rc = append_all(p);
		rc = rc == PSR_OK ? facets_sort(&b->surface.facets) : rc;
	}
	return rc == PSR_OK ? rc : psr_fail(b->err, rc, "no memory for the pieces of %u patches", p->n);
}

int building_put_mesh(struct building *b)
{
	struct parts parts;
	int rc = find_sides(b);

	if (rc != PSR_OK)
		return psr_fail(b->err, rc, "no memory for the sides of %u triangles", b->mesh->n_triangles);
	find_grains(b);
	rc = parts_init(&parts, b);
	if (rc != PSR_OK)
		return rc;
	find_looks(&parts);
	rc = psr_pool_for_until(b->options->pool, b->options->cancel, 1 + (int)parts.n, sample, &parts);
	rc = rc == PSR_OK ? join(&parts) : psr_fail(b->err, rc, "cancelled");
	parts_fini(&parts);
	if (rc == PSR_OK && b->surface.n_candidates == 0)
		rc = psr_fail(b->err, PSR_ERR_FORMAT, "nothing of the surface of %u triangles is opaque", b->mesh->n_triangles);
	return rc;
}
