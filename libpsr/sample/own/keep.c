#include <math.h>
#include "base/mem.h"
#include "base/vec.h"
#include "surface/blend.h"
#include "sample/level.h"
#include "base/direction.h"
#include "psr/error.h"

#define MOST_BLENDED 64

/* Samples are drawn where their normals face the eye, and places are visible where their faces do: a shading normal
 * further than this from its face's, as normal maps and smoothing at creases make them, would open the surface in views
 * along it. Such a sample is bent: how it faces is told by a normal that is as near as this, and shaded is its own. */
#define LEAST_AGREEMENT 0.94f       /* 20 degrees */
#define LEAST_AGREEMENT_WIDE 0.985f /* 10, where a face is so wide that no sample beside it closes what opens */
#define WIDE_PIXELS 3

#define NORMAL_BITS UINT64_C(0x7fff)

static int is_wide(const struct level *level, uint32_t prim)
{
	const double least = WIDE_PIXELS * level->ds;
	double corner[3][3], side[3][3], cross[3], longest2 = 0;

	if (prim >= level->mesh->n_triangles)
		return 0;
	ray_scene_corners(level->scene, prim, corner);
	for (int i = 0; i < 3; i++) {
		v3d_sub(side[i], corner[(i + 1) % 3], corner[i]);
		longest2 = fmax(longest2, v3d_dot(side[i], side[i]));
	}
	v3d_cross(cross, side[0], side[1]);
	return v3d_dot(cross, cross) > least * least * longest2;
}

static float least_agreement(const struct level *level, uint32_t prim)
{
	return is_wide(level, prim) ? LEAST_AGREEMENT_WIDE : LEAST_AGREEMENT;
}

/* The normal that is nearest to `normal` of those within a cosine of a face's. */
static uint16_t agree(uint16_t normal, const float face[3], float least)
{
	const float *n = psr_direction_table()[normal];
	float g = v3f_dot(n, face), aside[3], turned[3];

	if (g >= least)
		return normal;
	v3f_add_scaled(aside, n, -g, face);
	if (v3f_normalize(aside, aside) == 0)
		v3f_set(aside, 0, 0, 0);
	v3f_scale(turned, face, least);
	v3f_add_scaled(turned, turned, sqrtf(1 - least * least), aside);
	return (uint16_t)psr_direction_encode(turned);
}

/* Attributes of the finer samples around, of a footprint that falls to nothing at a pixel's distance: the normal that
 * tells how they face is a mean, too. 0 if there are none, and then nothing of `to` is touched. */
static int blend(const struct level *level, const float n[3], const float facing[3], uint32_t prim,
                 struct cover_point *to)
{
	const struct cover *finer = level->finer;
	const float (*direction)[3] = psr_direction_table(), *p = to->position;
	float weight[MOST_BLENDED], reach2 = (float)(level->ds * level->ds);
	uint64_t found[MOST_BLENDED], straight[MOST_BLENDED];
	uint32_t first[COVER_MOST_AROUND];
	int n_cells = cover_around(finer, p, level->ds, first), count = 0, n_bent = 0;

	for (int c = 0; c < n_cells; c++) {
		for (uint32_t i = first[c]; i != COVER_NONE; i = finer->point[i].next) {
			const struct cover_point *point = &finer->point[i];
			float d[3], w, g = v3f_dot(direction[point->normal], n);

			v3f_sub(d, point->position, p);
			w = 1 - v3f_dot(d, d) / reach2;
			if (!(w > 0) || count == MOST_BLENDED || !(g > 0.1f || (point->two_sided && g < -0.1f)))
				continue;
			weight[count] = w * w;
			straight[count] = (point->attr & ~NORMAL_BITS) | point->normal;
			found[count++] = point->attr;
			n_bent += point->traits & PSR_BLOCK_BENT;
		}
	}
	if (count == 0)
		return 0;
	to->attr = blend_attr(found, weight, count, facing);
	to->normal = (uint16_t)PSR_ATTR_NORMAL(to->attr);
	if (n_bent != 0) {
		uint16_t own = (uint16_t)PSR_ATTR_NORMAL(blend_attr(straight, weight, count, facing));

		if (v3f_dot(direction[to->normal], direction[own]) < least_agreement(level, prim)) {
			to->traits |= PSR_BLOCK_BENT;
			to->normal = own;
		}
	}
	return 1;
}

/* Attributes of the place itself. */
static void look(const struct level *level, const struct surface_place *place, const float n[3], const float facing[3],
                 struct cover_point *to)
{
	const float least = least_agreement(level, place->prim);
	uint64_t word;
	float normal[3];

	word = surface_look(level->surface, place, 1.4142135623730951 * level->ds, normal);
	to->attr = word | psr_direction_encode(normal);
	to->traits |= v3f_dot(normal, n) < least ? PSR_BLOCK_BENT : 0;
	surface_face(normal, facing);
	to->normal = agree((uint16_t)psr_direction_encode(normal), n, least);
	if (!(to->traits & PSR_BLOCK_BENT))
		to->attr = word | to->normal;
}

static int is_sheer(const struct level *level, const struct surface_place *place)
{
	float rgba[4];

	if (level_material(level, place->prim)->alpha != PSR_ALPHA_BLEND)
		return 0;
	texture_base_color(level->mesh, place->prim, place->u, place->v, rgba);
	return rgba[3] < 1;
}

