#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/direction.h"
#include "render.h"
#include "screen.h"

/* Two passes over chunks of blocks: the first decides, block by block, and counts for each tile; the second
 * writes the bins where the counts say, in canonical order whatever the threads did. */

/* Blocks of a chunk: so many that there are some tens of chunks for threads to share. */
#define LEAST_CHUNK 256
#define MOST_CHUNK 2048
#define MANY_CHUNKS 64

struct cull_chunk {
	uint32_t instance, first_cluster, first_block, n_blocks, first_hit, n_hits;
	uint32_t levels, n_tested, n_clamped, n_masked, n_mixed;
	uint8_t flags, traits; /* of all blocks that are left, OR-ed */
	uint64_t n_samples;
	float depth_error; /* greatest half step of depth, in pixels */
};

/* The masks of the screen's regions, for one instance ([G] 6.3). In the place of the smallest node of a tree that
 * holds a block there is one mask for each of the 10 x 10 ranges of regions that a block can lie in. */
struct screen_masks {
	uint64_t range[SCREEN_RANGES * SCREEN_RANGES][2];
};

struct cull {
	struct bins *bins;
	const struct simd *simd;
	const struct plan *plan;
	uint32_t n_chunks, n_tiles;
	uint32_t stride; /* of counts, by chunk: whole lines, so that threads that count write none in common */
};

/* A sphere in camera space, and the pixels that it can touch. */
struct extent {
	float x0, x1, y0, y1;
};

static inline float to_camera(const float m[4], float x, float y, float z)
{
	return m[0] * x + m[1] * y + m[2] * z + m[3];
}

/* Interval of c / z for c within c +- r and z within z0..z1, both positive. */
static inline void interval(float c, float r, float z0, float z1, float *low, float *high)
{
	*low = (c - r) / (c - r < 0 ? z0 : z1);
	*high = (c + r) / (c + r < 0 ? z1 : z0);
}

/* 0 if nothing of the sphere can be in the picture grown by `guard` pixels. Two more pixels make up for rounding. */
static int sphere_extent(const struct plan *plan, const float c[3], float r, float guard, struct extent *out)
{
	float x0, x1, y0, y1;

	r *= 1.0001f;
	if (!(c[2] + r > plan->near_z))
		return 0;
	x0 = c[0] - r;
	x1 = c[0] + r;
	y0 = c[1] - r;
	y1 = c[1] + r;
	if (plan->perspective) {
		float z0 = c[2] - r > plan->near_z ? c[2] - r : plan->near_z, z1 = c[2] + r;
		interval(c[0], r, z0, z1, &x0, &x1);
		interval(c[1], r, z0, z1, &y0, &y1);
	}
	const float half_w = (float)plan->center[0], half_h = (float)plan->center[1];
	guard += 2;
	out->x0 = x0 * plan->focal + half_w - guard;
	out->x1 = x1 * plan->focal + half_w + guard;
	out->y0 = y0 * plan->focal + half_h - guard;
	out->y1 = y1 * plan->focal + half_h + guard;
	return out->x1 >= 0 && out->y1 >= 0 && out->x0 < (float)plan->width && out->y0 < (float)plan->height;
}

/* Whether samples at this distance in pixels need no depth buffer but the picture's, as the kernel has it. */
static inline int fits_pixel(float pixels)
{
	return pixels * (1 - 0x1p-12f) <= 1;
}

/* The node of a region: its coordinates' bits in turn, x first, after a one. */
static uint32_t node_of(uint32_t x, uint32_t y)
{
	uint32_t node = 1;
	for (int bit = SCREEN_SPLITS - 1; bit >= 0; bit--)
		node = node << 2 | (x >> bit & 1) << 1 | (y >> bit & 1);
	return node;
}

