#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "cone.h"
#include "pack.h"
#include "base/direction.h"
#include "visibility_mask.h"
#include "visibility_mask_table.h"

/* Spheres are made from rounded positions; this much more holds the exact ones (a few roundings of 2^-24 each). */
#define SLACK 0x1p-21

struct order {
	uint64_t code;
	uint32_t block; /* of the draft */
	uint32_t group;
	uint8_t level;
};

struct pack {
	const struct ray_scene *scene;
	const struct draft *draft;
	struct order *order;
	struct psr_cluster *cluster;
	struct psr_run *run;
	int16_t *center[3];
	uint16_t *radius;
	int8_t *cone[3];
	uint8_t *cone_sine, *block_projection, *flags, *traits;
	uint16_t *attr_offset, *depth;
	uint64_t *mask, *attr;
	uint32_t n_clusters, n_samples;
	double box_min[3], box_max[3];
};

static double spacing_of(const struct draft *draft, const struct draft_block *block)
{
	return (double)draft->projection[block->projection].spacing * (double)(1u << block->level);
}

/* Projection space. */
static void place_sample(const struct draft *draft, const struct draft_block *block, unsigned s, double p[3])
{
	double spacing = spacing_of(draft, block);
	int row = block->row + (int)(s / PSR_BLOCK_SIDE);

	p[0] = (block->col + (int)(s % PSR_BLOCK_SIDE) + (row & 1) / 2.0) * spacing;
	p[1] = row * 0.86602540378443864676 * spacing;
	p[2] = (double)draft_sample(draft, block, s)->z;
}

static void projection_box(const struct draft *draft, const struct draft_block *block, double min[3], double max[3])
{
	v3d_set(min, INFINITY, INFINITY, INFINITY);
	v3d_set(max, -INFINITY, -INFINITY, -INFINITY);
	for (uint64_t left = block->part; left != 0; left &= left - 1) {
		double p[3];

		place_sample(draft, block, (unsigned)__builtin_ctzll(left), p);
		for (int k = 0; k < 3; k++) {
			min[k] = p[k] < min[k] ? p[k] : min[k];
			max[k] = p[k] > max[k] ? p[k] : max[k];
		}
	}
}

