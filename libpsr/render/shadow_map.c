#include <math.h>
#include <stdatomic.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "cull.h"
#include "shadow.h"

/* Cells. The half bounds how far samples lie from the centre of their cell in each direction; a whole width covers
 * shading normals that differ from the surface's. */
#define SLOPE_BIAS 0.5
#define TEXEL_BIAS 1.0

#define SINK_PARTS 16

struct drawing {
	const struct simd *simd;
	const struct bins *bins;
	struct shadow_drawer *drawer;
	struct psr_zstack stack;
	const struct shadow_map *map;
	float *cells; /* the drawer's: of level 0, and of the map's other levels */
	uint16_t *kept_cells; /* the map's, in the same order */
	uint32_t stride;
	_Atomic uint64_t n_samples;
};

static void clear_cells(float *cells, size_t n)
{
	for (size_t i = 0; i < n; i++)
		cells[i] = INFINITY;
}

/* Tiles without blocks need no warp unless their cells must be cleared. `own`: words for the tile. */
static void draw_tile(struct drawing *d, uint32_t tile, uint64_t *own)
{
	const struct plan *plan = &d->drawer->plan;
	const uint32_t x0 = tile % plan->tiles_x * TILE_WIDTH, y0 = tile / plan->tiles_x * TILE_HEIGHT;
	const uint32_t width = plan->width - x0 < TILE_WIDTH ? plan->width - x0 : TILE_WIDTH;
	const int is_empty = !d->stack.levels && d->bins->tile_begin[tile] == d->bins->tile_begin[tile + 1];
	const struct warp_into into = { &d->stack, 0, own, NULL };

	if (!is_empty)
		atomic_fetch_add(&d->n_samples, warp_tile(d->simd, plan, d->bins, &into, tile).n_inside);
	for (uint32_t y = y0; y < y0 + TILE_HEIGHT && y < plan->height; y++) {
		float *to = d->cells + (size_t)(y + 1) * d->stride + x0 + 1;

		if (is_empty)
			clear_cells(to, width);
		else
			d->simd->depth_row(to, own + (size_t)(y - y0) * WARP_OWN_STRIDE, width, 0);
	}
}

static void draw_one(int i, void *userdata)
{
	struct drawing *d = userdata;
	const int slot = slots_take(&d->drawer->slots);

	draw_tile(d, (uint32_t)d->bins->by_work[i], d->drawer->word + (size_t)slot * WARP_OWN_WORDS);
	slots_give(&d->drawer->slots, slot);
}

/* The guard band of level 0, into which no sample falls. */
static void clear_band(const struct drawing *d)
{
	const uint32_t height = d->stack.height + 2;

	clear_cells(d->cells, d->stride);
	clear_cells(d->cells + (size_t)(height - 1) * d->stride, d->stride);
	for (uint32_t y = 1; y + 1 < height; y++)
		d->cells[(size_t)y * d->stride] = d->cells[(size_t)(y + 1) * d->stride - 1] = INFINITY;
}

static int has_seam(const struct shadow_map *map, int k)
{
	return k > 0 && map->levels >> k & 1 && map->levels >> (k - 1) & 1;
}

/* The drawer's depths of these cells of the map. */
static float *drawn(const struct drawing *d, const uint16_t *cells)
{
	return d->cells + (cells - d->map->level[0].z);
}

/* Cell (i, j) of level k, counted from the guard band, contains cells 2 i - 1 and 2 i, 2 j - 1 and 2 j of the finer
 * level, as far as these exist. */
