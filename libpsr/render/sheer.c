/* Adds up translucent layers, the nearest first, and mixes the sum with the finished picture. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "block.h"
#include "planes.h"
#include "sheer_tile.h"
#include "splat.h"
#include "thin.h"

/* Eight layers that each absorb half of the light leave less than one 8-bit code. */
#define MOST_LAYERS 8
/* A pixel is finished when less light than this is left: the rest changes any 8-bit code by less than half. */
#define LEAST_THROUGH (1.0f / 8192)
/* Thickness of a layer across the surface, in steps of the lattice. Overlapping discs of one surface differ in depth by
 * a step for the rim and as much for the slope. Along the line of sight a steep surface is thicker, at most ten times
 * at silhouettes. */
#define LAYER_STEPS 3.0f
#define LEAST_COSINE 0.1f
/* Light let through at most where depth and planes tell of the nearest layer. */
#define HALF 0.5f

int sheer_caster(float *opacity, const struct psr_blocks *b, uint32_t block)
{
	const uint8_t *of_sample = b->opacity + psr_blocks_attr_first(b, block);
	const int n = __builtin_popcountll(b->mask[block]);
	int sum = 0;

	for (int i = 0; i < n; i++)
		sum += of_sample[i];
	*opacity = (float)sum / (float)(n * PSR_OPAQUE);
	return *opacity <= 0.25f ? 1 : *opacity <= 0.5f ? 2 : *opacity <= 0.75f ? 3 : 4;
}

/* Finds the rows and columns that the blocks reach. */
static void find_area(struct sheer_area *area, const struct sheer_drawing *d, uint32_t tile, uint32_t begin, uint32_t end)
{
	const struct plan *plan = d->plan;

	const uint32_t x0 = tile % plan->tiles_x * TILE_WIDTH;
	const uint32_t end_x = plan->width - x0 < TILE_WIDTH ? plan->width : x0 + TILE_WIDTH;
	uint32_t low_x = end_x, high_x = x0;

	area->y0 = tile / plan->tiles_x * TILE_HEIGHT;
	const uint32_t end_y = plan->height - area->y0 < TILE_HEIGHT ? plan->height : area->y0 + TILE_HEIGHT;
	area->low_y = end_y;
	area->high_y = area->y0;
	for (uint32_t e = begin; e < end; e++) {
		const struct cull_hit *hit = &d->bins->hit[d->bins->entry[e].hit];

		area->low_y = hit->y0 < area->low_y ? hit->y0 : area->low_y;
		area->high_y = hit->y1 >= area->high_y ? hit->y1 + 1u : area->high_y;
		low_x = hit->x0 < low_x ? hit->x0 : low_x;
		high_x = hit->x1 >= high_x ? hit->x1 + 1u : high_x;
	}
	area->x0 = low_x > x0 ? low_x : x0;
	area->width = (high_x < end_x ? high_x : end_x) - area->x0;
	area->low_y = area->low_y > area->y0 ? area->low_y : area->y0;
	area->high_y = area->high_y < end_y ? area->high_y : end_y;
}

static void begin_tile(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area)
{
	for (uint32_t y = area->low_y; y < area->high_y; y++) {
		l->shown[y - area->y0] = (struct sheer_span){ area->width, 0 };
		const float *depth = d->picture->depth + (size_t)y * d->plan->width + area->x0;

		for (size_t at = sheer_place(area, y), x = 0; x < area->width; at++, x++) {
			l->before[at] = depth[x] * d->to_stack[0] * d->to_stack[1];
			l->first[at] = INFINITY;
		}
	}
}

static void begin_layers(struct sheer_tile *l, const struct sheer_area *area)
{
	memset(l->is_done, 0, sizeof l->is_done);
	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (size_t at = sheer_place(area, y), x = 0; x < area->width; at++, x++) {
			l->last[at] = SHEER_END;
			l->n_words[at] = 0;
			l->beyond[at] = 0;
			l->through[at] = 1;
			l->light[0][at] = l->light[1][at] = l->light[2][at] = 0;
		}
}

/* Returns the thickness in z' of a layer whose sample shows at pixel (x, y). */
static float thickness_of(const struct warp_instance *in, uint64_t attr, uint32_t x, uint32_t y, float rim)
{
	const float *n = psr_direction_table()[PSR_ATTR_NORMAL(attr)], u = (float)x + 0.5f, v = (float)y + 0.5f;
	float d[3];

	for (int k = 0; k < 3; k++)
		d[k] = (u * in->du[k] + v * in->dv[k]) + in->d0[k];
	const float cosine = __builtin_fabsf(v3f_dot(n, d)) / __builtin_sqrtf(v3f_dot(d, d));
	return LAYER_STEPS * rim / (cosine > LEAST_COSINE ? cosine : LEAST_COSINE);
}