static void middle_of(const struct psr_projection *projection, const double min[3], const double max[3],
                      double middle[3])
{
	sheets_inner(projection, (min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2, middle);
}

static uint64_t morton(const double center[3])
{
	uint64_t code = 0;

	for (int k = 0; k < 3; k++) {
		double scaled = (center[k] + 2) * (1 << 19); /* 0 .. 2^21 */
		uint64_t v = scaled > 0 ? (uint64_t)scaled : 0;

		for (int bit = 0; bit < 21; bit++)
			code |= (v >> bit & 1) << (3 * bit + k);
	}
	return code;
}

static int compare_order(const void *a, const void *b)
{
	const struct order *x = a, *y = b;

	if (x->level != y->level)
		return x->level > y->level ? -1 : 1;
	if (x->group != y->group)
		return x->group < y->group ? -1 : 1;
	return x->code != y->code ? (x->code < y->code ? -1 : 1) : x->block < y->block ? -1 : x->block > y->block;
}

static void sort_blocks(struct pack *pack)
{
	const struct draft *draft = pack->draft;

	for (uint32_t i = 0; i < draft->n_blocks; i++) {
		const struct draft_block *block = &draft->block[i];
		double min[3], max[3], middle[3];

		projection_box(draft, block, min, max);
		middle_of(&draft->projection[block->projection], min, max, middle);
		pack->order[i] = (struct order){ morton(middle), i, block->group, block->level };
	}
	qsort(pack->order, draft->n_blocks, sizeof *pack->order, compare_order);
}

static void place_of(const struct pack *pack, uint32_t i, struct psr_place *place)
{
	const struct psr_blocks blocks = { .projection = pack->draft->projection, .sphere_x = pack->center[0],
		                               .sphere_y = pack->center[1], .sphere_z = pack->center[2],
		                               .block_projection = pack->block_projection, .flags = pack->flags };

	psr_blocks_place(&blocks, i, place);
}

static double clamp(double x, double middle, double reach)
{
	return x < middle - reach ? middle - reach : x > middle + reach ? middle + reach : x;
}

/* The sphere's center: the middle of the box, which is half a column or a row off the middle of the block's window at
 * most. It is kept from that limit as far as rounding to 2^-14 along each axis may move it, 0.87 of that, and 2^-20
 * more, as axes are of single precision. */
static void center_block(struct pack *pack, uint32_t i, const struct draft_block *block, const double min[3],
                         const double max[3])
{
	const double spacing = spacing_of(pack->draft, block), off = 0.87 * 0x1p-14 + 0x1p-20;
	const double pitch = 0.86602540378443864676 * spacing;
	const double x = clamp((min[0] + max[0]) / 2, (block->col + 3.75) * spacing, spacing / 2 - off);
	const double y = clamp((min[1] + max[1]) / 2, (block->row + 3.5) * pitch, pitch - off);
	double center[3];
	struct psr_place place;

	sheets_inner(&pack->draft->projection[block->projection], x, y, (min[2] + max[2]) / 2, center);
	for (int k = 0; k < 3; k++) {
		double rounded = rint(center[k] * 0x1p14);

		assert(fabs(rounded) <= INT16_MAX);
		pack->center[k][i] = (int16_t)rounded;
	}
	place_of(pack, i, &place);
	assert(place.col == (double)block->col * (1u << block->level));
	assert(place.row == (double)block->row * (1u << block->level));
}

/* Depths as 16 bits, in the least step, a power of two, that reaches them all from that of the center. */
static void quantise(struct pack *pack, uint32_t i, uint32_t at, const struct draft_block *block, double min,
                     double max)
{
	unsigned shift = 14 + (PSR_BLOCK_DEPTH >> 3);
	struct psr_place place;
	double middle, range;

	place_of(pack, i, &place);
	middle = place.z;
	range = max - middle > middle - min ? max - middle : middle - min;
	while (range * (double)(1u << shift) > INT16_MAX)
		shift--;
	assert(shift >= 14);
	for (uint64_t left = block->part; left != 0; left &= left - 1, at++) {
		const struct draft_sample *sample = draft_sample(pack->draft, block, (unsigned)__builtin_ctzll(left));

		pack->depth[at] = (uint16_t)rint(((double)sample->z - middle) * (double)(1u << shift) + 32768);
		pack->attr[at] = sample->attr;
	}
	pack->flags[i] |= (uint8_t)((shift - 14) << 3);
}

/* Through the samples as they will be read back, and half a step beyond.
 *
 * Both fit. A pixel ds is at most 1/4 (at resolution 8), and a sample stands on the surface, which is within the unit
 * sphere, or was moved by up to 0.55 ds: within 1.1375. So along each axis of the projection the middle is, which makes
 * 1.1375 sqrt(3) = 1.97 < 2 at most. Half of the box is at most 3.75 by 3.04 steps of at most ds, and 1.1375 deep: with
 * half a step more, 1.79 < 2. */
static void bound_block(struct pack *pack, uint32_t i, uint32_t at, const struct draft_block *block)
{
	const struct psr_projection *projection = &pack->draft->projection[block->projection];
	struct psr_place place;
	double radius = 0;

	place_of(pack, i, &place);
	for (uint64_t left = block->part; left != 0; left &= left - 1, at++) {
		double p[3], position[3], squared = 0;

		place_sample(pack->draft, block, (unsigned)__builtin_ctzll(left), p);
		sheets_inner(projection, p[0], p[1], (double)psr_place_depth(&place, pack->depth[at]), position);
		for (int k = 0; k < 3; k++) {
			double d = position[k] - pack->center[k][i] * 0x1p-14;

			squared += d * d;
			if (block->level != 0)
				continue;
			pack->box_min[k] = position[k] < pack->box_min[k] ? position[k] : pack->box_min[k];
			pack->box_max[k] = position[k] > pack->box_max[k] ? position[k] : pack->box_max[k];
		}
		radius = squared > radius ? squared : radius;
	}
	radius = ceil(((sqrt(radius) + spacing_of(pack->draft, block) / 2) * (1 + SLACK) + SLACK) * 0x1p15);
	assert(radius <= UINT16_MAX);
	pack->radius[i] = (uint16_t)radius;
}

/* The cone holds the normals of the faces, and those that the samples are drawn by, if it is not told by the cone alone
 * how they face. A block that is seen from both sides needs one only if it is bent. */
static void bound_normals(struct pack *pack, uint32_t i, const struct draft_block *block)
{
	const float (*direction)[3] = psr_direction_table();
	float normal[2 * PSR_BLOCK_SAMPLES][3];
	int8_t axis[3];
	int n = 0;

	for (uint64_t left = block->two_sided && !(block->traits & PSR_BLOCK_BENT) ? 0 : block->part; left != 0; left &= left - 1) {
		const struct draft_sample *sample = draft_sample(pack->draft, block, (unsigned)__builtin_ctzll(left));
		const float *front = ray_scene_normal(pack->scene, sample->surface & ~SHEET_BACK);

		v3f_scale(normal[n++], front, (sample->surface & SHEET_BACK) != 0 ? -1 : 1);
		if (!(block->traits & PSR_BLOCK_BENT))
			memcpy(normal[n++], direction[PSR_ATTR_NORMAL(sample->attr)], sizeof *normal);
	}
	cone_pack((const float(*)[3])normal, n, axis, &pack->cone_sine[i]);
	for (int k = 0; k < 3; k++)
		pack->cone[k][i] = axis[k];
}

static void place_block(struct pack *pack, uint32_t i, const struct draft_block *block)
{
	if (i % PSR_RUN_BLOCKS == 0)
		pack->run[i / PSR_RUN_BLOCKS] = (struct psr_run){ .attr_first = pack->n_samples };
	pack->block_projection[i] = block->projection;
	pack->flags[i] = (uint8_t)(block->level | (block->two_sided ? PSR_BLOCK_TWO_SIDED : 0));
	pack->traits[i] = block->traits;
	pack->mask[i] = block->part;
	pack->attr_offset[i] = (uint16_t)(pack->n_samples - pack->run[i / PSR_RUN_BLOCKS].attr_first);
}

static void pack_blocks(struct pack *pack)
{
	v3d_set(pack->box_min, INFINITY, INFINITY, INFINITY);
	v3d_set(pack->box_max, -INFINITY, -INFINITY, -INFINITY);
	pack->n_samples = 0;
	for (uint32_t i = 0; i < pack->draft->n_blocks; i++) {
		const struct draft_block *block = &pack->draft->block[pack->order[i].block];
		double min[3], max[3];

		place_block(pack, i, block);
		projection_box(pack->draft, block, min, max);
		center_block(pack, i, block, min, max);
		quantise(pack, i, pack->n_samples, block, min[2], max[2]);
		bound_block(pack, i, pack->n_samples, block);
		bound_normals(pack, i, block);
		pack->n_samples += (uint32_t)__builtin_popcountll(block->part);
	}
}

static void bound_cluster(const struct psr_blocks *blocks, struct psr_cluster *cluster)
{
	float min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };

	for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
		float c[3], r;

		psr_blocks_sphere(blocks, i, c, &r);
		for (int k = 0; k < 3; k++) {
			min[k] = c[k] - r < min[k] ? c[k] - r : min[k];
			max[k] = c[k] + r > max[k] ? c[k] + r : max[k];
		}
	}
	for (int k = 0; k < 3; k++)
		cluster->center[k] = (min[k] + max[k]) / 2;
	for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
		float d[3], r, reach;

		psr_blocks_sphere(blocks, i, d, &r);
		v3f_sub(d, d, cluster->center);
		reach = (v3f_length(d) + r) * (1 + (float)SLACK) + (float)SLACK;
		cluster->radius = reach > cluster->radius ? reach : cluster->radius;
	}
}