static void make_seams(int k, void *userdata)
{
	const struct drawing *d = userdata;
	const struct shadow_map *map = d->map;

	if (!has_seam(map, k))
		return;
	const uint32_t stride = map->level[k].stride, finer = map->level[k - 1].stride;
	const uint32_t height = d->stack.level[k].height, finer_height = d->stack.level[k - 1].height;
	const float *own = drawn(d, map->level[k].z), *fine = drawn(d, map->level[k - 1].z);
	float *to = drawn(d, map->level[k].seam);
	for (uint32_t j = 0; j < height && !plan_is_cancelled(&d->drawer->plan); j++)
		for (uint32_t i = 0; i < stride; i++) {
			float z = own[(size_t)j * stride + i];

			for (uint32_t y = j ? 2 * j - 1 : 0; y <= 2 * j && y < finer_height; y++)
				for (uint32_t x = i ? 2 * i - 1 : 0; x <= 2 * i && x < finer; x++) {
					const float part = fine[(size_t)y * finer + x];

					z = part < z ? part : z;
				}
			to[(size_t)j * stride + i] = z;
		}
}

static void sink_rows(const struct drawing *d, const uint16_t *cells, int k, uint32_t begin, uint32_t end)
{
	const uint32_t stride = d->map->level[k].stride, last = d->stack.level[k].height - 1;
	const float *from = drawn(d, cells);
	uint16_t *to = d->kept_cells + (cells - d->map->level[0].z);

	for (uint32_t j = begin; j < end; j++) {
		const float *own = from + (size_t)j * stride;
		const struct shadow_rows rows = { j ? own - stride : own, own, j < last ? own + stride : own };

		d->simd->shadow_sink(to + (size_t)j * stride, &rows, stride, d->map->from, d->map->step);
	}
}

static void sink_part(int part, void *userdata)
{
	const struct drawing *d = userdata;

	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const uint32_t height = d->stack.level[k].height;
		const uint32_t begin = height * (uint32_t)part / SINK_PARTS, end = height * ((uint32_t)part + 1) / SINK_PARTS;

		if (plan_is_cancelled(&d->drawer->plan))
			return;
		if (d->map->level[k].z != NULL)
			sink_rows(d, d->map->level[k].z, k, begin, end);
		if (d->map->level[k].seam != NULL)
			sink_rows(d, d->map->level[k].seam, k, begin, end);
	}
}

static int prepare_cells(struct shadow_kept *kept, struct drawing *d, uint32_t levels)
{
	const uint32_t width = kept->fit.width, height = kept->fit.height;
	size_t n = 0, first[PSR_MAX_DEPTH_LEVEL + 1], seam[PSR_MAX_DEPTH_LEVEL + 1];

	kept->map.levels = levels | 1;
	zbuffer_measure(&d->stack, width, height, levels & ~1u);
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const uint32_t cells_x = d->stack.level[k].width, cells_y = d->stack.level[k].height;

		kept->map.level[k].stride = cells_x;
		kept->map.level[k].most_x = (float)(cells_x - 2) - 0.5f;
		kept->map.level[k].most_y = (float)(cells_y - 2) - 0.5f;
		first[k] = n;
		if (kept->map.levels >> k & 1)
			n += (size_t)cells_x * cells_y;
		seam[k] = n;
		if (has_seam(&kept->map, k))
			n += (size_t)cells_x * cells_y;
	}
	struct shadow_drawer *drawer = d->drawer;
	kept->cells = psr_grow_huge(kept->cells, &kept->cells_size, n * sizeof *kept->cells);
	drawer->cells = psr_grow_huge(drawer->cells, &drawer->cells_size, n * sizeof *drawer->cells);
	if (kept->cells == NULL || drawer->cells == NULL)
		return PSR_ERR_MEMORY;
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const int is_used = kept->map.levels >> k & 1;

		kept->map.level[k].z = is_used ? kept->cells + first[k] : NULL;
		kept->map.level[k].seam = has_seam(&kept->map, k) ? kept->cells + seam[k] : NULL;
		d->stack.level[k].z = k && is_used ? drawer->cells + first[k] : NULL;
	}
	d->cells = drawer->cells;
	d->kept_cells = kept->cells;
	d->map = &kept->map;
	d->stride = kept->map.level[0].stride;
	return PSR_OK;
}