static void masks_make(struct screen_masks *masks, const struct plan *plan, const struct plan_instance *in)
{
	uint64_t region[2 << 2 * SCREEN_SPLITS][SCREEN_WORDS];
	struct screen screen = { .mask = region };
	if (plan->perspective) {
		screen_make(&screen, SCREEN_SPLITS, in->turn, plan->tangent, 2);
	} else { /* an eye at infinity sees along one direction */
		const unsigned triangle = psr_direction_encode(in->cull.eye) >> 8;
		memset(region, 0, sizeof region);
		for (uint32_t node = node_of(0, 0); node < 2u << 2 * SCREEN_SPLITS; node++)
			region[node][triangle >> 6] = UINT64_C(1) << (triangle & 63);
	}
	memset(masks->range, 0, sizeof masks->range);
	for (int x1 = 0; x1 < SCREEN_SIDE; x1++)
		for (int x0 = 0; x0 <= x1; x0++)
			for (int y1 = 0; y1 < SCREEN_SIDE; y1++)
				for (int y0 = 0; y0 <= y1; y0++)
					for (int r = 0, across = x1 - x0 + 1; r < across * (y1 - y0 + 1); r++)
						for (int w = 0; w < 2; w++)
							masks->range[screen_range(x0, x1) * SCREEN_RANGES + screen_range(y0, y1)][w] |=
								region[node_of((uint32_t)(x0 + r % across), (uint32_t)(y0 + r / across))][w];
}

static inline int mask_culls(const struct screen_masks *masks, const struct psr_blocks *b, uint32_t block,
                             uint32_t range)
{
	const uint64_t *own = b->visibility_mask[psr_blocks_visibility(b, block)], *seen = masks->range[range];
	return !((own[0] & seen[0]) | (own[1] & seen[1]));
}

/* Ones of a word, without a call where the machine that this is compiled for need not have the instruction. */
static inline uint32_t count_bits(uint64_t word)
{
	word -= word >> 1 & UINT64_C(0x5555555555555555);
	word = (word & UINT64_C(0x3333333333333333)) + (word >> 2 & UINT64_C(0x3333333333333333));
	word = (word + (word >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f);
	return (uint32_t)(word * UINT64_C(0x0101010101010101) >> 56);
}

/* Takes over what a batch says of its blocks. */
static struct cull_hit *take_batch(const struct cull *cull, struct cull_chunk *chunk, uint32_t *count,
                                   const struct cull_batch *batch, uint32_t first, uint32_t n, struct cull_hit *hit)
{
	const struct plan *plan = cull->plan;
	const struct plan_instance *in = &plan->instance[chunk->instance];
	const struct screen_masks *masks = in->masks == PSR_WHY_RAN ? &cull->bins->masks[chunk->instance] : NULL;
	const struct psr_blocks *b = in->cull.blocks;
	const uint16_t most_x = (uint16_t)(plan->width - 1), most_y = (uint16_t)(plan->height - 1);
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t block = first + i;
		if (!batch->is_left[i])
			continue;
		if (masks && mask_culls(masks, b, block, (uint32_t)batch->range[i])) {
			chunk->n_masked++;
			continue;
		}
		const int is_clamped = batch->level[i] > PSR_MAX_DEPTH_LEVEL;
		*hit = (struct cull_hit){
			.slot = in->first_slot + block, .instance = (uint16_t)chunk->instance, .near = batch->near[i],
			.level = (uint8_t)(is_clamped ? PSR_MAX_DEPTH_LEVEL : batch->level[i]), .is_mixed = batch->is_mixed[i] & 1,
			.x0 = (uint16_t)batch->x0[i], .x1 = (uint16_t)batch->x1[i],
			.y0 = (uint16_t)batch->y0[i], .y1 = (uint16_t)batch->y1[i],
			.tile_x0 = (uint8_t)batch->tile_x0[i], .tile_x1 = (uint8_t)batch->tile_x1[i],
			.tile_y0 = (uint8_t)batch->tile_y0[i], .tile_y1 = (uint8_t)batch->tile_y1[i],
		};
		hit->at_border = (hit->x0 == 0) | (hit->y0 == 0) | (hit->x1 == most_x) | (hit->y1 == most_y);
		for (uint32_t y = hit->tile_y0; y <= hit->tile_y1; y++)
			for (uint32_t x = hit->tile_x0; x <= hit->tile_x1; x++)
				count[y * plan->tiles_x + x]++;
		chunk->levels |= 1u << hit->level;
		chunk->n_mixed += hit->is_mixed;
		chunk->n_clamped += (uint32_t)is_clamped;
		chunk->flags |= b->flags[block];
		chunk->traits |= (uint8_t)psr_blocks_traits(b, block);
		chunk->n_samples += count_bits(b->mask[block]);
		if (batch->depth_error[i] > chunk->depth_error)
			chunk->depth_error = batch->depth_error[i];
		hit++;
	}
	return hit;
}