static int is_new_cluster(const struct pack *pack, uint32_t i)
{
	return i == 0 || pack->order[i].group != pack->order[i - 1].group ||
	       pack->order[i].level != pack->order[i - 1].level;
}

static void count_clusters(struct pack *pack)
{
	pack->n_clusters = 0;
	for (uint32_t i = 0; i < pack->draft->n_blocks; i++)
		pack->n_clusters += (uint32_t)is_new_cluster(pack, i);
}

static void pack_clusters(struct pack *pack)
{
	const struct psr_blocks spheres = { .sphere_x = pack->center[0], .sphere_y = pack->center[1],
		                                .sphere_z = pack->center[2], .sphere_r = pack->radius };
	uint32_t c = 0;

	memset(pack->cluster, 0, pack->n_clusters * sizeof *pack->cluster);
	for (uint32_t i = 0; i < pack->draft->n_blocks; i++) {
		if (is_new_cluster(pack, i))
			pack->cluster[c++] = (struct psr_cluster){ .first_block = i, .group = pack->order[i].group,
				                                       .level = pack->order[i].level };
		pack->cluster[c - 1].n_blocks++;
	}
	for (c = 0; c < pack->n_clusters; c++)
		bound_cluster(&spheres, &pack->cluster[c]);
}

static int pack_alloc(struct pack *pack, size_t n_blocks, size_t n_samples, size_t n_clusters)
{
	int failed = 0;

#define ALLOC(array, n) failed |= ((array) = psr_alloc_array(n, sizeof *(array))) == NULL
	ALLOC(pack->cluster, n_clusters);
	for (int k = 0; k < 3; k++) {
		ALLOC(pack->center[k], n_blocks);
		ALLOC(pack->cone[k], n_blocks);
	}
	ALLOC(pack->radius, n_blocks);
	ALLOC(pack->cone_sine, n_blocks);
	ALLOC(pack->block_projection, n_blocks);
	ALLOC(pack->depth, n_samples + PSR_BLOCK_SAMPLES);
	ALLOC(pack->flags, n_blocks);
	ALLOC(pack->traits, n_blocks);
	ALLOC(pack->mask, n_blocks);
	ALLOC(pack->attr, n_samples);
	ALLOC(pack->attr_offset, n_blocks);
	ALLOC(pack->run, n_blocks / PSR_RUN_BLOCKS + 1);
#undef ALLOC
	return failed ? PSR_ERR_MEMORY : PSR_OK;
}

