/* The shares of the cull: blocks by their order; of cubes the ones that are chosen and may be in view, by level. */
#include "cull.h"

/* Blocks of a chunk; some tens of chunks give threads enough to share. */
#define LEAST_CHUNK 256
#define MANY_CHUNKS 64

static uint32_t n_groups_of(const struct psr_blocks *b)
{
	return b->n_clusters / b->n_levels;
}

/* Cubes of groups that follow each other. */
struct span {
	uint32_t first, n; /* n: 0 out of view */
	uint32_t cluster, n_groups;
	unsigned level;
};

/* Of a group, and of those that are known to be alike. */
static struct span span_of(const struct bins *bins, const struct plan_instance *in, uint32_t group)
{
	const struct psr_blocks *b = in->cull.blocks;
	const struct cull_group *g = &bins->group[in->first_group + group];
	const uint32_t cluster = g->level * n_groups_of(b) + group;
	struct span span = { .cluster = cluster, .n_groups = g->n_alike, .level = g->level };

	if (g->is_out)
		return span;
	const struct psr_cluster *last = &b->cluster[cluster + g->n_alike - 1];
	span.first = b->cluster[cluster].first_block;
	span.n = last->first_block + last->n_blocks - span.first;
	return span;
}

static uint64_t count_blocks(const struct bins *bins, const struct plan *plan)
{
	uint64_t n = 0;

	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct plan_instance *in = &plan->instance[i];
		struct span span;

		if (in->cull.cubes == NULL) {
			n += in->cull.blocks->n_blocks;
			continue;
		}
		for (uint32_t g = 0; g < n_groups_of(in->cull.blocks) && !plan_is_cancelled(plan); g += span.n_groups) {
			span = span_of(bins, in, g);
			n += span.n;
		}
	}
	return n;
}

static uint32_t put_blocks(struct cull_chunk *chunk, const struct psr_blocks *blocks, uint32_t instance, uint32_t most)
{
	uint32_t k = 0, n = 0;

	for (uint32_t first = 0; first < blocks->n_blocks; first += most, n++) {
		const uint32_t left = blocks->n_blocks - first;

		while (blocks->cluster[k].first_block + blocks->cluster[k].n_blocks <= first)
			k++;
		chunk[n] = (struct cull_chunk){ .instance = instance, .first_cluster = k, .first_block = first,
			                            .n_blocks = left < most ? left : most };
	}
	return n;
}

/* Each level has a chunk that grows, group by group, until its chosen cubes are as many as a chunk may have. */
static uint32_t put_cubes(struct cull_chunk *chunk, const struct bins *bins, const struct plan *plan, uint32_t instance,
                          uint32_t most)
{
	const struct plan_instance *in = &plan->instance[instance];
	struct cull_chunk open[CUBES_MOST_LEVELS];
	uint32_t n_open[CUBES_MOST_LEVELS] = { 0 }, n = 0;
	struct span span;

	for (uint32_t g = 0, took; g < n_groups_of(in->cull.blocks) && !plan_is_cancelled(plan); g += span.n_groups) {
		span = span_of(bins, in, g);
		struct cull_chunk *to = &open[span.level];
		uint32_t *n_own = &n_open[span.level];

		for (uint32_t first = span.first, left = span.n; left > 0; left -= took, first += took) {
			if (*n_own == 0)
				*to = (struct cull_chunk){ .instance = instance, .first_block = first, .first_cluster = span.cluster };
			took = left < most - *n_own ? left : most - *n_own;
			to->n_blocks = first + took - to->first_block;
			*n_own += took;
			if (*n_own == most) {
				chunk[n++] = *to;
				*n_own = 0;
			}
		}
	}
	for (int l = 0; l < CUBES_MOST_LEVELS; l++)
		if (n_open[l] > 0)
			chunk[n++] = open[l];
	return n;
}

int cull_make_chunks(struct bins *bins, const struct plan *plan, uint32_t *n_chunks)
{
	const uint64_t n_blocks = count_blocks(bins, plan), share = n_blocks / MANY_CHUNKS;
	const uint64_t least = share > LEAST_CHUNK ? share : LEAST_CHUNK;
	const uint32_t most = (uint32_t)(least < CULL_MOST_CHUNK ? least : CULL_MOST_CHUNK);
	uint32_t n = 0;

	/* All but the last ones of an instance, of cubes of its levels, are full. */
	if (!bins_room(bins, chunk, n_blocks / most + (size_t)plan->n_instances * CUBES_MOST_LEVELS))
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < plan->n_instances && !plan_is_cancelled(plan); i++) {
		const struct plan_instance *in = &plan->instance[i];

		n += in->cull.cubes != NULL ? put_cubes(bins->chunk + n, bins, plan, i, most)
		                            : put_blocks(bins->chunk + n, in->cull.blocks, i, most);
	}
	*n_chunks = n;
	return plan_is_cancelled(plan) ? PSR_ERR_CANCELLED : PSR_OK;
}
