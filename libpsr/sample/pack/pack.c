#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "base/vec.h"
#include "pack.h"
#include "pack_block.h"
#include "visibility_mask.h"
#include "visibility_mask_table.h"

struct order {
	uint64_t code;
	uint32_t block; /* of the draft */
	uint32_t group;
	uint8_t level;
};

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

static void sort_blocks(struct order *order, const struct draft *draft)
{
	for (uint32_t i = 0; i < draft->n_blocks; i++) {
		const struct draft_block *block = &draft->block[i];
		double min[3], max[3], middle[3];

		pack_box(draft, block, min, max);
		projection_inner(&draft->projection[block->projection], (min[0] + max[0]) / 2, (min[1] + max[1]) / 2,
		                 (min[2] + max[2]) / 2, middle);
		order[i] = (struct order){ morton(middle), i, block->group, block->level };
	}
	qsort(order, draft->n_blocks, sizeof *order, compare_order);
}

static int is_new_cluster(const struct order *order, uint32_t i)
{
	return i == 0 || order[i].group != order[i - 1].group || order[i].level != order[i - 1].level;
}

static uint32_t count_clusters(const struct order *order, uint32_t n_blocks)
{
	uint32_t n = 0;

	for (uint32_t i = 0; i < n_blocks; i++)
		n += (uint32_t)is_new_cluster(order, i);
	return n;
}

static void pack_blocks(struct pack *pack, const struct order *order)
{
	v3d_set(pack->box_min, INFINITY, INFINITY, INFINITY);
	v3d_set(pack->box_max, -INFINITY, -INFINITY, -INFINITY);
	for (uint32_t i = 0; i < pack->draft->n_blocks; i++)
		pack_block(pack, i, &pack->draft->block[order[i].block]);
}

static void pack_clusters(struct pack *pack, const struct order *order)
{
	const struct psr_blocks spheres = { .sphere_x = pack->center[0], .sphere_y = pack->center[1],
		                                .sphere_z = pack->center[2], .sphere_r = pack->radius };
	uint32_t c = 0;

	for (uint32_t i = 0; i < pack->draft->n_blocks; i++) {
		if (is_new_cluster(order, i))
			pack->cluster[c++] = (struct psr_cluster){ .first_block = i, .group = order[i].group,
				                                       .level = order[i].level };
		pack->cluster[c - 1].n_blocks++;
	}
	for (c = 0; c < pack->n_clusters; c++)
		pack_bound_cluster(&spheres, &pack->cluster[c]);
}

/* All arrays of a pack, with their elements. */
#define EACH_ARRAY(DO) \
	DO(cluster, pack->n_clusters) \
	DO(center[0], n_blocks) \
	DO(center[1], n_blocks) \
	DO(center[2], n_blocks) \
	DO(cone[0], n_blocks) \
	DO(cone[1], n_blocks) \
	DO(cone[2], n_blocks) \
	DO(radius, n_blocks) \
	DO(cone_sine, n_blocks) \
	DO(block_projection, n_blocks) \
	DO(flags, n_blocks) \
	DO(traits, n_blocks) \
	DO(mask, n_blocks) \
	DO(attr_offset, n_blocks) \
	DO(run, n_blocks / PSR_RUN_BLOCKS + 1) \
	DO(depth, n_samples + PSR_BLOCK_SAMPLES) \
	DO(attr, n_samples) \
	DO(opacity, n_samples)

static int pack_alloc(struct pack *pack, size_t n_blocks, size_t n_samples)
{
	int failed = 0;

#define ALLOC(array, n) failed |= (pack->array = psr_alloc_array(n, sizeof *pack->array)) == NULL;
	EACH_ARRAY(ALLOC)
	return failed ? PSR_ERR_MEMORY : PSR_OK;
}

static void pack_fini(struct pack *pack)
{
#define FREE(array, n) psr_free(pack->array);
	EACH_ARRAY(FREE)
}

static uint64_t count_samples(const struct draft *draft)
{
	uint64_t n = 0;

	for (uint32_t i = 0; i < draft->n_blocks; i++)
		n += (uint64_t)__builtin_popcountll(draft->block[i].part);
	return n;
}