static void pack_fini(struct pack *pack)
{
	psr_free(pack->order);
	psr_free(pack->cluster);
	for (int k = 0; k < 3; k++) {
		psr_free(pack->center[k]);
		psr_free(pack->cone[k]);
	}
	psr_free(pack->radius);
	psr_free(pack->cone_sine);
	psr_free(pack->block_projection);
	psr_free(pack->depth);
	psr_free(pack->flags);
	psr_free(pack->traits);
	psr_free(pack->mask);
	psr_free(pack->attr);
	psr_free(pack->attr_offset);
	psr_free(pack->run);
}

static uint64_t count_samples(const struct draft *draft)
{
	uint64_t n = 0;

	for (uint32_t i = 0; i < draft->n_blocks; i++)
		n += (uint64_t)__builtin_popcountll(draft->block[i].part);
	return n;
}

/* Masks, and what culling by them and by cones loses. */
static int add_visibility(struct pack *pack, struct psr_blocks *blocks, struct visibility_table *table,
                          struct psr_model_info *info, struct psr_pool *pool)
{
	uint64_t (*mask)[2] = psr_alloc_array(blocks->n_blocks, sizeof *mask);
	int rc = mask != NULL ? visibility_masks(blocks, pool, mask) : PSR_ERR_MEMORY;

