#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/mem.h"
#include "../base/vec.h"
#include "cone.h"
#include "pack.h"
#include "projection.h"

#define CLUSTER_BLOCKS 64

/* Spheres are made from rounded positions; this much more holds the exact ones (a few roundings of 2^-24 each). */
#define SLACK 0x1p-21f

struct order {
	uint64_t code;
	uint32_t block; /* of the selection */
};

struct pack {
	const struct ray_scene *scene;
	const struct lattice *lattice;
	const struct selection *selection;
	const struct psr_projection *projection;
	struct order *order;
	struct psr_cluster *cluster;
	float *sphere[4], *cone[4], *depth_bias, *depth_step; /* sphere: x, y, z, r; cone: x, y, z, cosine */
	uint16_t *block_projection, *depth;
	int16_t *col, *row;
	uint8_t *level, *flags;
	uint64_t *mask, *attr;
	uint32_t *attr_first;
	double box_min[3], box_max[3];
};

static void inner_position(const struct psr_projection *projection, double x, double y, double z, double position[3])
{
	for (int k = 0; k < 3; k++)
		position[k] = x * (double)projection->axis[0][k] + y * (double)projection->axis[1][k]
		              + z * (double)projection->axis[2][k];
}

/* Box of a block's samples in projection space. */
static void projection_box(const struct lattice *lattice, const struct selected_block *block, double min[3],
                           double max[3])
{
	v3d_set(min, INFINITY, INFINITY, INFINITY);
	v3d_set(max, -INFINITY, -INFINITY, -INFINITY);
	for (uint64_t left = block->mask; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		double p[3];

		lattice_position(&lattice->projection, lattice->col[block->block], lattice->row[block->block], s, &p[0], &p[1]);
		p[2] = (double)lattice->sample[block->block][s].z;
		for (int k = 0; k < 3; k++) {
			min[k] = p[k] < min[k] ? p[k] : min[k];
			max[k] = p[k] > max[k] ? p[k] : max[k];
		}
	}
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

	return x->code != y->code ? (x->code < y->code ? -1 : 1) : x->block < y->block ? -1 : x->block > y->block;
}

