#include <stdatomic.h>
#include <string.h>
#include "base/direction.h"
#include "base/mem.h"
#include "cone.h"
#include "visibility_mask_table.h"

#define TRIANGLE_LEVEL 2
#define N_CORNERS 66
#define MOST_MASKS (PSR_RUN_BLOCKS / VISIBILITY_MASK_SHARE)
#define NEAR 8 /* a group may join the best of so many groups after it */
#define NONE UINT32_MAX

/* Blocks that share a mask, in a list of such groups. */
struct group {
	uint64_t seen[2];                  /* the mask: directions from which one of the blocks is seen */
	uint64_t hidden[2];                /* directions from which culling a block depends on its mask */
	uint32_t lost[PSR_MASK_TRIANGLES]; /* samples of hidden blocks, for each direction that is not seen */
	uint32_t previous, next;
	uint32_t other, cost; /* the best of the next groups to join; its loss in samples times directions */
};

struct corners {
	float direction[N_CORNERS][3];
	uint8_t of[PSR_MASK_TRIANGLES][3];
};

struct job {
	const struct psr_blocks *blocks;
	const uint64_t (*mask)[2];
	struct corners corners;
	uint64_t (*table)[2]; /* MOST_MASKS a run */
	uint32_t *n_masks;    /* a run */
	uint8_t *index;
	atomic_int failed;
};

static void make_corners(struct corners *corners)
{
	unsigned n = 0;

	for (unsigned t = 0; t < PSR_MASK_TRIANGLES; t++) {
		double corner[3][3];

		psr_direction_corners(TRIANGLE_LEVEL, t, corner);
		for (int i = 0; i < 3; i++) {
			const float v[3] = { (float)corner[i][0], (float)corner[i][1], (float)corner[i][2] };
			unsigned k = 0;

			while (k < n && memcmp(corners->direction[k], v, sizeof v) != 0)
				k++;
			if (k == n)
				memcpy(corners->direction[n++], v, sizeof v);
			corners->of[t][i] = (uint8_t)k;
		}
	}
}

/* Directions from which a block's mask culls it, and its cone does not. A cone culls a cap of directions, so all of a
 * triangle whose corners it culls. */
static void find_hidden(const struct job *job, uint32_t block, uint64_t hidden[2])
{
	const struct corners *corners = &job->corners;
	uint8_t culls[N_CORNERS];

	for (int k = 0; k < N_CORNERS; k++)
		culls[k] = (uint8_t)cone_culls(job->blocks, block, corners->direction[k], 0);
	hidden[0] = ~job->mask[block][0];
	hidden[1] = ~job->mask[block][1];
	for (unsigned t = 0; t < PSR_MASK_TRIANGLES; t++)
		if ((culls[corners->of[t][0]] & culls[corners->of[t][1]] & culls[corners->of[t][2]]) != 0)
			hidden[t >> 6] &= ~(UINT64_C(1) << (t & 63));
}

static uint32_t sum_lost(const struct group *g, const uint64_t seen[2])
{
	uint32_t sum = 0;

	for (int w = 0; w < 2; w++)
		for (uint64_t left = g->hidden[w] & ~g->seen[w] & seen[w]; left != 0; left &= left - 1)
			sum += g->lost[64 * w + __builtin_ctzll(left)];
	return sum;
}

static void find_other(struct group *group, uint32_t g)
{
	uint32_t k = group[g].next;

	group[g].other = group[g].cost = NONE;
	for (int i = 0; i < NEAR && k != NONE; i++, k = group[k].next) {
		uint32_t cost = sum_lost(&group[g], group[k].seen) + sum_lost(&group[k], group[g].seen);

		if (cost < group[g].cost) {
			group[g].cost = cost;
			group[g].other = k;
		}
	}
}

/* Finds the other of a group, if there is one, and of the NEAR groups before it. */
static void find_others_before(struct group *group, uint32_t g)
{
	for (int i = 0; i <= NEAR && g != NONE; i++, g = group[g].previous)
		find_other(group, g);
}

/* Joins its other one to a group. */
static void join(struct group *group, uint32_t to)
{
	uint32_t from = group[to].other, before = group[from].previous;

	for (int w = 0; w < 2; w++) {
		group[to].seen[w] |= group[from].seen[w];
		group[to].hidden[w] |= group[from].hidden[w];
	}
	for (int t = 0; t < PSR_MASK_TRIANGLES; t++)
		group[to].lost[t] += group[from].lost[t];
	group[before].next = group[from].next;
	if (group[from].next != NONE)
		group[group[from].next].previous = before;
	find_others_before(group, before);
	find_others_before(group, to);
}

/* Joins at the least cost until `most` groups are left; group 0 stays. */
static void join_groups(struct group *group, uint32_t n, uint32_t most)
{
	for (uint32_t g = n; g-- > 0;)
		find_other(group, g);
	for (; n > most; n--) {
		uint32_t best = 0;

		for (uint32_t g = 0; g != NONE; g = group[g].next)
			best = group[g].cost < group[best].cost ? g : best;
		join(group, best);
	}
}