	if (rc == PSR_OK && !visibility_is_full(blocks->n_blocks, (const uint64_t(*)[2])mask))
		rc = visibility_table_make(table, blocks, (const uint64_t(*)[2])mask, pack->run, pool);
	psr_free(mask);
	if (rc != PSR_OK)
		return rc;
	blocks->n_masks = table->n_masks;
	blocks->visibility_mask = (const uint64_t(*)[2])table->mask;
	blocks->visibility_index = table->index;
	return visibility_lost(blocks, pack->scene, info->n_trials, pool, &info->n_lost);
}

static int has_traits(const struct pack *pack)
{
	uint8_t any = 0;

	for (uint32_t i = 0; i < pack->draft->n_blocks; i++)
		any |= pack->traits[i];
	return any != 0;
}

static int make_model(struct psr_model **out, struct psr_model_info *info, const struct psr_presets *presets,
                      struct pack *pack, struct psr_pool *pool, struct psr_error *err)
{
	struct visibility_table table = { 0 };
	struct psr_blocks blocks = { .n_blocks = pack->draft->n_blocks, .n_projections = N_PROJECTIONS,
		                         .n_clusters = pack->n_clusters, .n_levels = pack->draft->n_levels,
		                         .n_samples = pack->n_samples };
	int rc;

	blocks.projection = pack->draft->projection;
	blocks.cluster = pack->cluster;
	blocks.sphere_x = pack->center[0];
	blocks.sphere_y = pack->center[1];
	blocks.sphere_z = pack->center[2];
	blocks.sphere_r = pack->radius;
	blocks.cone_x = pack->cone[0];
	blocks.cone_y = pack->cone[1];
	blocks.cone_z = pack->cone[2];
	blocks.cone_sine = pack->cone_sine;
	blocks.block_projection = pack->block_projection;
	blocks.flags = pack->flags;
	blocks.traits = has_traits(pack) ? pack->traits : NULL;
	blocks.mask = pack->mask;
	blocks.attr_offset = pack->attr_offset;
	blocks.run = pack->run;
	blocks.depth = pack->depth;
	blocks.attr = pack->attr;
	for (int k = 0; k < 3; k++) {
		info->box_min[k] = info->origin[k] + info->scale * pack->box_min[k];
		info->box_max[k] = info->origin[k] + info->scale * pack->box_max[k];
	}
	rc = add_visibility(pack, &blocks, &table, info, pool);
	if (rc != PSR_OK)
		psr_fail(err, rc, "no memory for the visibility masks of %u blocks", blocks.n_blocks);
	else
		rc = psr_model_create(out, info, &blocks, presets, err);
	visibility_table_fini(&table);
	return rc;
}

int pack_model(struct psr_model **out, struct psr_model_info *info, const struct psr_presets *presets,
               const struct ray_scene *scene, const struct draft *draft, struct psr_pool *pool, struct psr_error *err)
{
	struct pack pack = { .scene = scene, .draft = draft };
	uint64_t n_samples = count_samples(draft);
	int rc;

	if (n_samples > UINT32_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "%llu samples are more than a model can hold; use a lower resolution",
		                (unsigned long long)n_samples);
	pack.order = psr_alloc_array(draft->n_blocks, sizeof *pack.order);
	if (pack.order == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model of %u blocks", draft->n_blocks);
	sort_blocks(&pack);
	count_clusters(&pack);
	if (pack_alloc(&pack, draft->n_blocks, n_samples, pack.n_clusters) != PSR_OK) {
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory for a model of %u blocks", draft->n_blocks);
	} else {
		pack_blocks(&pack);
		pack_clusters(&pack);
		rc = make_model(out, info, presets, &pack, pool, err);
	}
	pack_fini(&pack);
	return rc;
}