static void sort_blocks(struct pack *pack)
{
	for (uint32_t i = 0; i < pack->selection->n_blocks; i++) {
		const struct selected_block *block = &pack->selection->block[i];
		const struct lattice *lattice = &pack->lattice[block->projection];
		double min[3], max[3], center[3];

		projection_box(lattice, block, min, max);
		inner_position(&lattice->projection, (min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2,
		               center);
		pack->order[i].code = morton(center);
		pack->order[i].block = i;
	}
	qsort(pack->order, pack->selection->n_blocks, sizeof *pack->order, compare_order);
}

/* Depths as 16 bits of the block's own range. */
static void quantise(struct pack *pack, uint32_t i, const struct lattice_sample *sample, double min, double max)
{
	float bias = (float)min, step = (float)((max - min) / 65535);
	uint16_t *depth = pack->depth + pack->attr_first[i];

	for (uint64_t left = pack->mask[i]; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		double q = step > 0 ? ((double)sample[s].z - (double)bias) / (double)step + 0.5 : 0;

		*depth++ = q < 65535 ? (uint16_t)q : 65535;
	}
	pack->depth_bias[i] = bias;
	pack->depth_step[i] = step;
}

/* Around the middle of the box; through the samples as they will be read back, and half a step beyond. */
static void bound_block(struct pack *pack, uint32_t i, const struct psr_projection *projection, const double min[3],
                        const double max[3])
{
	const uint16_t *depth = pack->depth + pack->attr_first[i];
	double center[3], radius = 0;
	float rounded[3];

	inner_position(projection, (min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2, center);
	for (int k = 0; k < 3; k++) {
		rounded[k] = (float)center[k];
		pack->sphere[k][i] = rounded[k];
	}
	for (uint64_t left = pack->mask[i]; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		double x, y, position[3], squared = 0;
		float z = pack->depth_bias[i] + pack->depth_step[i] * (float)*depth++;

		lattice_position(projection, pack->col[i], pack->row[i], s, &x, &y);
		inner_position(projection, x, y, (double)z, position);
		for (int k = 0; k < 3; k++) {
			double d = position[k] - (double)rounded[k];

			squared += d * d;
			pack->box_min[k] = position[k] < pack->box_min[k] ? position[k] : pack->box_min[k];
			pack->box_max[k] = position[k] > pack->box_max[k] ? position[k] : pack->box_max[k];
		}
		radius = squared > radius ? squared : radius;
	}
	pack->sphere[3][i] = (float)(sqrt(radius) + (double)projection->spacing / 2) * (1 + SLACK) + SLACK;
}

static void pack_blocks(struct pack *pack)
{
	uint32_t n_samples = 0;

	v3d_set(pack->box_min, INFINITY, INFINITY, INFINITY);
	v3d_set(pack->box_max, -INFINITY, -INFINITY, -INFINITY);
	for (uint32_t i = 0; i < pack->selection->n_blocks; i++) {
		const struct selected_block *block = &pack->selection->block[pack->order[i].block];
		const struct lattice *lattice = &pack->lattice[block->projection];
		uint32_t n = (uint32_t)__builtin_popcountll(block->mask);
		double min[3], max[3];

		projection_box(lattice, block, min, max);
		pack->block_projection[i] = block->projection;
		pack->col[i] = lattice->col[block->block];
		pack->row[i] = lattice->row[block->block];
		pack->level[i] = 0;
		pack->flags[i] = block->two_sided ? PSR_BLOCK_TWO_SIDED : 0;
		pack->mask[i] = block->mask;
		pack->attr_first[i] = n_samples;
		memcpy(pack->attr + n_samples, pack->selection->attr + block->first, n * sizeof *pack->attr);
		quantise(pack, i, lattice->sample[block->block], min[2], max[2]);
		bound_block(pack, i, &lattice->projection, min, max);
		float axis[3];
		cone_bound(pack->scene, lattice->sample[block->block], block->mask, axis, &pack->cone[3][i]);
		for (int k = 0; k < 3; k++)
			pack->cone[k][i] = axis[k];
		n_samples += n;
	}
}

static void bound_cluster(const struct pack *pack, struct psr_cluster *cluster)
{
	float min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };

	for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
		for (int k = 0; k < 3; k++) {
			float c = pack->sphere[k][i], r = pack->sphere[3][i];

			min[k] = c - r < min[k] ? c - r : min[k];
			max[k] = c + r > max[k] ? c + r : max[k];
		}
	}
	for (int k = 0; k < 3; k++)
		cluster->center[k] = (min[k] + max[k]) / 2;
	for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
		float d[3] = { pack->sphere[0][i], pack->sphere[1][i], pack->sphere[2][i] }, reach;

		v3f_sub(d, d, cluster->center);
		reach = (v3f_length(d) + pack->sphere[3][i]) * (1 + SLACK) + SLACK;
		cluster->radius = reach > cluster->radius ? reach : cluster->radius;
	}
}

static void pack_clusters(struct pack *pack, uint32_t n_clusters)
{
	uint32_t n_blocks = (uint32_t)pack->selection->n_blocks;

	memset(pack->cluster, 0, n_clusters * sizeof *pack->cluster);
	for (uint32_t i = 0; i < n_clusters; i++) {
		struct psr_cluster *cluster = &pack->cluster[i];
		uint32_t left = n_blocks - CLUSTER_BLOCKS * i;

		cluster->group = i;
		cluster->first_block = CLUSTER_BLOCKS * i;
		cluster->n_blocks = left < CLUSTER_BLOCKS ? left : CLUSTER_BLOCKS;
		bound_cluster(pack, cluster);
	}
}