static struct cluster_view {
	float c[3], r;
} view_cluster(const struct plan_instance *in, const struct psr_cluster *k)
{
	struct cluster_view v;
	for (int a = 0; a < 3; a++)
		v.c[a] = to_camera(in->cull.center_m[a], k->center[0], k->center[1], k->center[2]);
	v.r = k->radius * in->cull.scale;
	return v;
}

/* The least z' that the blocks' spheres of a cluster reach. */
static float nearest_of(const struct plan_instance *in, const struct psr_cluster *k)
{
	const struct psr_blocks *b = in->cull.blocks;
	const int16_t *x = b->sphere_x + k->first_block, *y = b->sphere_y + k->first_block, *z = b->sphere_z + k->first_block;
	const uint16_t *r = b->sphere_r + k->first_block;
	const float *m = in->cull.center_m[2], half = 0.5f * in->cull.scale;
	float nearest = INFINITY;
	for (uint32_t i = 0; i < k->n_blocks; i++) {
		const float front = ((m[0] * x[i] + m[1] * y[i]) + m[2] * z[i]) - half * r[i];
		nearest = front < nearest ? front : nearest;
	}
	return nearest * (1.0f / 16384) + m[3];
}

/* Whether samples are surely at most a pixel apart, or what the settings say, all over the cluster. Its sphere is held
 * against that first: it reaches nearer than anything in it, by half of its radius where it holds a whole model. */
static int fits_cluster(const struct plan *plan, const struct plan_instance *in, const struct psr_cluster *k)
{
	const struct cluster_view v = view_cluster(in, k);
	const float spacing = in->cull.spacing * (float)(1u << k->level) * plan->finer;
	if (fits_pixel(cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, v.c[2] - v.r) * spacing))
		return 1;
	if (!plan->perspective || !fits_pixel(cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, v.c[2]) * spacing))
		return 0;
	return fits_pixel(cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, nearest_of(in, k)) * spacing);
}

/* Of each group the coarsest cluster that fits, or the finest if none does: looked for from coarse to fine. Serial,
 * since it costs no more than some nanoseconds a cluster, but for those that are just at the limit. */
static void choose_levels(struct bins *bins, const struct plan *plan)
{
	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct plan_instance *in = &plan->instance[i];
		const struct psr_blocks *b = in->cull.blocks;
		struct cull_group *group = bins->group + in->first_group;
		memset(group, 0, b->n_clusters * sizeof *group);
		for (unsigned level = b->n_levels; level-- > 0;)
			for (uint32_t k = 0; k < b->n_clusters; k++) {
				struct cull_group *g = &group[b->cluster[k].group];
				if (b->cluster[k].level != level || g->fits)
					continue;
				g->level = (uint8_t)level;
				g->fits = level > 0 && fits_cluster(plan, in, &b->cluster[k]);
			}
	}
}

static int is_chosen(const struct bins *bins, const struct plan_instance *in, const struct psr_cluster *k)
{
	return bins->group[in->first_group + k->group].level == k->level;
}

