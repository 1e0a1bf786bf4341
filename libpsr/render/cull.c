#include "cull.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "sheer.h"
#include "shadow.h"

/* Two passes over chunks of blocks: the first tests each block and counts entries by tile; the second writes the bins
 * at places that follow from the counts, in the same order for any number of threads. */

struct cull {
	struct bins *bins;
	const struct simd *simd;
	const struct plan *plan;
	uint32_t n_chunks, n_tiles;
	uint32_t stride; /* of counts, by chunk: whole cache lines, so that threads share none */
	atomic_uint n_hits; /* that chunks have appended */
};

static enum bin_kind kind_of(const struct plan *plan, const struct psr_blocks *b, uint32_t block, unsigned traits)
{
	float opacity;

	if (b->opacity == NULL || !(traits & PSR_BLOCK_SHEER))
		return plan->caster <= SHADOW_OPAQUE ? BIN_WARPED : BIN_GLASS;
	if (plan->caster > SHADOW_OPAQUE)
		return sheer_caster(&opacity, b, block) == plan->caster ? BIN_WARPED : BIN_GLASS;
	return traits & PSR_BLOCK_THIN ? BIN_THIN : BIN_GLASS;
}

/* Lists the blocks of a batch that are left. Without branches here and below: whether a block is left is hard to
 * predict. */
static uint32_t list_left(uint8_t left[CULL_BATCH], const struct cull_batch *batch, uint32_t n)
{
	uint32_t n_left = 0;

	for (uint32_t i = 0; i < n; i++) {
		left[n_left] = (uint8_t)i;
		n_left += (uint32_t)batch->is_left[i];
	}
	return n_left;
}

/* Keeps those that masks do not hide; blocks count from `first`. */
static uint32_t drop_masked(uint8_t left[CULL_BATCH], uint32_t n, const struct cull_batch *batch,
                            const struct cull_masks *masks, const struct psr_blocks *b, uint32_t first)
{
	uint32_t n_left = 0;

	for (uint32_t k = 0; k < n; k++) {
		const uint32_t i = left[k];

		left[n_left] = (uint8_t)i;
		n_left += !cull_by_mask(masks, b, first + i, (uint32_t)batch->range[i]);
	}
	return n_left;
}

/* Takes the results of a batch, blocks first .. first + n - 1. */
static void take_batch(struct cull_counting *to, const struct cull_batch *batch, uint32_t first, uint32_t n)
{
	struct cull_chunk chunk = *to->chunk; /* in registers: stores into hits might change *to->chunk */
	struct cull_hit *hit = to->hit;
	const struct plan *plan = to->plan;
	const struct plan_instance *in = &plan->instance[chunk.instance];
	const struct cull_masks *masks = in->masks == PSR_WHY_RAN ? &to->bins->masks[chunk.instance] : NULL;
	const struct psr_blocks *b = in->cull.blocks;
	const int is_ewa = plan->with_ewa && in->cull.cubes != NULL; /* splats close gaps themselves */
	const int32_t most_x = (int32_t)plan->width - 1, most_y = (int32_t)plan->height - 1;

	uint8_t left[CULL_BATCH];
	const uint32_t n_seen = list_left(left, batch, n);
	const uint32_t n_left = masks != NULL ? drop_masked(left, n_seen, batch, masks, b, first) : n_seen;

	chunk.n_masked += n_seen - n_left;
	for (uint32_t k = 0; k < n_left; k++) {
		const uint32_t i = left[k], block = first + i;
		const unsigned traits = psr_blocks_traits(b, block);
		const int is_clamped = !is_ewa && batch->level[i] > PSR_MAX_DEPTH_LEVEL;
		const int level = is_clamped ? PSR_MAX_DEPTH_LEVEL : is_ewa ? 0 : batch->level[i];
		const int at_border = (batch->x0[i] == 0) | (batch->y0[i] == 0) | (batch->x1[i] == most_x)
		                      | (batch->y1[i] == most_y);
		*hit = (struct cull_hit){
			.slot = in->first_slot + block, .instance = (uint16_t)chunk.instance, .near = batch->near[i],
			.level = (uint8_t)level, .is_mixed = batch->is_mixed[i] & 1, .at_border = at_border & 1,
			.is_wide = in->cull.cubes != NULL && (level > 0 || plan->with_splats || is_ewa),
			.kind = kind_of(plan, b, block, traits) & 3,
			.x0 = (uint16_t)batch->x0[i], .x1 = (uint16_t)batch->x1[i],
			.y0 = (uint16_t)batch->y0[i], .y1 = (uint16_t)batch->y1[i],
			.tile_x0 = (uint8_t)batch->tile_x0[i], .tile_x1 = (uint8_t)batch->tile_x1[i],
			.tile_y0 = (uint8_t)batch->tile_y0[i], .tile_y1 = (uint8_t)batch->tile_y1[i],
		};
		cull_count_tiles(to, hit);
		chunk.levels |= 1u << hit->level;
		chunk.n_mixed += hit->is_mixed;
		chunk.n_clamped += (uint32_t)is_clamped;
		chunk.flags |= b->flags[block];
		chunk.traits |= (uint8_t)traits;
		chunk.n_samples += cull_n_samples(in, block);
		const float error = cull_place_error(plan, in, traits, batch->apart[i], batch->depth_error[i]);
		chunk.place_error = error > chunk.place_error ? error : chunk.place_error;
		hit++;
	}
	to->hit = hit;
	*to->chunk = chunk;
}