/* Adds pixel i of those found in the strip from word `first` on. */
static void add_pixel(struct sheer_tile *l, const struct plan *plan, size_t first, uint32_t i)
{
	const struct strip_pixels *pixels = &l->pixels;
	const uint16_t color[3] = { l->strip.r[i], l->strip.g[i], l->strip.b[i] };
	const uint32_t id = pixels->id[i], x = pixels->x0 + pixels->x[i];
	const uint32_t n = plan_find_instance(plan, id / PSR_BLOCK_SAMPLES);
	const size_t at = first + pixels->x[i];
	const struct plan_instance *in = &plan->instance[n];
	const struct psr_blocks *b = in->cull.blocks;
	const uint32_t block = id / PSR_BLOCK_SAMPLES - in->first_slot, opacity = b->opacity[pixels->at[i] - b->attr];
	const float z = psr_word_z(l->word[at]), back = (float)opacity * (1.0f / PSR_OPAQUE);
	const float share = l->through[at] * back;

	for (int c = 0; c < 3; c++)
		l->light[c][at] += share * sheer_light(plan, color[c]);
	l->through[at] = opacity == PSR_OPAQUE ? 0 : l->through[at] - share;
	if (z < l->first[at]) {
		l->first[at] = z;
		l->front[at] = l->word[at];
	}
	l->beyond[at] = l->through[at] < LEAST_THROUGH
	                        ? INFINITY
	                        : z + thickness_of(&plan->warp[n], l->strip.attr[i], x, pixels->y, splat_rim(in, block));
}

/* Finds the nearest words beyond the layers drawn so far, and forgets those in front. */
static void find_layer(struct sheer_tile *l, const struct plan *plan, const struct sheer_area *area)
{
	struct sheer_list *list = &l->list;
	const size_t first = sheer_place(area, area->low_y);
	const float *beyond = l->beyond + first;
	uint64_t *nearest = l->word + first;
	uint32_t n = 0;

	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (size_t at = sheer_place(area, y), x = 0; x < area->width; at++, x++)
			l->word[at] = PSR_WORD_EMPTY;
	for (uint32_t i = 0; i < list->n && !plan_is_cancelled_at(plan, i); i++) {
		const struct sheer_word w = list->word[i];

		const int is_beyond = psr_word_z(w.word) > beyond[w.at];
		const uint64_t word = is_beyond ? w.word : PSR_WORD_EMPTY;

		nearest[w.at] = word < nearest[w.at] ? word : nearest[w.at];
		list->word[n] = w;
		n += (uint32_t)is_beyond;
	}
	list->n = n;
}

/* Closes pixel `at` if the layer goes on beside it at both of two places, as deep to less than its thickness, and lacks
 * it: there is nothing, or what lies further behind. */
static int close_pixel(struct sheer_tile *l, const struct plan *plan, size_t at, const uint64_t beside[2])
{
	const float z[2] = { psr_word_z(beside[0]), psr_word_z(beside[1]) }, middle = 0.5f * (z[0] + z[1]);
	const uint32_t slot = (uint32_t)beside[0] / PSR_BLOCK_SAMPLES, n = plan_find_instance(plan, slot);
	const struct plan_instance *in = &plan->instance[n];
	const float thick = LAYER_STEPS * splat_rim(in, slot - in->first_slot);

	if (!(__builtin_fabsf(z[0] - z[1]) < thick && psr_word_z(l->word[at]) - middle > 2 * thick) || middle <= l->beyond[at] ||
	    middle >= l->before[at])
		return 0;
	l->word[at] = (uint64_t)psr_bits_from_float(middle) << 32 | (uint32_t)beside[0];
	return 1;
}

/* Closes single pixels that no sample of a layer met, as where two projections of a model meet. One that nothing met,
 * with layers all around, shows the farther of those beside it: there the outline of what is in front passes. */
static void close_layer(struct sheer_tile *l, const struct plan *plan, const struct sheer_area *area)
{
	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (size_t at = sheer_place(area, y) + 1, x = 1; x + 1 < area->width; at++, x++) {
			const uint64_t word = l->word[at], row[2] = { l->word[at - 1], l->word[at + 1] };

			if (word > row[0] && word > row[1] && close_pixel(l, plan, at, row))
				continue;
			if (y == area->low_y || y + 1 == area->high_y)
				continue;
			const uint64_t column[2] = { l->word[at - WARP_OWN_STRIDE], l->word[at + WARP_OWN_STRIDE] };

			if (!(word > column[0] && word > column[1]) || close_pixel(l, plan, at, column))
				continue;
			const uint64_t farther = row[0] > row[1] ? row[0] : row[1];
			if (word == PSR_WORD_EMPTY && l->beyond[at] == 0 && word > farther && psr_word_z(farther) < l->before[at])
				l->word[at] = farther;
		}
}