static void count_chunk(int i, void *userdata)
{
	const struct cull *cull = userdata;
	const struct plan *plan = cull->plan;
	struct cull_chunk chunk = cull->bins->chunk[i];
	const struct plan_instance *in = &plan->instance[chunk.instance];
	uint32_t *count = cull->bins->count + (size_t)i * cull->stride;
	struct cull_hit *hit = cull->bins->hit + chunk.first_hit;
	/* Whatever level a cluster's blocks get, their guard is at most that of the coarsest. */
	const float guard = (float)(1 << PSR_MAX_DEPTH_LEVEL);

	memset(count, 0, cull->n_tiles * sizeof *count);
	const struct psr_blocks *b = in->cull.blocks;
	const uint32_t chunk_end = chunk.first_block + chunk.n_blocks;
	for (uint32_t k = chunk.first_cluster; k < b->n_clusters && b->cluster[k].first_block < chunk_end; k++) {
		const struct psr_cluster *cluster = &b->cluster[k];
		const uint32_t cluster_end = cluster->first_block + cluster->n_blocks;
		const uint32_t end = cluster_end < chunk_end ? cluster_end : chunk_end;
		uint32_t first = cluster->first_block > chunk.first_block ? cluster->first_block : chunk.first_block;
		const struct cluster_view v = view_cluster(in, cluster);
		struct extent e;
		if (!is_chosen(cull->bins, in, cluster) || !sphere_extent(plan, v.c, v.r, guard, &e))
			continue;
		chunk.n_tested += end - first;
		for (uint32_t n; first < end; first += n) {
			struct cull_batch batch;
			n = end - first < CULL_BATCH ? end - first : CULL_BATCH;
			cull->simd->cull(&batch, &in->cull, first, n);
			hit = take_batch(cull, &chunk, count, &batch, first, n, hit);
		}
	}
	chunk.n_hits = (uint32_t)(hit - (cull->bins->hit + chunk.first_hit));
	cull->bins->chunk[i] = chunk;
}

/* Most often it is marked already, and threads that only look share its line. */
static inline void mark(uint8_t *is_quiet)
{
	if (__atomic_load_n(is_quiet, __ATOMIC_RELAXED))
		__atomic_store_n(is_quiet, 0, __ATOMIC_RELAXED);
}

/* What a block draws, and what its cells cover, is within two cells of its pixels: most often in the parts of the four
 * corners. */
static void mark_parts(uint8_t *is_quiet, const struct plan *plan, const struct cull_hit *hit)
{
	const int32_t reach = 2 << hit->level, most_x = (int32_t)plan->parts_x - 1, most_y = (int32_t)plan->parts_y - 1;
	const int32_t left = hit->x0 - reach, right = (hit->x1 + reach) / PART_WIDTH;
	const int32_t top = hit->y0 - reach, bottom = (hit->y1 + reach) / PART_HEIGHT;
	const int32_t x0 = (left > 0 ? left : 0) / PART_WIDTH, x1 = right < most_x ? right : most_x;
	const int32_t y0 = (top > 0 ? top : 0) / PART_HEIGHT, y1 = bottom < most_y ? bottom : most_y;
	uint8_t *first = is_quiet + (size_t)y0 * plan->parts_x, *last = is_quiet + (size_t)y1 * plan->parts_x;
	mark(&first[x0]);
	mark(&first[x1]);
	mark(&last[x0]);
	mark(&last[x1]);
	if (x1 - x0 <= 1 && y1 - y0 <= 1)
		return;
	for (; first <= last; first += plan->parts_x)
		for (int32_t x = x0; x <= x1; x++)
			mark(&first[x]);
}

static void fill_chunk(int i, void *userdata)
{
	const struct cull *cull = userdata;
	const struct cull_chunk *chunk = &cull->bins->chunk[i];
	uint32_t *next = cull->bins->count + (size_t)i * cull->stride;
	for (uint32_t h = 0; h < chunk->n_hits; h++) {
		const struct cull_hit *hit = &cull->bins->hit[chunk->first_hit + h];
		const struct bin_entry entry = {
			.slot = hit->slot, .instance = hit->instance, .level = hit->level, .is_mixed = hit->is_mixed,
			.at_border = hit->at_border, .hit = chunk->first_hit + h,
		};
		mark_parts(cull->bins->is_quiet, cull->plan, hit);
		for (uint32_t y = hit->tile_y0; y <= hit->tile_y1; y++)
			for (uint32_t x = hit->tile_x0; x <= hit->tile_x1; x++)
				cull->bins->entry[next[y * cull->plan->tiles_x + x]++] = entry;
	}
}

/* Room for n elements, and a quarter more, so that the next frame's will do; what was there is gone. */
static void *room_for(void *array, size_t *capacity, size_t n, size_t size)
{
	if (array && n * size <= *capacity)
		return array;
	return psr_grow_huge(array, capacity, (n + n / 4 + 1) * size);
}