static void note_plan(struct shadow_kept *kept, const struct plan *plan)
{
	memcpy(kept->axes, plan->axes, sizeof kept->axes);
	memcpy(kept->eye, plan->eye, sizeof kept->eye);
	kept->exponent = plan->exponent;
	kept->map.perspective = plan->perspective;
	kept->map.focal = plan->focal;
	kept->map.near_z = plan->near_z;
	kept->map.half_width = plan->view.half_width;
	kept->map.half_height = plan->view.half_height;
	kept->map.from = (float)ldexp(kept->fit.nearest, -plan->exponent);
	kept->map.step = (float)ldexp((kept->fit.farthest - kept->fit.nearest) / SHADOW_EMPTY, -plan->exponent);
}

int shadow_map_draw(struct shadow_kept *kept, struct shadow_drawer *drawer, const struct shadow_call *call)
{
	struct render_settings settings;
	struct psr_scene scene = *call->scene;
	struct psr_report report = { 0 };
	struct plan *plan = &drawer->plan;
	struct drawing d = { .simd = call->simd, .bins = call->bins, .drawer = drawer };

	scene.camera = kept->fit.camera;
	scene.n_lights = 0;
	kept->is_drawn = 0;
	render_settings_default(&settings, kept->fit.width, kept->fit.height);
	settings.cull_tests = 0;
	settings.cancel = *call->cancel;
	int rc = plan_make(plan, &scene, &settings, call->err);
	if (rc)
		return rc;
	plan->caster = kept->caster;
	for (uint32_t i = 0; i < plan->n_instances; i++)
		plan->instance[i].cull.both_sides = 1;
	rc = cull_blocks(call->bins, call->simd, plan, call->pool, &report);
	if (rc == PSR_ERR_LIMIT)
		return psr_fail(call->err, rc, "too many blocks for a shadow map");
	if (rc == PSR_ERR_CANCELLED)
		return render_cancelled(call->err);
	drawer->word = psr_grow_huge(drawer->word, &drawer->word_size,
	                             (size_t)slots_most(call->pool) * WARP_OWN_WORDS * sizeof *drawer->word);
	if (rc || drawer->word == NULL || prepare_cells(kept, &d, report.levels))
		return psr_fail(call->err, PSR_ERR_MEMORY, "no memory for a shadow map of %ux%u", kept->fit.width,
		                kept->fit.height);
	note_plan(kept, plan);
	clear_band(&d);
	rc = psr_pool_for_until(call->pool, call->cancel, (int)(plan->tiles_x * plan->tiles_y), draw_one, &d);
	if (rc == PSR_OK)
		rc = psr_pool_for_until(call->pool, call->cancel, PSR_MAX_DEPTH_LEVEL + 1, make_seams, &d);
	if (rc == PSR_OK)
		rc = psr_pool_for_until(call->pool, call->cancel, SINK_PARTS, sink_part, &d);
	if (rc)
		return render_cancelled(call->err);
	kept->is_drawn = 1;
	call->report->count[PSR_STAGE_SHADOW] += d.n_samples;
	return PSR_OK;
}

void shadow_map_bind(struct shadow_map *out, const struct shadow_kept *kept, const struct plan *plan)
{
	const double scale = ldexp(1, plan->exponent - kept->exponent);
	double turn[3][3], move[3];

	*out = kept->map;
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			turn[a][b] = v3d_dot(kept->axes[a], plan->axes[b]) * scale;
	v3d_sub(move, plan->eye, kept->eye);
	m3d_apply(move, (const double(*)[3])kept->axes, move);
	v3d_scale(move, move, ldexp(1, -kept->exponent));
	for (int a = 0; a < 3; a++) {
		v3f_set(out->turn[a], (float)turn[a][0], (float)turn[a][1], (float)turn[a][2]);
		out->move[a] = (float)move[a];
	}
	out->scale = (float)scale;
	/* Coordinates are at most 1 in both units; each of some eight operations errs by half of a last bit. */
	const double rounding = 4 * 0x1p-23 * (1 + scale);
	out->slack = (float)rounding;
	out->slope_bias = (float)SLOPE_BIAS;
	out->texel_bias = (float)TEXEL_BIAS;
}
