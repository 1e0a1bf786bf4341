#include "cull.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/vec.h"
#include "sample/pack/cone.h"
#include "sample/pack/visibility_mask.h"

#define HALF_ANGLE 0.3490658503988659 /* 20 degrees */

/* By xorshift64*. */
static void random_in_ball(uint64_t *state, double v[3])
{
	do
		for (int k = 0; k < 3; k++) {
			*state ^= *state >> 12;
			*state ^= *state << 25;
			*state ^= *state >> 27;
			v[k] = 2 * ((double)(*state * UINT64_C(2685821657736338717) >> 11) * 0x1p-53) - 1;
		}
	while (v3d_dot(v, v) > 1 || v3d_dot(v, v) < 1e-4);
}

void cull_eye_place(struct cull_eye *eye, uint32_t which, double zoom)
{
	uint64_t state = UINT64_C(0x9e3779b97f4a7c15) * ((uint64_t)which + 1);
	double from[3], up[3], at[3], sine, cosine;

	assert(zoom >= 1);
	random_in_ball(&state, from);
	random_in_ball(&state, up);
	random_in_ball(&state, at);
	psr_sincos(HALF_ANGLE, &sine, &cosine);
	v3d_normalize(from, from);
	v3d_scale(eye->place, from, 1 / sine);
	v3d_scale(at, at, zoom > 1);
	v3d_sub(eye->frame[2], at, eye->place);
	v3d_normalize(eye->frame[2], eye->frame[2]);
	v3d_cross(eye->frame[0], eye->frame[2], up);
	v3d_normalize(eye->frame[0], eye->frame[0]);
	v3d_cross(eye->frame[1], eye->frame[2], eye->frame[0]);
	eye->tangent = sine / cosine / zoom;
}

static size_t words_of(int level)
{
	return level <= 1 ? 1 : (size_t)8 << 2 * level >> 6;
}

/* Children of a triangle are four bits beside each other. */
static void coarsen(uint64_t *coarse, const uint64_t *fine, int level)
{
	memset(coarse, 0, words_of(level) * sizeof *coarse);
	for (unsigned t = 0; t < 8u << 2 * level; t++)
		coarse[t >> 6] |= (uint64_t)((fine[4 * t >> 6] >> (4 * t & 63) & 15) != 0) << (t & 63);
}

static int make_masks(struct cull_set *set, struct psr_pool *pool)
{
	for (int level = 0; level <= set->finest; level++) {
		set->mask[level] = psr_alloc_array(set->n_blocks, words_of(level) * sizeof *set->mask[level]);
		if (set->mask[level] == NULL)
			return PSR_ERR_MEMORY;
	}
	if (visibility_mask_make_at(psr_model_blocks(set->base), set->finest, words_of(set->finest), pool,
	                        set->mask[set->finest]) != PSR_OK)
		return PSR_ERR_MEMORY;
	for (int level = set->finest - 1; level >= 0; level--)
		for (uint32_t b = 0; b < set->n_blocks; b++)
			coarsen(set->mask[level] + words_of(level) * b, set->mask[level + 1] + words_of(level + 1) * b, level);
	return PSR_OK;
}