/* Makes masks, and measures how many samples are lost when masks and cones cull. */
static int add_visibility(struct pack *pack, struct psr_blocks *blocks, struct visibility_mask_table *table,
                          struct psr_model_info *info, struct psr_pool *pool)
{
	uint64_t (*mask)[2] = psr_alloc_array(blocks->n_blocks, sizeof *mask);
	int rc = mask != NULL ? visibility_mask_make(blocks, pool, mask) : PSR_ERR_MEMORY;

	if (rc == PSR_OK && !visibility_mask_is_full(blocks->n_blocks, (const uint64_t(*)[2])mask))
		rc = visibility_mask_table_make(table, blocks, (const uint64_t(*)[2])mask, pack->run, pool);
	psr_free(mask);
	if (rc != PSR_OK)
		return rc;
	blocks->n_masks = table->n_masks;
	blocks->visibility_mask = (const uint64_t(*)[2])table->mask;
	blocks->visibility_index = table->index;
	return visibility_mask_lost(blocks, pack->scene, info->n_trials, pool, &info->n_lost);
}

/* all blocks' bits, OR-ed */
static uint8_t find_traits(const struct pack *pack)
{
	uint8_t any = 0;

	for (uint32_t i = 0; i < pack->draft->n_blocks; i++)
		any |= pack->traits[i];
	return any;
}

static int make_model(struct psr_model **out, struct psr_model_info *info, const struct pack_source *source,
                      struct pack *pack, struct psr_error *err)
{
	struct visibility_mask_table table = { 0 };
	struct psr_blocks blocks = { .n_blocks = pack->draft->n_blocks, .n_projections = N_PROJECTIONS,
		                         .n_clusters = pack->n_clusters, .n_levels = pack->draft->n_levels,
		                         .n_samples = pack->n_samples };
	const uint8_t traits = find_traits(pack);
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
	blocks.traits = traits != 0 ? pack->traits : NULL;
	blocks.opacity = (traits & PSR_BLOCK_SHEER) != 0 ? pack->opacity : NULL;
	blocks.mask = pack->mask;
	blocks.attr_offset = pack->attr_offset;
	blocks.run = pack->run;
	blocks.depth = pack->depth;
	blocks.attr = pack->attr;
	for (int k = 0; k < 3; k++) {
		info->box_min[k] = info->origin[k] + info->scale * pack->box_min[k];
		info->box_max[k] = info->origin[k] + info->scale * pack->box_max[k];
	}
	rc = add_visibility(pack, &blocks, &table, info, source->pool);
	if (rc != PSR_OK)
		psr_fail(err, rc, "no memory for the visibility masks of %u blocks", blocks.n_blocks);
	else
		rc = psr_model_create(out, info, &blocks, source->presets, err);
	visibility_mask_table_fini(&table);
	return rc;
}

int pack_model(struct psr_model **out, struct psr_model_info *info, const struct pack_source *source,
               struct psr_error *err)
{
	const struct draft *draft = source->draft;
	struct pack pack = { .scene = source->scene, .surface = source->surface, .draft = draft };
	struct order *order = psr_alloc_array(draft->n_blocks, sizeof *order);
	uint64_t n_samples = count_samples(draft);
	int rc = order != NULL ? PSR_OK : PSR_ERR_MEMORY;

	if (rc == PSR_OK && n_samples > UINT32_MAX)
		rc = psr_fail(err, PSR_ERR_LIMIT, "%llu samples are more than a model can hold; use a lower resolution",
		              (unsigned long long)n_samples);
	if (rc == PSR_OK) {
		sort_blocks(order, draft);
		pack.n_clusters = count_clusters(order, draft->n_blocks);
		rc = pack_alloc(&pack, draft->n_blocks, n_samples);
	}
	if (rc == PSR_ERR_MEMORY)
		psr_fail(err, rc, "no memory for a model of %u blocks", draft->n_blocks);
	if (rc == PSR_OK) {
		pack_blocks(&pack, order);
		pack_clusters(&pack, order);
		rc = make_model(out, info, source, &pack, err);
	}
	psr_free(order);
	pack_fini(&pack);
	return rc;
}
