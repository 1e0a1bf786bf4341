#include "cull.h"

#include <string.h>
#include "base/mem.h"

/* Blocks in one piece of memory: arrays one after the other. */
struct part {
	struct psr_blocks blocks;
	struct psr_cluster *cluster;
	struct psr_run *run;
	uint16_t *radius, *depth, *attr_offset;
	int16_t *center[3];
	uint8_t *projection, *flags;
	uint64_t *mask, *attr;
	void *memory;
};

static void *take(uintptr_t *at, size_t n, size_t size)
{
	void *array = (void *)*at;

	*at += (n * size + PSR_ALIGNMENT - 1) / PSR_ALIGNMENT * PSR_ALIGNMENT;
	return array;
}

/* Returns where the last one ends. */
static uintptr_t place_arrays(struct part *part, uintptr_t at, const struct psr_blocks *all)
{
	size_t n = all->n_blocks;

	part->cluster = take(&at, all->n_clusters, sizeof *part->cluster);
	part->run = take(&at, psr_blocks_runs(all), sizeof *part->run);
	for (int k = 0; k < 3; k++)
		part->center[k] = take(&at, n, sizeof *part->center[k]);
	part->radius = take(&at, n, sizeof *part->radius);
	part->projection = take(&at, n, sizeof *part->projection);
	part->flags = take(&at, n, sizeof *part->flags);
	part->mask = take(&at, n, sizeof *part->mask);
	part->attr_offset = take(&at, n, sizeof *part->attr_offset);
	part->attr = take(&at, all->n_samples, sizeof *part->attr);
	part->depth = take(&at, all->n_samples, sizeof *part->depth);
	return at;
}

static int part_init(struct part *part, const struct psr_blocks *all)
{
	part->memory = psr_alloc_array(place_arrays(part, 0, all), 1);
	if (part->memory == NULL)
		return PSR_ERR_MEMORY;
	place_arrays(part, (uintptr_t)part->memory, all);
	part->blocks = (struct psr_blocks){ .n_projections = all->n_projections, .n_levels = 1,
		.projection = all->projection, .cluster = part->cluster, .run = part->run, .sphere_x = part->center[0],
		.sphere_y = part->center[1], .sphere_z = part->center[2], .sphere_r = part->radius,
		.block_projection = part->projection, .flags = part->flags, .mask = part->mask,
		.attr_offset = part->attr_offset, .depth = part->depth, .attr = part->attr };
	return PSR_OK;
}

static void add_block(struct part *part, const struct psr_blocks *all, uint32_t b)
{
	struct psr_blocks *blocks = &part->blocks;
	uint32_t to = blocks->n_blocks++, from = psr_blocks_attr_first(all, b),
			 n = (uint32_t)__builtin_popcountll(all->mask[b]);

	part->center[0][to] = all->sphere_x[b];
	part->center[1][to] = all->sphere_y[b];
	part->center[2][to] = all->sphere_z[b];
	part->radius[to] = all->sphere_r[b];
	part->projection[to] = all->block_projection[b];
	part->flags[to] = all->flags[b];
	part->mask[to] = all->mask[b];
	if (to % PSR_RUN_BLOCKS == 0)
		part->run[to / PSR_RUN_BLOCKS] = (struct psr_run){ .attr_first = (uint32_t)blocks->n_samples };
	part->attr_offset[to] = (uint16_t)(blocks->n_samples - part->run[to / PSR_RUN_BLOCKS].attr_first);
	memcpy(part->attr + blocks->n_samples, all->attr + from, n * sizeof *part->attr);
	memcpy(part->depth + blocks->n_samples, all->depth + from, n * sizeof *part->depth);
	blocks->n_samples += n;
}

static void add_cluster(struct part *part, const struct psr_blocks *all, const struct psr_cluster *cluster,
                        const uint8_t *is_kept, uint32_t *index)
{
	struct psr_blocks *blocks = &part->blocks;
	struct psr_cluster *to = &part->cluster[blocks->n_clusters];

	*to = *cluster;
	to->first_block = blocks->n_blocks;
	to->group = blocks->n_clusters;
	for (uint32_t b = cluster->first_block; b < cluster->first_block + cluster->n_blocks; b++) {
		if (is_kept != NULL && !is_kept[b])
			continue;
		if (index != NULL)
			index[blocks->n_blocks] = b;
		add_block(part, all, b);
	}
	to->n_blocks = blocks->n_blocks - to->first_block;
	blocks->n_clusters += to->n_blocks != 0;
}

int cull_part(struct psr_model **out, const struct psr_model *model, const uint8_t *is_kept, uint32_t *index,
              struct psr_error *err)
{
	const struct psr_blocks *all = psr_model_blocks(model);
	struct psr_model_info info = *psr_model_info(model);
	struct part part;
	int rc = part_init(&part, all);

	if (rc != PSR_OK)
		return psr_fail(err, rc, "no memory for a part of a model");
	for (uint32_t c = 0; c < all->n_clusters; c++)
		if (all->cluster[c].level == 0)
			add_cluster(&part, all, &all->cluster[c], is_kept, index);
	for (int k = 0; k < 3; k++) {
		info.origin[k] = 0;
		info.box_min[k] = -1;
		info.box_max[k] = 1;
	}
	info.spacing /= info.scale;
	info.scale = 1;
	rc = part.blocks.n_blocks != 0 ? psr_model_create(out, &info, &part.blocks, NULL, err)
	                               : psr_fail(err, PSR_ERR_ARG, "a part of a model needs a block; none is kept");
	psr_free(part.memory);
	return rc;
}