static int make_set(struct cull_set *set, int finest, struct psr_pool *pool, struct psr_error *err)
{
	const struct psr_blocks *all = psr_model_blocks(set->model);
	int rc;

	set->finest = finest;
	set->index = psr_alloc_array(all->n_blocks, sizeof *set->index);
	set->screen.mask = psr_alloc_array(SCREEN_NODES, sizeof *set->screen.mask);
	if (set->index == NULL || set->screen.mask == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a study of culling");
	rc = cull_part(&set->base, set->model, NULL, set->index, err);
	if (rc != PSR_OK)
		return rc;
	set->n_blocks = psr_model_blocks(set->base)->n_blocks;
	rc = make_masks(set, pool);
	return rc == PSR_OK ? rc : psr_fail(err, rc, "no memory for visibility masks of %u blocks", set->n_blocks);
}

int cull_set_create(struct cull_set **out, const struct psr_model *model, int finest, struct psr_pool *pool,
                    struct psr_error *err)
{
	struct cull_set *set;
	int rc;

	assert(finest >= 0 && finest <= CULL_FINEST);
	if (psr_model_blocks(model) == NULL)
		return psr_fail(err, PSR_ERR_ARG, "the model has no blocks of samples");
	set = calloc(1, sizeof *set);
	if (set == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a study of culling");
	set->model = psr_model_ref((struct psr_model *)model);
	rc = make_set(set, finest, pool, err);
	if (rc == PSR_OK)
		*out = set;
	else
		cull_set_destroy(set);
	return rc;
}

void cull_set_destroy(struct cull_set *set)
{
	if (set == NULL)
		return;
	for (int level = 0; level <= CULL_FINEST; level++)
		psr_free(set->mask[level]);
	psr_free(set->index);
	psr_free(set->screen.mask);
	psr_model_unref(set->base);
	psr_model_unref(set->model);
	free(set);
}

/* ---- tests ---- */

/* In the frame of the eye, as floats like a renderer's. */
struct lens {
	float place[3], frame[3][3], tangent, slope; /* slope: length of the normal (1, tangent) of a side */
};

/* Interval of c / z for c within c +- r and z within z0..z1, both positive. */
static void interval(float c, float r, float z0, float z1, double *low, double *high)
{
	*low = (double)((c - r) / (c - r < 0 ? z0 : z1));
	*high = (double)((c + r) / (c + r < 0 ? z1 : z0));
}

/* Returns the smallest node that holds a sphere; the whole screen's for spheres at the eye. */
static int node_of(const struct screen *screen, const struct lens *lens, const float c[3], float r)
{
	double low[2], high[2];

	if (!(c[2] - r > 0))
		return 1;
	for (int k = 0; k < 2; k++)
		interval(c[k], r, (c[2] - r) * lens->tangent, (c[2] + r) * lens->tangent, &low[k], &high[k]);
	return screen_node(screen, low[0], low[1], high[0], high[1]);
}

static int is_in_view(const struct lens *lens, const float c[3], float r)
{
	for (int k = 0; k < 2; k++)
		if (fabsf(c[k]) - c[2] * lens->tangent > r * lens->slope)
			return 0;
	return 1;
}

static int masks_meet(const uint64_t *a, const uint64_t *b, size_t words)
{
	for (size_t w = 0; w < words; w++)
		if ((a[w] & b[w]) != 0)
			return 1;
	return 0;
}

void cull_set_test(struct cull_set *set, const struct cull_eye *eye, const struct cull_choice *choice, uint8_t *is_kept)
{
	const struct psr_blocks *blocks = psr_model_blocks(set->base), *all = psr_model_blocks(set->model);
	const size_t words = choice->level != CULL_NO_MASK ? words_of(choice->level) : 0;
	const uint64_t *mask = words != 0 ? set->mask[choice->level] : NULL;
	struct lens lens = { .tangent = (float)eye->tangent, .slope = (float)sqrt(1 + eye->tangent * eye->tangent) };

	assert(choice->level <= set->finest);
	for (int k = 0; k < 3; k++) {
		lens.place[k] = (float)eye->place[k];
		v3f_set(lens.frame[k], (float)eye->frame[k][0], (float)eye->frame[k][1], (float)eye->frame[k][2]);
	}
	if (words != 0)
		screen_make(&set->screen, choice->n, eye->frame, (const double[2]){ eye->tangent, eye->tangent },
		            choice->level);
	for (uint32_t b = 0; b < set->n_blocks; b++) {
		float center[3], v[3], c[3], r;

		psr_blocks_sphere(blocks, b, center, &r);
		v3f_sub(v, center, lens.place);
		r *= 1.0001f;
		m3f_apply(c, (const float(*)[3])lens.frame, v);
		is_kept[b] = is_in_view(&lens, c, r) && !(choice->cones && cone_culls(all, set->index[b], lens.place, 1));
		if (is_kept[b] && words != 0)
			is_kept[b] = masks_meet(mask + words * b, set->screen.mask[node_of(&set->screen, &lens, c, r)], words);
	}
}