static uint32_t make_chunks(struct bins *bins, const struct plan *plan, int store)
{
	const uint32_t share = plan->n_slots / MANY_CHUNKS, least = share > LEAST_CHUNK ? share : LEAST_CHUNK;
	const uint32_t most = least < MOST_CHUNK ? least : MOST_CHUNK;
	uint32_t n = 0;
	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct psr_blocks *blocks = plan->instance[i].cull.blocks;
		uint32_t k = 0;
		for (uint32_t first = 0; first < blocks->n_blocks; first += most, n++) {
			const uint32_t left = blocks->n_blocks - first;
			while (blocks->cluster[k].first_block + blocks->cluster[k].n_blocks <= first)
				k++;
			if (store)
				bins->chunk[n] = (struct cull_chunk){ .instance = i, .first_cluster = k, .first_block = first,
					                                  .n_blocks = left < most ? left : most,
					                                  .first_hit = plan->instance[i].first_slot + first };
		}
	}
	return n;
}

static int compare_keys(const void *a, const void *b)
{
	const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
	return (x > y) - (x < y);
}

/* Turns the counts into the places where each chunk writes its entries of each tile. */
static int place_entries(struct bins *bins, const struct cull *cull)
{
	uint64_t total = 0;
	for (uint32_t t = 0; t < cull->n_tiles; t++) {
		const uint64_t begin = total;
		bins->tile_begin[t] = (uint32_t)total;
		for (uint32_t i = 0; i < cull->n_chunks; i++) {
			uint32_t *count = &bins->count[(size_t)i * cull->stride + t], n = *count;
			*count = (uint32_t)total;
			total += n;
		}
		if (total > UINT32_MAX)
			return PSR_ERR_LIMIT;
		bins->by_work[t] = (UINT32_MAX - (total - begin)) << 32 | t;
	}
	qsort(bins->by_work, cull->n_tiles, sizeof *bins->by_work, compare_keys);
	bins->tile_begin[cull->n_tiles] = (uint32_t)total;
	bins->entry = room_for(bins->entry, &bins->entry_capacity, total, sizeof *bins->entry);
	bins->order = room_for(bins->order, &bins->order_capacity, total, sizeof *bins->order);
	return bins->entry && bins->order ? PSR_OK : PSR_ERR_MEMORY;
}

static void note_tests(const struct plan *plan, struct psr_report *report, uint64_t n_masked, uint64_t n_mixed)
{
	enum psr_why cones = PSR_WHY_NOTHING, masks = PSR_WHY_NOTHING;
	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct plan_instance *in = &plan->instance[i];
		if (in->cull.blocks->cone_sine)
			cones = in->cull.with_cones ? PSR_WHY_RAN : PSR_WHY_OFF;
		if (masks != PSR_WHY_RAN && in->masks != PSR_WHY_NOTHING)
			masks = in->masks;
	}
	effect_note(report, PSR_EFFECT_CONES, cones, report->count[PSR_STAGE_CULL]);
	effect_note(report, PSR_EFFECT_MASKS, masks, n_masked);
	effect_note(report, PSR_EFFECT_FACING, n_mixed ? PSR_WHY_RAN : PSR_WHY_NOTHING, n_mixed);
	effect_note(report, PSR_EFFECT_LEVELS, report->levels & ~1u ? PSR_WHY_RAN : PSR_WHY_NOTHING,
	            (uint64_t)__builtin_popcount(report->levels & ~1u));
}

int cull_blocks(struct bins *bins, const struct simd *simd, struct plan *plan, struct psr_pool *pool,
                struct psr_report *report)
{
	const uint32_t n_tiles = plan->tiles_x * plan->tiles_y, line = 64 / sizeof *bins->count;
	struct cull cull = { bins, simd, plan, make_chunks(bins, plan, 0), n_tiles, (n_tiles + line - 1) / line * line };
	uint64_t n_masked = 0, n_mixed = 0;
	float depth_error = 0;