/* Returns how many pixels the layer has. */
static uint64_t add_layer(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area)
{
	uint64_t n_pixels = 0;

	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (uint32_t x = 0; x < area->width; x += STRIP) {
			const uint32_t n = area->width - x < STRIP ? area->width - x : STRIP;
			const size_t first = sheer_place(area, y) + x;
			uint8_t *is_done = &l->is_done[y - area->y0][x / STRIP];

			if (*is_done)
				continue;
			if (plan_is_cancelled(d->plan))
				return 0;
			l->pixels.x0 = area->x0 + x;
			l->pixels.y = y;
			const uint32_t n_found = shade_part(d->simd, d->plan, l->word + first, n, &l->pixels, &l->strip);
			for (uint32_t i = 0; i < n_found; i++)
				__builtin_prefetch(psr_direction_table()[PSR_ATTR_NORMAL(l->strip.attr[i])]);
			for (uint32_t i = 0; i < n_found; i++)
				add_pixel(l, d->plan, first, i);
			sheer_show(l, area, y, x, n_found);
			*is_done = n_found == 0;
			n_pixels += n_found;
		}
	return n_pixels;
}

static uint8_t mix(const uint8_t *srgb, float light, float through, uint8_t code)
{
	const float mixed = light + through * psr_srgb_to_linear[code];

	return srgb[(int32_t)((mixed < 1 ? mixed : 1) * 65535 + 0.5f)];
}

static void mix_pixel(const struct sheer_tile *l, const struct sheer_picture *p, size_t from, size_t to, int is_wide)
{
	for (size_t c = 0; p->rgb != NULL && c < 3; c++)
		p->rgb[3 * to + c] = mix(p->srgb, l->light[c][from], l->through[from], p->rgb[3 * to + c]);
	for (size_t c = 0; is_wide && c < 3; c++)
		p->wide[c][to] = psr_root_of_light(l->light[c][from] + l->through[from] * psr_light_of_root(p->wide[c][to]));
}

static uint64_t end_layers(const struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area)
{
	const struct sheer_picture *p = d->picture;
	uint64_t n_pixels = 0;

	for (uint32_t y = area->low_y; y < area->high_y; y++) {
		const struct sheer_span shown = l->shown[y - area->y0];

		for (uint32_t x = shown.begin; x < shown.end; x++) {
			const size_t from = sheer_place(area, y) + x, to = (size_t)y * d->plan->width + area->x0 + x;

			if (!(l->first[from] < INFINITY))
				continue;
			mix_pixel(l, p, from, to, d->plan->is_wide);
			if (l->through[from] <= HALF)
				p->depth[to] = l->first[from] * d->to_world[0] * d->to_world[1];
			n_pixels++;
		}
	}
	return n_pixels;
}

/* Where the layers keep back half of the light or more, the planes tell of the nearest. */
static void put_planes(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area)
{
	for (uint32_t y = area->low_y; y < area->high_y && !plan_is_cancelled(d->plan); y++)
		for (uint32_t x = 0; x < area->width; x += STRIP) {
			const struct planes_part part = { area->x0 + x, y, area->width - x < STRIP ? area->width - x : STRIP };
			const size_t first = sheer_place(area, y) + x;

			for (size_t at = first; at < first + part.n; at++)
				l->word[at] = l->first[at] < INFINITY && l->through[at] <= HALF ? l->front[at] : PSR_WORD_EMPTY;
			planes_over(d->simd, d->plan, d->picture->planes, l->word + first, &part);
		}
}

/* Mixes what was drawn with the picture. */
static void end_tile(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area,
                     struct sheer_sum *sum)
{
	atomic_store(&sum->any_blocks, 1);
	atomic_fetch_add(&sum->n_pixels, end_layers(l, d, area));
	if (d->picture->planes != NULL)
		put_planes(l, d, area);
}

/* Draws the glass of a tile, layer by layer. */
static void draw_glass(struct sheer_tile *l, struct sheer_drawing *d, const struct sheer_area *area,
                       const struct warp_target *target, const struct sheer_entries *glass)
{
	const size_t first = sheer_place(area, area->low_y);

	begin_tile(l, d, area);
	begin_layers(l, area);
	l->list.before = l->before + first;
	l->list.last = l->last + first;
	l->list.n_words = l->n_words + first;
	l->list.n = 0;
	l->list.failed = 0; /* of an earlier picture */
	sheer_list_blocks(&l->list, d->simd, d->plan, d->bins->entry + glass->begin, glass->end - glass->begin, target);
	if (l->list.failed) {
		atomic_store(&d->failed, 1);
		return;
	}
	for (int layer = 0; layer < MOST_LAYERS; layer++) {
		find_layer(l, d->plan, area);
		close_layer(l, d->plan, area);
		if (!add_layer(l, d, area))
			break;
	}
	end_tile(l, d, area, &d->glass);
}