static void count_blocks(struct cull_counting *to)
{
	const struct plan *plan = to->plan;
	struct cull_chunk *chunk = to->chunk;
	const struct plan_instance *in = &plan->instance[chunk->instance];
	const struct psr_blocks *b = in->cull.blocks;
	const uint32_t chunk_end = chunk->first_block + chunk->n_blocks;

	for (uint32_t k = chunk->first_cluster; k < b->n_clusters && b->cluster[k].first_block < chunk_end; k++) {
		const struct psr_cluster *cluster = &b->cluster[k];
		const uint32_t cluster_end = cluster->first_block + cluster->n_blocks;
		const uint32_t end = cluster_end < chunk_end ? cluster_end : chunk_end;
		uint32_t first = cluster->first_block > chunk->first_block ? cluster->first_block : chunk->first_block;

		if (!cull_is_chosen(to->bins, in, cluster))
			continue;
		const struct cull_sphere v = cull_view_cluster(in, cluster);
		if (!cull_sees_sphere(plan, &v))
			continue;
		for (uint32_t n; first < end && !plan_is_cancelled(plan); first += n) {
			struct cull_batch batch;

			n = cull_next_batch(in, first, end);
			if (in->cull.cubes != NULL && !cull_sees_run(plan, in, first))
				continue;
			chunk->n_tested += n;
			to->simd->cull(&batch, &in->cull, first, n);
			take_batch(to, &batch, first, n);
		}
	}
}

static void count_chunk(int i, void *userdata)
{
	struct cull *cull = userdata;
	const struct plan *plan = cull->plan;
	struct cull_chunk chunk = cull->bins->chunk[i];
	const struct plan_instance *in = &plan->instance[chunk.instance];
	uint32_t *count = cull->bins->count + (size_t)i * cull->stride;
	struct cull_hit hit[CULL_MOST_CHUNK];
	uint64_t cubes[CULL_MOST_CHUNK];
	struct cull_counting to = { cull->bins, cull->simd, plan, &chunk, count, hit, plan->with_runs ? cubes : NULL };

	memset(count, 0, cull->n_tiles * BIN_KINDS * sizeof *count);
	if (in->cull.cubes != NULL && plan->with_runs)
		cull_count_runs(&to);
	else
		count_blocks(&to);
	chunk.n_hits = (uint32_t)(to.hit - hit);
	chunk.n_drawn += to.cubes == NULL || in->cull.cubes == NULL ? chunk.n_hits : 0;
	chunk.first_hit = atomic_fetch_add_explicit(&cull->n_hits, chunk.n_hits, memory_order_relaxed);
	memcpy(cull->bins->hit + chunk.first_hit, hit, chunk.n_hits * sizeof *hit);
	if (plan->with_runs && in->cull.cubes != NULL)
		memcpy(cull->bins->cubes + chunk.first_hit, cubes, chunk.n_hits * sizeof *cubes);
	cull->bins->chunk[i] = chunk;
}

