/* Cubes by runs of 64: those of a run that are drawn alike, in the same tiles, are one hit. Most runs are in one tile
 * and before the eye, and what their cubes' flags say decides the depth buffer: then the run's bound tells all but how
 * its cubes face. */
#include "base/vec.h"
#include "cull.h"

#define ROUNDING 1e-4f /* more than what floats are off by, of lengths that are compared with cubes' */

/* The cubes of a run that are drawn, by the level in their flags, which is how wide leaves are drawn. */
struct chosen {
	uint32_t first, n; /* the run */
	uint64_t cubes[PSR_BLOCK_LEVEL + 1];
};

/* What the hits of a run have in common. */
struct alike {
	float near;
	int32_t level, tiles; /* the latter as cull_tiles() */
	int32_t x[2], y[2];
};

/* ---- counting ---- */

static uint32_t leaf_of(const struct psr_cubes *cubes, const struct psr_cube_level *level, uint32_t cube)
{
	return cube < level->first + level->n ? psr_cubes_leaf(cubes, level, cube) : (uint32_t)level->tree->n_leaves;
}

/* The leaves of the cubes of a mask. Cubes that follow each other are counted at once. */
static uint64_t count_leaves(const struct psr_cubes *cubes, uint32_t first, uint64_t mask)
{
	const struct psr_cube_level *level = psr_cubes_level(cubes, first);
	uint64_t n = 0;

	while (mask) {
		const uint32_t from = (uint32_t)__builtin_ctzll(mask);
		const uint64_t others = ~(mask | ((UINT64_C(1) << from) - 1));
		const uint32_t end = others ? (uint32_t)__builtin_ctzll(others) : CUBES_RUN;

		n += leaf_of(cubes, level, first + end) - leaf_of(cubes, level, first + from);
		mask &= end < CUBES_RUN ? UINT64_MAX << end : 0;
	}
	return n;
}

static void put_hit(struct cull_counting *to, const struct alike *alike, uint32_t first, uint64_t mask, int is_mixed)
{
	const struct plan *plan = to->plan;
	struct cull_hit *hit = to->hit;
	const int level = alike->level < PSR_MAX_DEPTH_LEVEL ? alike->level : PSR_MAX_DEPTH_LEVEL;

	if (!mask)
		return;
	*hit = (struct cull_hit){
		.slot = plan->instance[to->chunk->instance].first_slot + first, .instance = (uint16_t)to->chunk->instance,
		.near = alike->near, .level = (uint8_t)level, .is_mixed = is_mixed & 1, .is_wide = level > 0,
		.kind = plan->caster <= SHADOW_OPAQUE ? BIN_WARPED : BIN_GLASS,
		.x0 = (uint16_t)alike->x[0], .x1 = (uint16_t)alike->x[1],
		.y0 = (uint16_t)alike->y[0], .y1 = (uint16_t)alike->y[1],
		.tile_x0 = (uint8_t)alike->tiles, .tile_x1 = (uint8_t)(alike->tiles >> 8),
		.tile_y0 = (uint8_t)(alike->tiles >> 16), .tile_y1 = (uint8_t)(alike->tiles >> 24),
	};
	hit->at_border = (hit->x0 == 0) | (hit->y0 == 0) | (hit->x1 == plan->width - 1) | (hit->y1 == plan->height - 1);
	*to->cubes++ = mask;
	to->hit++;
	cull_count_tiles(to, hit);
	to->chunk->levels |= 1u << level;
	to->chunk->n_clamped += alike->level > PSR_MAX_DEPTH_LEVEL ? cull_count_bits(mask) : 0;
}

static void note_run(struct cull_counting *to, uint32_t first, uint64_t left, uint64_t mixed, float apart,
                     float depth_error)
{
	const struct plan_instance *in = &to->plan->instance[to->chunk->instance];
	const float error = cull_place_error(to->plan, in, 0, apart, depth_error);
	struct cull_chunk *chunk = to->chunk;

	chunk->flags |= in->cull.blocks->flags[first];
	chunk->n_drawn += cull_count_bits(left);
	chunk->n_mixed += cull_count_bits(mixed);
	chunk->n_samples += count_leaves(in->cull.cubes, first, left);
	chunk->place_error = error > chunk->place_error ? error : chunk->place_error;
}

/* ---- runs of which the kernel tests each cube ---- */