static void make_point(const struct level *level, const struct level_ref *ref, struct cover_point *point)
{
	const struct sheets *sheets = &level->sheets[ref->projection];
	const struct patch *patch = &sheets->patch[ref->at.patch];
	uint32_t surface = sheets->sample[ref->at.patch][ref->at.sample].surface, prim = surface & ~SHEET_BACK;
	struct surface_place place = { .prim = prim, .is_back = (surface & SHEET_BACK) != 0 };
	struct ray ray;
	double x, y;
	float n[3];

	sheets_point(sheets, PSR_BLOCK_SIDE * patch->row + (int)(ref->at.sample / PSR_BLOCK_SIDE),
	             PSR_BLOCK_SIDE * patch->col + (int)(ref->at.sample % PSR_BLOCK_SIDE), &x, &y);
	sheets_ray(&sheets->projection, x, y, &ray);
	ray_locate(level->scene, &ray, prim, &place.u, &place.v);
	sheets_position(sheets, ref->at, point->position);
	level_normal(level, surface, n);
	point->traits = is_sheer(level, &place) ? PSR_BLOCK_SHEER : 0;
	if (level->finer == NULL || !blend(level, n, sheets->projection.axis[2], prim, point))
		look(level, &place, n, sheets->projection.axis[2], point);
	point->two_sided = (uint8_t)level_is_two_sided(level, prim, point->position, n);
	point->sample = (uint8_t)ref->at.sample;
	point->projection = ref->projection;
	point->patch = ref->at.patch;
	point->next = COVER_NONE;
}

int level_is_two_sided(const struct level *level, uint32_t prim, const float p[3], const float n[3])
{
	const uint8_t both = SIDE_FRONT_SEEN | SIDE_BACK_SEEN;
	float back[3];

	if (level_is_thin(level, prim))
		return 1;
	if (!level_material(level, prim)->two_sided)
		return 0;
	v3f_scale(back, n, -1);
	return (level->sides[prim] & both) == both || (seen_is(&level->seen, p, back) && seen_is(&level->seen, p, n));
}

void keep_mark(struct level *level, const struct level_ref *ref)
{
	struct patch *patch = &level->sheets[ref->projection].patch[ref->at.patch];

	patch->kept |= UINT64_C(1) << ref->at.sample;
	patch->is_alive = 1;
}

int keep_sample(struct level *level, struct level_ref ref)
{
	struct cover_point point;

	if ((level->sheets[ref.projection].patch[ref.at.patch].kept >> ref.at.sample & 1) != 0)
		return PSR_OK;
	make_point(level, &ref, &point);
	keep_mark(level, &ref);
	return cover_add(&level->cover, &point);
}

struct job {
	struct level *level;
	const struct level_ref *ref;
	struct cover_point *point;
	uint32_t n;
};

#define CHUNK 4096

static void make_chunk(int i, void *userdata)
{
	struct job *job = userdata;
	uint32_t end = (uint32_t)(i + 1) * CHUNK < job->n ? (uint32_t)(i + 1) * CHUNK : job->n;

	for (uint32_t k = (uint32_t)i * CHUNK; k < end; k++)
		make_point(job->level, &job->ref[k], &job->point[k]);
}

int keep_samples(struct level *level, const struct level_ref *ref, uint32_t n)
{
	struct job job = { .level = level, .ref = ref, .n = n };
	int rc = PSR_OK;

	job.point = psr_alloc_array(n, sizeof *job.point);
	if (job.point == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(level->pool, (int)((n + CHUNK - 1) / CHUNK), make_chunk, &job);
	for (uint32_t i = 0; rc == PSR_OK && i < n; i++) {
		keep_mark(level, &ref[i]);
		rc = cover_add(&level->cover, &job.point[i]);
	}
	psr_free(job.point);
	return rc;
}

static uint32_t list_owned(struct level *level, struct level_ref *ref)
{
	uint32_t n = 0;

	for (unsigned i = 0; i < level->n_projections; i++) {
		for (uint32_t p = 0; p < level->sheets[i].n_patches; p++) {
			for (uint64_t left = level->sheets[i].patch[p].owned; left != 0; left &= left - 1, n++)
				if (ref != NULL)
					ref[n] = (struct level_ref){ i, { p, (uint32_t)__builtin_ctzll(left) } };
		}
	}
	return n;
}

int keep_owned(struct level *level)
{
	struct level_ref *ref = psr_alloc_array(list_owned(level, NULL), sizeof *ref);
	int rc;

	if (ref == NULL)
		return PSR_ERR_MEMORY;
	rc = keep_samples(level, ref, list_owned(level, ref));
	psr_free(ref);
	return rc;
}

static void look_again(int i, void *userdata)
{
	struct level *level = userdata;
	uint32_t end =
		(uint32_t)(i + 1) * CHUNK < level->cover.n_points ? (uint32_t)(i + 1) * CHUNK : level->cover.n_points;

	for (uint32_t k = (uint32_t)i * CHUNK; k < end; k++) {
		struct cover_point *point = &level->cover.point[k];
		uint32_t surface = level->sheets[point->projection].sample[point->patch][point->sample].surface;
		float n[3];

		level_normal(level, surface, n);
		point->two_sided = (uint8_t)level_is_two_sided(level, surface & ~SHEET_BACK, point->position, n);
	}
}

void keep_look_again(struct level *level)
{
	psr_pool_for(level->pool, (int)((level->cover.n_points + CHUNK - 1) / CHUNK), look_again, level);
}