/* Most parts are marked already; reading first lets threads share the cache line. */
static inline void mark(uint8_t *is_quiet)
{
	if (__atomic_load_n(is_quiet, __ATOMIC_RELAXED))
		__atomic_store_n(is_quiet, 0, __ATOMIC_RELAXED);
}

/* A block draws, and its cells reach, within two cells of its pixels. Most often the four corners' parts are all. */
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
			.at_border = hit->at_border, .is_wide = hit->is_wide, .hit = chunk->first_hit + h,
		};

		if (h % CULL_BATCH == 0 && plan_is_cancelled(cull->plan))
			return;
		mark_parts(cull->bins->is_quiet, cull->plan, hit);
		for (uint32_t y = hit->tile_y0; y <= hit->tile_y1; y++)
			for (uint32_t x = hit->tile_x0; x <= hit->tile_x1; x++)
				cull->bins->entry[next[(y * cull->plan->tiles_x + x) * BIN_KINDS + hit->kind]++] = entry;
	}
}

static int compare_keys(const void *a, const void *b)
{
	const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;

	return (x > y) - (x < y);
}

/* Turns counts into the places of each chunk's entries of each tile. */
static int place_entries(struct bins *bins, const struct cull *cull)
{
	uint64_t total = 0;

	for (uint32_t t = 0; t < cull->n_tiles; t++) {
		uint32_t *const begins[BIN_KINDS] = { &bins->tile_begin[t], &bins->thin_begin[t], &bins->glass_begin[t] };
		const uint64_t begin = total;

		for (uint32_t kind = 0; kind < BIN_KINDS; kind++) {
			*begins[kind] = (uint32_t)total;
			for (uint32_t i = 0; i < cull->n_chunks; i++) {
				uint32_t *count = &bins->count[(size_t)i * cull->stride + t * BIN_KINDS + kind], n = *count;

				if (plan_is_cancelled_at(cull->plan, i))
					return PSR_ERR_CANCELLED;
				*count = (uint32_t)total;
				total += n;
			}
		}
		if (total > UINT32_MAX)
			return PSR_ERR_LIMIT;
		bins->by_work[t] = (UINT32_MAX - (total - begin)) << 32 | t;
	}
	qsort(bins->by_work, cull->n_tiles, sizeof *bins->by_work, compare_keys);
	bins->tile_begin[cull->n_tiles] = (uint32_t)total;
	return bins_room(bins, entry, total) && bins_room(bins, order, total) ? PSR_OK : PSR_ERR_MEMORY;
}