/* The cubes of a mask that have the level and tiles of cube i. */
static uint64_t find_alike(const struct cull_batch *batch, uint32_t i, uint64_t mask)
{
	const int32_t tiles = cull_tiles(batch, i), level = batch->level[i];
	uint64_t alike = 0;

	for (uint64_t left = mask; left; left &= left - 1) {
		const uint32_t k = (uint32_t)__builtin_ctzll(left);

		alike |= (uint64_t)(cull_tiles(batch, k) == tiles && batch->level[k] == level) << k;
	}
	return alike;
}

/* The pixels of each hit are those of all cubes that are left. */
static void take_batch(struct cull_counting *to, const struct cull_batch *batch, uint32_t first, uint64_t chosen)
{
	const struct cull_sum *sum = &batch->sum;
	const int are_alike = sum->tiles[0] == sum->tiles[1] && sum->level[0] == sum->level[1];

	for (uint64_t left = sum->left & chosen, these; left; left &= ~these) {
		const uint32_t i = (uint32_t)__builtin_ctzll(left);
		const struct alike alike = { sum->near, batch->level[i], cull_tiles(batch, i), { sum->x0, sum->x1 },
			                         { sum->y0, sum->y1 } };

		these = are_alike ? left : find_alike(batch, i, left);
		put_hit(to, &alike, first, these & sum->mixed, 1);
		put_hit(to, &alike, first, these & ~sum->mixed, 0);
	}
	if (sum->left & chosen)
		note_run(to, first, sum->left & chosen, sum->mixed & chosen, sum->apart, sum->depth_error);
}

/* ---- runs of which the bound tells enough ---- */

/* How many pixels a unit of length spans at most and at least, in the spheres of cubes in this one, whose middles are
 * before the eye: |p| / z'^2 (cull_stretch()). */
static void find_stretch(float stretch[2], const struct cull_view *v, const struct cull_sphere *s)
{
	const float far = s->c[2] + s->r, side = __builtin_sqrtf(v3f_dot(s->c, s->c)) - s->r;

	stretch[0] = cull_stretch(v, s->c[0], s->c[1], s->c[2], s->r, s->c[2] - s->r) * (1 + ROUNDING);
	stretch[1] = v->focal * (1 - ROUNDING) * (!v->perspective ? 1 : (side > far ? side : far) / (far * far));
}

/* Finds the tile of an axis that holds all which the sphere's samples can reach. Returns whether it is one, and the
 * sphere within the picture. */
static int find_tile(int32_t *tile, const float bound[2], float size, int32_t tile_size)
{
	const float most = size - 1;
	const float first = bound[0] - 2 > 0 ? bound[0] - 2 : 0, last = bound[1] + 2 < most ? bound[1] + 2 : most;

	if (!(bound[0] >= 0 && bound[1] <= most))
		return 0;
	*tile = (int32_t)first / tile_size;
	return (int32_t)last / tile_size == *tile;
}

/* Finds an axis' first and last pixel of the sphere. */
static void find_side(int32_t side[2], const float bound[2], float band, float size)
{
	const float most = size - 1, low = bound[0] - band, high = bound[1] + band;

	side[0] = (int32_t)(low > 0 ? low : 0);
	side[1] = (int32_t)(high < most ? high : most);
}

/* What the bound tells of a run. */
struct told {
	struct alike alike[PSR_BLOCK_LEVEL + 1]; /* of what is as wide */
	float stretch[2];
	int widest;
};

/* Returns whether all cubes of a run are in the picture, within one tile, and those that are as wide need the depth
 * buffer of one level. */
static int find_alike_by_bound(struct told *out, const struct plan *plan, const struct plan_instance *in,
                               const struct chosen *run, const struct cull_sphere *sphere)
{
	const struct cull_view *v = &in->cull;
	float bound[2][2];
	int32_t tile_x, tile_y;

	if (!(sphere->c[2] - sphere->r > plan->near_z))
		return 0;
	cull_bound_sphere(bound, plan, sphere);
	if (!find_tile(&tile_x, bound[0], v->width, TILE_WIDTH) || !find_tile(&tile_y, bound[1], v->height, TILE_HEIGHT))
		return 0;
	find_stretch(out->stretch, v, sphere);
	for (int w = 0; w <= PSR_BLOCK_LEVEL; w++) {
		const float spacing = v->spacing * (float)(1u << w);
		struct alike *alike = &out->alike[w];

		if (!run->cubes[w])
			continue;
		alike->level = cull_level(out->stretch[0] * spacing * CULL_LESS);
		if (alike->level != cull_level(out->stretch[1] * spacing * CULL_LESS) || alike->level > PSR_MAX_DEPTH_LEVEL)
			return 0;
		const float band = (float)(1u << alike->level) + 2;
		find_side(alike->x, bound[0], band, v->width);
		find_side(alike->y, bound[1], band, v->height);
		alike->near = (sphere->c[2] - sphere->r) * (1 - ROUNDING);
		alike->tiles = tile_x | tile_x << 8 | tile_y << 16 | tile_y << 24;
		out->widest = w;
	}
	return 1;
}