static void draw_tile(struct sheer_drawing *d, uint32_t tile, struct sheer_tile *l)
{
	const struct bins *bins = d->bins;
	const uint32_t begin = bins->thin_begin[tile], middle = bins->glass_begin[tile], end = bins->tile_begin[tile + 1];
	const struct psr_zstack stack = { .levels = 0 };
	struct warp_target target;
	struct sheer_area area;

	if (begin == end)
		return;
	const struct sheer_entries thin = { begin, middle }, glass = { middle, end };
	find_area(&area, d, tile, begin, end);
	warp_target_make(&target, d->plan, &stack, tile, l->word);
	target.x0 = (int32_t)area.x0;
	target.x1 = (int32_t)(area.x0 + area.width);
	target.y0 = (int32_t)area.low_y;
	target.y1 = (int32_t)area.high_y;
	if (begin < middle) {
		begin_tile(l, d, &area);
		thin_draw(l, d, &area, &target, &thin);
		end_tile(l, d, &area, &d->thin);
	}
	if (middle < end)
		draw_glass(l, d, &area, &target, &glass);
}

static void draw_one(int i, void *userdata)
{
	struct sheer_drawing *d = userdata;
	const int slot = slots_take(&d->sheer->slots);

	draw_tile(d, (uint32_t)d->bins->by_work[i], &d->sheer->tile[slot]);
	slots_give(&d->sheer->slots, slot);
}

void sheer_init(struct sheer *sheer)
{
	memset(sheer, 0, sizeof *sheer);
	thin_tabulate(sheer->bits);
}

static int make_tiles(struct sheer *sheer, int n)
{
	struct sheer_tile *tile = realloc(sheer->tile, (size_t)n * sizeof *tile);

	if (tile == NULL)
		return PSR_ERR_MEMORY;
	for (int i = sheer->n_tiles; i < n; i++)
		tile[i].list = (struct sheer_list){ .n = 0 };
	sheer->tile = tile;
	sheer->n_tiles = n;
	return PSR_OK;
}

int sheer_draw(struct sheer *sheer, const struct simd *simd, const struct plan *plan, const struct bins *bins,
               const struct sheer_picture *picture, struct psr_pool *pool)
{
	const int n_slots = slots_most(pool);
	struct sheer_drawing d = { .simd = simd, .plan = plan, .bins = bins, .picture = picture, .sheer = sheer };

	if (n_slots > sheer->n_tiles && make_tiles(sheer, n_slots))
		return PSR_ERR_MEMORY;
	psr_power_factors(d.to_world, picture->exponent);
	psr_power_factors(d.to_stack, -picture->exponent);
	const int rc = psr_pool_for_until(pool, &plan->cancel, (int)(plan->tiles_x * plan->tiles_y), draw_one, &d);
	sheer->thin = (struct sheer_counts){ d.thin.any_blocks, d.thin.n_pixels };
	sheer->glass = (struct sheer_counts){ d.glass.any_blocks, d.glass.n_pixels };
	return d.failed ? PSR_ERR_MEMORY : rc;
}

float *sheer_depths(struct sheer *sheer, const struct plan *plan)
{
	const size_t size = (size_t)plan->width * plan->height * sizeof *sheer->depth;

	sheer->depth = psr_grow_huge(sheer->depth, &sheer->depth_size, size);
	return sheer->depth;
}

void sheer_clear(struct sheer *sheer)
{
	for (int i = 0; i < sheer->n_tiles; i++)
		free(sheer->tile[i].list.word);
	free(sheer->tile);
	psr_free_huge(sheer->depth, sheer->depth_size);
}

uint64_t sheer_most_bytes(uint64_t n_pixels, int n_threads)
{
	const uint64_t grown = 2 * SHEER_MOST * n_pixels + 65536; /* sheer_grow() */
	const uint64_t n_words = grown < SHEER_LIST_MOST ? grown : SHEER_LIST_MOST;

	return n_pixels * sizeof(float) + (uint64_t)(n_threads + 1) * sizeof(struct sheer_tile)
	       + (uint64_t)n_threads * n_words * sizeof(struct sheer_word);
}

uint64_t sheer_bytes(const struct sheer *sheer)
{
	uint64_t n = sheer->depth_size + (uint64_t)sheer->n_tiles * sizeof *sheer->tile;

	for (int i = 0; i < sheer->n_tiles; i++)
		n += sheer->tile[i].list.capacity * sizeof *sheer->tile[i].list.word;
	return n;
}