static void note_tests(const struct plan *plan, struct psr_report *report, uint64_t n_masked, uint64_t n_mixed)
{
	enum psr_why cones = PSR_WHY_NOTHING, masks = PSR_WHY_NOTHING;

	for (uint32_t i = 0; i < plan->n_instances; i++) {
		const struct plan_instance *in = &plan->instance[i];

		if (in->cull.blocks->cone_sine != NULL)
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

static int make_room(struct bins *bins, const struct cull *cull)
{
	const struct plan *plan = cull->plan;

	return bins_room(bins, hit, plan->n_slots) && (!plan->with_runs || bins_room(bins, cubes, plan->n_slots))
	               && bins_room(bins, count, (size_t)cull->n_chunks * cull->stride)
	               && bins_room(bins, tile_begin, cull->n_tiles + 1)
	               && bins_room(bins, thin_begin, cull->n_tiles) && bins_room(bins, glass_begin, cull->n_tiles)
	               && bins_room(bins, by_work, cull->n_tiles)
	               && bins_room(bins, is_quiet, plan->parts_x * plan->parts_y)
	               && bins_room(bins, masks, plan->n_instances)
	           ? PSR_OK
	           : PSR_ERR_MEMORY;
}

/* Cubes are numbered from the finest level on: the first that a chunk draws is its finest. */
static void note_levels(const struct cull *cull, const struct cull_chunk *chunk, struct psr_report *report)
{
	const struct plan_instance *in = &cull->plan->instance[chunk->instance];
	const struct psr_cubes *cubes = in->cull.cubes;
	uint32_t levels;

	if (cubes == NULL || chunk->n_hits == 0)
		return;
	levels = (uint32_t)psr_cubes_level(cubes, cull->bins->hit[chunk->first_hit].slot - in->first_slot)->tree->levels;
	if (levels <= report->octree_levels)
		return;
	report->octree_levels = levels;
	report->of_levels = (uint32_t)cubes->level[0].tree->levels;
}

/* Adds up the chunks in the report, and notes in the plan what shading needs. */
static void sum_up(const struct cull *cull, struct plan *plan, struct psr_report *report)
{
	float place_error = 0;
	uint64_t n_masked = 0, n_mixed = 0, n_splats = 0;

	report->n_blocks = plan->n_slots;
	report->n_samples = plan->n_samples;
	for (uint32_t i = 0; i < cull->n_chunks; i++) {
		const struct cull_chunk *chunk = &cull->bins->chunk[i];

		report->count[PSR_STAGE_CULL] += chunk->n_tested;
		report->n_blocks_drawn += chunk->n_drawn;
		report->n_samples_drawn += chunk->n_samples;
		report->levels |= chunk->levels;
		note_levels(cull, chunk, report);
		if (chunk->flags & PSR_BLOCK_TWO_SIDED)
			plan->view.needs |= STRIP_TWO_SIDED;
		const int has_opacity = plan->instance[chunk->instance].cull.blocks->opacity != NULL;
		plan->has_sheer |= has_opacity && chunk->traits & PSR_BLOCK_SHEER;
		plan->has_thin |= has_opacity && chunk->traits & PSR_BLOCK_THIN;
		if (chunk->traits & PSR_BLOCK_BENT)
			plan->view.needs |= STRIP_BENT;
		report->n_clamped += chunk->n_clamped;
		n_splats += plan->with_ewa && plan->instance[chunk->instance].cull.cubes != NULL ? chunk->n_samples : 0;
		n_masked += chunk->n_masked;
		n_mixed += chunk->n_mixed;
		if (chunk->place_error > place_error)
			place_error = chunk->place_error;
	}
	/* Near the eye a sample may be anywhere in the picture. */
	const float extent = (float)plan->window.picture_width + (float)plan->window.picture_height;
	report->error_px = (double)(place_error < extent ? place_error : extent);
	if (plan->with_splats)
		report->levels |= report->levels & 1 ? 2 : 0;
	else if (plan->is_full)
		report->levels = (2u << PSR_MAX_DEPTH_LEVEL) - 1;
	note_tests(plan, report, n_masked, n_mixed);
	const enum psr_why none = plan->asks_ewa ? PSR_WHY_NOTHING : PSR_WHY_OFF;
	effect_note(report, PSR_EFFECT_SPLATS, n_splats ? PSR_WHY_RAN : none, n_splats);
}

int cull_blocks(struct bins *bins, const struct simd *simd, struct plan *plan, struct psr_pool *pool,
                struct psr_report *report)
{
	const uint32_t n_tiles = plan->tiles_x * plan->tiles_y, line = 64 / sizeof *bins->count;
	const uint32_t stride = (n_tiles * BIN_KINDS + line - 1) / line * line;
	struct cull cull = { bins, simd, plan, 0, n_tiles, stride, 0 };
	int rc = bins_room(bins, group, plan->n_groups) ? PSR_OK : PSR_ERR_MEMORY;

	if (rc == PSR_OK)
		rc = cull_choose_levels(bins, plan, pool);
	if (rc == PSR_OK)
		rc = cull_make_chunks(bins, plan, &cull.n_chunks);
	if (rc == PSR_OK)
		rc = make_room(bins, &cull);
	if (rc)
		return rc;
	memset(bins->is_quiet, 1, plan->parts_x * plan->parts_y);
	for (uint32_t i = 0; i < plan->n_instances && !plan_is_cancelled(plan); i++)
		if (plan->instance[i].masks == PSR_WHY_RAN)
			cull_masks_make(&bins->masks[i], plan, &plan->instance[i]);
	rc = psr_pool_for_until(pool, &plan->cancel, (int)cull.n_chunks, count_chunk, &cull);
	if (rc == PSR_OK)
		rc = place_entries(bins, &cull);
	if (rc == PSR_OK)
		rc = psr_pool_for_until(pool, &plan->cancel, (int)cull.n_chunks, fill_chunk, &cull);
	if (rc == PSR_OK)
		sum_up(&cull, plan, report);
	return rc;
}