static void take_run(struct cull_counting *to, const struct psr_cube_level *level, const struct chosen *run)
{
	const struct plan *plan = to->plan;
	const struct plan_instance *in = &plan->instance[to->chunk->instance];
	struct cull_batch batch;
	struct told told;
	uint64_t chosen = 0;

	for (int w = 0; w <= PSR_BLOCK_LEVEL; w++)
		chosen |= run->cubes[w];
	if (!chosen || plan_is_cancelled(plan))
		return;
	const struct psr_cube_bound *bound = &level->bound[(run->first - level->first) / CUBES_RUN];
	const struct cull_sphere sphere = cull_view_sphere(in, bound->center, bound->radius);
	if (!cull_sees_sphere(plan, &sphere))
		return;
	const enum cull_facing facing = cull_run_faces(in, bound, in->cull.blocks->flags[run->first]);
	if (facing == CULL_AWAY)
		return;
	to->chunk->n_tested += cull_count_bits(chosen);
	if (!find_alike_by_bound(&told, plan, in, run, &sphere)) {
		to->simd->cull(&batch, &in->cull, run->first, run->n);
		take_batch(to, &batch, run->first, chosen);
		return;
	}
	batch.sum.left = chosen;
	batch.sum.mixed = facing == CULL_FACES_EYE ? 0 : chosen;
	if (facing == CULL_MIXED && cull_asks_cones(&in->cull))
		to->simd->cull_cones(&batch, &in->cull, run->first, run->n);
	const uint64_t left = batch.sum.left & chosen, mixed = batch.sum.mixed & chosen;
	for (int w = 0; w <= told.widest; w++) {
		put_hit(to, &told.alike[w], run->first, run->cubes[w] & mixed, 1);
		put_hit(to, &told.alike[w], run->first, run->cubes[w] & left & ~mixed, 0);
	}
	if (left)
		note_run(to, run->first, left, mixed, told.stretch[0] * in->cull.spacing * (float)(1u << told.widest),
		         told.stretch[0] * in->cull.scale * (float)(level->edge * (CUBES_DIAGONAL / 2)));
}

/* A chunk is of one level, whose clusters are in the order of groups. The cubes of a cluster are as wide. */
void cull_count_runs(struct cull_counting *to)
{
	const struct cull_chunk *chunk = to->chunk;
	const struct plan_instance *in = &to->plan->instance[chunk->instance];
	const struct psr_blocks *b = in->cull.blocks;
	const struct psr_cube_level *level = psr_cubes_level(in->cull.cubes, chunk->first_block);
	const struct cull_group *group = to->bins->group + in->first_group;
	const uint32_t end = chunk->first_block + chunk->n_blocks, level_end = level->first + level->n;
	const uint32_t l = (uint32_t)(level - in->cull.cubes->level), n_groups = b->n_clusters / b->n_levels;
	struct chosen run = { .first = UINT32_MAX }; /* none yet */

	for (uint32_t g = chunk->first_cluster - l * n_groups, next, step; g < n_groups; g += step) {
		const struct psr_cluster *k = &b->cluster[l * n_groups + g];

		if (k->first_block >= end)
			break;
		step = group[g].n_alike;
		if (group[g].level != l || group[g].is_out)
			continue;
		step = 1;
		uint32_t first = k->first_block > chunk->first_block ? k->first_block : chunk->first_block;
		const uint32_t own_end = k->first_block + k->n_blocks < end ? k->first_block + k->n_blocks : end;
		for (; first < own_end; first = next) {
			const uint32_t in_run = (first - level->first) % CUBES_RUN, begin = first - in_run;

			next = own_end - begin < CUBES_RUN ? own_end : begin + CUBES_RUN;
			if (begin != run.first) {
				take_run(to, level, &run);
				run = (struct chosen){ .first = begin, .n = level_end - begin < CUBES_RUN ? level_end - begin : CUBES_RUN };
			}
			run.cubes[psr_blocks_level(b, first)] |= UINT64_MAX >> (CUBES_RUN - (next - first)) << in_run;
		}
	}
	take_run(to, level, &run);
}