static void make_groups(const struct job *job, uint32_t first, uint32_t n, struct group *group, uint64_t (*hidden)[2])
{
	for (uint32_t i = 0; i < n; i++) {
		uint32_t n_samples = (uint32_t)__builtin_popcountll(job->blocks->mask[first + i]);

		find_hidden(job, first + i, hidden[i]);
		group[i] = (struct group){ .previous = i - 1, .next = i + 1 < n ? i + 1 : NONE };
		for (int w = 0; w < 2; w++) {
			group[i].seen[w] = job->mask[first + i][w];
			group[i].hidden[w] = hidden[i][w];
		}
		for (int t = 0; t < PSR_MASK_TRIANGLES; t++)
			group[i].lost[t] = (hidden[i][t >> 6] >> (t & 63) & 1) != 0 ? n_samples : 0;
	}
}

/* Returns the mask with all bits of the block's own that culls the block from the most directions. */
static uint8_t best_mask(const uint64_t (*table)[2], uint32_t n, const uint64_t own[2], const uint64_t hidden[2])
{
	int least = PSR_MASK_TRIANGLES + 1;
	uint8_t best = 0;

	for (uint32_t k = 0; k < n; k++) {
		int lost = __builtin_popcountll(hidden[0] & table[k][0]) + __builtin_popcountll(hidden[1] & table[k][1]);

		if (((own[0] & ~table[k][0]) | (own[1] & ~table[k][1])) == 0 && lost < least) {
			least = lost;
			best = (uint8_t)k;
		}
	}
	return best;
}

/* Each block takes the best of the n masks. Masks then lose the bits that no block needs, and unused ones go. */
static uint32_t take_masks(const struct job *job, uint32_t first, uint32_t n_blocks, const uint64_t (*hidden)[2],
                           uint64_t (*table)[2], uint32_t n)
{
	uint64_t taken[MOST_MASKS][2] = { { 0 } };
	uint8_t *index = job->index + first, number[MOST_MASKS];
	uint8_t is_taken[MOST_MASKS] = { 0 };
	uint32_t n_taken = 0;

	for (uint32_t i = 0; i < n_blocks; i++) {
		const uint64_t *own = job->mask[first + i];
		uint8_t k = best_mask((const uint64_t(*)[2])table, n, own, hidden[i]);

		index[i] = k;
		is_taken[k] = 1;
		taken[k][0] |= own[0];
		taken[k][1] |= own[1];
	}
	for (uint32_t k = 0; k < n; k++) {
		if (!is_taken[k])
			continue;
		number[k] = (uint8_t)n_taken;
		memcpy(table[n_taken++], taken[k], sizeof taken[k]);
	}
	for (uint32_t i = 0; i < n_blocks; i++)
		index[i] = number[index[i]];
	return n_taken;
}

static void share_run(int run, void *userdata)
{
	struct job *job = userdata;
	uint32_t first = (uint32_t)run * PSR_RUN_BLOCKS, left = job->blocks->n_blocks - first, n_masks = 0;
	uint32_t n = left < PSR_RUN_BLOCKS ? left : PSR_RUN_BLOCKS;
	struct group *group = psr_alloc_array(n, sizeof *group);
	uint64_t (*hidden)[2] = psr_alloc_array(n, sizeof *hidden), (*table)[2] = job->table + MOST_MASKS * (uint32_t)run;

	if (group != NULL && hidden != NULL) {
		make_groups(job, first, n, group, hidden);
		join_groups(group, n, (n + VISIBILITY_MASK_SHARE - 1) / VISIBILITY_MASK_SHARE);
		for (uint32_t g = 0; g != NONE; g = group[g].next)
			memcpy(table[n_masks++], group[g].seen, sizeof *table);
		job->n_masks[run] = take_masks(job, first, n, (const uint64_t(*)[2])hidden, table, n_masks);
	} else {
		atomic_store(&job->failed, 1);
	}
	psr_free(group);
	psr_free(hidden);
}

int visibility_mask_table_make(struct visibility_mask_table *table, const struct psr_blocks *blocks,
                               const uint64_t (*mask)[2], struct psr_run *run, struct psr_pool *pool)
{
	uint32_t n_runs = psr_blocks_runs(blocks), n_masks = 0;
	struct job job = { .blocks = blocks, .mask = mask };

	job.table = psr_alloc_array((size_t)n_runs * MOST_MASKS, sizeof *job.table);
	job.n_masks = psr_alloc_array(n_runs, sizeof *job.n_masks);
	job.index = psr_alloc_array(blocks->n_blocks, 1);
	*table = (struct visibility_mask_table){ .mask = job.table, .index = job.index };
	make_corners(&job.corners);
	if (job.table != NULL && job.n_masks != NULL && job.index != NULL)
		psr_pool_for(pool, (int)n_runs, share_run, &job);
	else
		atomic_store(&job.failed, 1);
	for (uint32_t r = 0; r < n_runs && !atomic_load(&job.failed); r++) {
		memmove(table->mask + n_masks, table->mask + r * MOST_MASKS, job.n_masks[r] * sizeof *table->mask);
		run[r].visibility_first = n_masks;
		n_masks += job.n_masks[r];
	}
	table->n_masks = n_masks;
	psr_free(job.n_masks);
	if (!atomic_load(&job.failed))
		return PSR_OK;
	visibility_mask_table_fini(table);
	return PSR_ERR_MEMORY;
}

void visibility_mask_table_fini(struct visibility_mask_table *table)
{
	psr_free(table->mask);
	psr_free(table->index);
	*table = (struct visibility_mask_table){ 0 };
}