	bins->chunk = room_for(bins->chunk, &bins->chunk_capacity, cull.n_chunks, sizeof *bins->chunk);
	bins->hit = room_for(bins->hit, &bins->hit_capacity, plan->n_slots, sizeof *bins->hit);
	bins->group = room_for(bins->group, &bins->group_capacity, plan->n_groups, sizeof *bins->group);
	bins->count = room_for(bins->count, &bins->count_capacity, (size_t)cull.n_chunks * cull.stride,
	                       sizeof *bins->count);
	bins->tile_begin = room_for(bins->tile_begin, &bins->tile_capacity, cull.n_tiles + 1, sizeof *bins->tile_begin);
	bins->by_work = room_for(bins->by_work, &bins->by_work_capacity, cull.n_tiles, sizeof *bins->by_work);
	bins->is_quiet = room_for(bins->is_quiet, &bins->quiet_capacity, plan->parts_x * plan->parts_y, 1);
	bins->masks = room_for(bins->masks, &bins->masks_capacity, plan->n_instances, sizeof *bins->masks);
	if (bins->masks == NULL || bins->chunk == NULL || bins->hit == NULL || bins->group == NULL || bins->count == NULL
	    || bins->tile_begin == NULL || bins->by_work == NULL || bins->is_quiet == NULL)
		return PSR_ERR_MEMORY;
	memset(bins->is_quiet, 1, plan->parts_x * plan->parts_y);
	make_chunks(bins, plan, 1);
	choose_levels(bins, plan);
	for (uint32_t i = 0; i < plan->n_instances; i++)
		if (plan->instance[i].masks == PSR_WHY_RAN)
			masks_make(&bins->masks[i], plan, &plan->instance[i]);
	psr_pool_for(pool, (int)cull.n_chunks, count_chunk, &cull);
	const int rc = place_entries(bins, &cull);
	if (rc)
		return rc;
	psr_pool_for(pool, (int)cull.n_chunks, fill_chunk, &cull);

	report->n_blocks = plan->n_slots;
	report->n_samples = plan->n_samples;
	for (uint32_t i = 0; i < cull.n_chunks; i++) {
		const struct cull_chunk *chunk = &bins->chunk[i];
		report->count[PSR_STAGE_CULL] += chunk->n_tested;
		report->n_blocks_drawn += chunk->n_hits;
		report->n_samples_drawn += chunk->n_samples;
		report->levels |= chunk->levels;
		if (chunk->flags & PSR_BLOCK_TWO_SIDED)
			plan->view.needs |= STRIP_TWO_SIDED;
		plan->has_sheer |= plan->instance[chunk->instance].cull.blocks->opacity && chunk->traits & PSR_BLOCK_SHEER;
		if (chunk->traits & PSR_BLOCK_BENT)
			plan->view.needs |= STRIP_BENT;
		report->n_clamped += chunk->n_clamped;
		n_masked += chunk->n_masked;
		n_mixed += chunk->n_mixed;
		if (chunk->depth_error > depth_error)
			depth_error = chunk->depth_error;
	}
	report->error_px = 0.5 + (double)depth_error;
	if (plan->with_splats)
		report->levels |= report->levels & 1 ? 2 : 0;
	else if (plan->is_full)
		report->levels = (2u << PSR_MAX_DEPTH_LEVEL) - 1;
	note_tests(plan, report, n_masked, n_mixed);
	return PSR_OK;
}

size_t bins_bytes(const struct bins *bins)
{
	return bins->entry_capacity + bins->chunk_capacity + bins->hit_capacity + bins->order_capacity +
	       bins->masks_capacity + bins->group_capacity + bins->count_capacity + bins->tile_capacity +
	       bins->by_work_capacity + bins->quiet_capacity;
}

void bins_clear(struct bins *bins)
{
	psr_free_huge(bins->entry, bins->entry_capacity);
	psr_free_huge(bins->tile_begin, bins->tile_capacity);
	psr_free_huge(bins->by_work, bins->by_work_capacity);
	psr_free_huge(bins->is_quiet, bins->quiet_capacity);
	psr_free_huge(bins->chunk, bins->chunk_capacity);
	psr_free_huge(bins->hit, bins->hit_capacity);
	psr_free_huge(bins->order, bins->order_capacity);
	psr_free_huge(bins->masks, bins->masks_capacity);
	psr_free_huge(bins->group, bins->group_capacity);
	psr_free_huge(bins->count, bins->count_capacity);
	memset(bins, 0, sizeof *bins);
}