static int pack_alloc(struct pack *pack, size_t n_blocks, size_t n_samples, size_t n_clusters)
{
	int failed = 0;

#define ALLOC(array, n) failed |= ((array) = psr_alloc_array(n, sizeof *(array))) == NULL
	ALLOC(pack->order, n_blocks);
	ALLOC(pack->cluster, n_clusters);
	for (int k = 0; k < 4; k++) {
		ALLOC(pack->sphere[k], n_blocks);
		ALLOC(pack->cone[k], n_blocks);
	}
	ALLOC(pack->depth_bias, n_blocks);
	ALLOC(pack->depth_step, n_blocks);
	ALLOC(pack->block_projection, n_blocks);
	ALLOC(pack->depth, n_samples);
	ALLOC(pack->col, n_blocks);
	ALLOC(pack->row, n_blocks);
	ALLOC(pack->level, n_blocks);
	ALLOC(pack->flags, n_blocks);
	ALLOC(pack->mask, n_blocks);
	ALLOC(pack->attr, n_samples);
	ALLOC(pack->attr_first, n_blocks);
#undef ALLOC
	return failed ? PSR_ERR_MEMORY : PSR_OK;
}

static void pack_fini(struct pack *pack)
{
	psr_free(pack->order);
	psr_free(pack->cluster);
	for (int k = 0; k < 4; k++) {
		psr_free(pack->sphere[k]);
		psr_free(pack->cone[k]);
	}
	psr_free(pack->depth_bias);
	psr_free(pack->depth_step);
	psr_free(pack->block_projection);
	psr_free(pack->depth);
	psr_free(pack->col);
	psr_free(pack->row);
	psr_free(pack->level);
	psr_free(pack->flags);
	psr_free(pack->mask);
	psr_free(pack->attr);
	psr_free(pack->attr_first);
}

static int make_model(struct psr_model **out, struct psr_model_info *info, const struct psr_presets *presets,
                      struct pack *pack, struct psr_error *err)
{
	uint32_t n_blocks = (uint32_t)pack->selection->n_blocks;
	struct psr_blocks blocks = { .n_blocks = n_blocks, .n_projections = MOST_PROJECTIONS,
		                         .n_clusters = (n_blocks + CLUSTER_BLOCKS - 1) / CLUSTER_BLOCKS, .n_levels = 1,
		                         .n_samples = pack->selection->n_samples };

	if (pack_alloc(pack, n_blocks, blocks.n_samples, blocks.n_clusters) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model of %u blocks", n_blocks);
	sort_blocks(pack);
	pack_blocks(pack);
	pack_clusters(pack, blocks.n_clusters);
	blocks.projection = pack->projection;
	blocks.cluster = pack->cluster;
	blocks.sphere_x = pack->sphere[0];
	blocks.sphere_y = pack->sphere[1];
	blocks.sphere_z = pack->sphere[2];
	blocks.sphere_r = pack->sphere[3];
	blocks.cone_x = pack->cone[0];
	blocks.cone_y = pack->cone[1];
	blocks.cone_z = pack->cone[2];
	blocks.cone_cos = pack->cone[3];
	blocks.block_projection = pack->block_projection;
	blocks.col = pack->col;
	blocks.row = pack->row;
	blocks.level = pack->level;
	blocks.flags = pack->flags;
	blocks.depth_bias = pack->depth_bias;
	blocks.depth_step = pack->depth_step;
	blocks.mask = pack->mask;
	blocks.attr_first = pack->attr_first;
	blocks.depth = pack->depth;
	blocks.attr = pack->attr;
	for (int k = 0; k < 3; k++) {
		info->box_min[k] = info->origin[k] + info->scale * pack->box_min[k];
		info->box_max[k] = info->origin[k] + info->scale * pack->box_max[k];
	}
	return psr_model_create(out, info, &blocks, presets, err);
}

int pack_model(struct psr_model **out, struct psr_model_info *info, const struct psr_presets *presets,
               const struct ray_scene *scene,
               const struct psr_projection *projection, const struct lattice *lattice,
               const struct selection *selection, struct psr_error *err)
{
	struct pack pack = { .scene = scene, .projection = projection, .lattice = lattice, .selection = selection };
	int rc;

	if (selection->n_samples > UINT32_MAX || selection->n_blocks > UINT32_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "%zu samples are more than a model can hold; use a lower resolution",
		                selection->n_samples);
	rc = make_model(out, info, presets, &pack, err);
	pack_fini(&pack);
	return rc;
}
