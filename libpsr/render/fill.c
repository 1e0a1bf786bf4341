#include <math.h>
#include <stdatomic.h>
#include <string.h>
#include "base/mem.h"
#include "render/render.h"

/* Beyond the paper, both phases know depth: what shines through a hole is whatever is nearest, so among the pixels that
 * are averaged only those count that are not behind the nearest by more than a cell's threshold. A near edge's colour
 * thus is not mixed with the background's before it fills a hole, and depths are filled along with colours. */

#define ROWS 32 /* rows that a thread takes at a time */

struct pass {
	struct fill *fill;
	const struct plan *plan;
	int level; /* the finer one of the two */
	_Atomic int deepest; /* coarsest level with a cell of weight below a half, which has a coarser one's depth */
	_Atomic uint64_t n_changed, n_filled, n_moved; /* pixels; moved: of another depth than their own */
};

static float limit_of(const struct plan *plan, int level, float nearest)
{
	int k = level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL;
	return nearest * plan->gap_scale[k] + plan->gap_offset[k];
}

/* Cell (x, y) of the coarser level: the sum of its four, premultiplied; divided where the weights exceed one. */
static void pull_cell(const struct pass *pass, uint32_t x, uint32_t y)
{
	const struct fill_level *from = &pass->fill->level[pass->level], *to = from + 1;
	size_t child[4];
	int n = 0;
	float nearest = INFINITY;
	for (uint32_t v = 2 * y; v <= 2 * y + 1 && v < from->height; v++)
		for (uint32_t u = 2 * x; u <= 2 * x + 1 && u < from->width; u++) {
			size_t at = (size_t)v * from->width + u;
			if (!from->weight[at])
				continue;
			child[n++] = at;
			nearest = from->z[at] < nearest ? from->z[at] : nearest;
		}

	const float limit = limit_of(pass->plan, pass->level + 1, nearest);
	uint32_t w = 0, sum[3] = { 0, 0, 0 };
	float z = 0;
	for (int i = 0; i < n; i++) {
		size_t at = child[i];
		if (from->z[at] > limit)
			continue;
		uint32_t own = from->weight[at];
		for (int k = 0; k < 3; k++) /* only level 0 is not premultiplied */
			sum[k] += pass->level ? from->rgb[3 * at + (size_t)k] : from->rgb[3 * at + (size_t)k] * own / WEIGHT_ONE;
		z += (float)own * from->z[at];
		w += own;
	}
	size_t at = (size_t)y * to->width + x;
	for (int k = 0; k < 3; k++)
		to->rgb[3 * at + (size_t)k] = (uint16_t)(w > WEIGHT_ONE ? sum[k] * WEIGHT_ONE / w : sum[k]);
	to->weight[at] = (uint16_t)(w > WEIGHT_ONE ? WEIGHT_ONE : w);
	to->z[at] = w ? z / (float)w : INFINITY;
}

static void pull_rows(int i, void *userdata)
{
	struct pass *pass = userdata;
	const struct fill_level *to = &pass->fill->level[pass->level + 1];
	int is_moved = 0;
	for (uint32_t y = (uint32_t)i * ROWS; y < ((uint32_t)i + 1) * ROWS && y < to->height; y++)
		for (uint32_t x = 0; x < to->width; x++) {
			pull_cell(pass, x, y);
			is_moved |= to->weight[(size_t)y * to->width + x] < WEIGHT_ONE / 2;
		}
	if (is_moved) {
		int seen = atomic_load(&pass->deepest);
		while (seen < pass->level + 1 && !atomic_compare_exchange_weak(&pass->deepest, &seen, pass->level + 1))
			;
	}
}

/* The interpolated colour of a finer cell: its parent counts a half, the parent's two neighbours on the cell's own
 * side a quarter each ([G] figure 4.11a). */
static float interpolate(const struct pass *pass, uint32_t x, uint32_t y, uint32_t rgb[3])
{
	const struct fill_level *from = &pass->fill->level[pass->level + 1];
	const uint32_t px = x / 2, py = y / 2;
	const uint32_t nx = x & 1 ? px + 1 : px - 1, ny = y & 1 ? py + 1 : py - 1;
	size_t at[3] = { (size_t)py * from->width + px };
	int n = 1;
	if (nx < from->width)
		at[n++] = (size_t)py * from->width + nx;
	if (ny < from->height)
		at[n++] = (size_t)ny * from->width + px;

	float nearest = INFINITY, z = 0;
	for (int i = 0; i < n; i++)
		nearest = from->z[at[i]] < nearest ? from->z[at[i]] : nearest;
	const float limit = limit_of(pass->plan, pass->level + 1, nearest);
	uint32_t w = 0;
	rgb[0] = rgb[1] = rgb[2] = 0;
	for (int i = 0; i < n; i++) {
		if (from->z[at[i]] > limit)
			continue;
		uint32_t share = i ? 1 : 2;
		for (int k = 0; k < 3; k++)
			rgb[k] += share * from->rgb[3 * at[i] + (size_t)k];
		z += (float)share * from->z[at[i]];
		w += share;
	}
	for (int k = 0; k < 3; k++)
		rgb[k] /= w;
	return z / (float)w;
}

static void push_rows(int i, void *userdata)
{
	struct pass *pass = userdata;
	const struct fill_level *to = &pass->fill->level[pass->level];
	uint64_t n_changed = 0, n_filled = 0, n_moved = 0;
	for (uint32_t y = (uint32_t)i * ROWS; y < ((uint32_t)i + 1) * ROWS && y < to->height; y++)
		for (uint32_t x = 0; x < to->width; x++) {
			size_t at = (size_t)y * to->width + x;
			uint32_t w = to->weight[at], rgb[3];
			if (w == WEIGHT_ONE)
				continue;
			float z = interpolate(pass, x, y, rgb);
			for (int k = 0; k < 3; k++) {
				uint32_t own = to->rgb[3 * at + (size_t)k];
				if (!pass->level)
					own = own * w / WEIGHT_ONE;
				to->rgb[3 * at + (size_t)k] = (uint16_t)(own + rgb[k] * (WEIGHT_ONE - w) / WEIGHT_ONE);
			}
			if (w < WEIGHT_ONE / 2) {
				to->z[at] = z;
				n_moved++;
			}
			n_changed++;
			n_filled += w == 0 && z < INFINITY;
		}
	if (!pass->level) {
		atomic_fetch_add(&pass->n_changed, n_changed);
		atomic_fetch_add(&pass->n_filled, n_filled);
		atomic_fetch_add(&pass->n_moved, n_moved);
	}
}

/* The single cell at the top has nothing above it: what it holds becomes whole, or the background if it is empty. */
static void finish_top(struct fill_level *top, const struct plan *plan)
{
	uint32_t w = top->weight[0];
	for (int k = 0; k < 3; k++)
		top->rgb[k] = (uint16_t)(w ? top->rgb[k] * (uint32_t)WEIGHT_ONE / w : plan->background[k]);
}

int fill_prepare(struct fill *fill, uint32_t width, uint32_t height, uint16_t *rgb, uint16_t *weight, float *z)
{
	size_t cells = 0;
	int n = 0;
	for (uint32_t w = width, h = height; w > 1 || h > 1; n++) {
		w = (w + 1) / 2;
		h = (h + 1) / 2;
		cells += (size_t)w * h;
	}
	size_t size = cells * (4 * sizeof(uint16_t) + sizeof(float));
	if (size > fill->storage_size) {
		psr_free(fill->storage);
		fill->storage = psr_alloc_array(size, 1);
		fill->storage_size = fill->storage ? size : 0;
		if (!fill->storage)
			return PSR_ERR_MEMORY;
	}
	fill->n_levels = n + 1;
	fill->level[0] = (struct fill_level){ width, height, rgb, weight, z };
	float *next_z = fill->storage;
	uint16_t *next_rgb = (uint16_t *)(next_z + cells), *next_weight = next_rgb + 3 * cells;
	for (int l = 1; l <= n; l++) {
		struct fill_level *level = &fill->level[l];
		level->width = (level[-1].width + 1) / 2;
		level->height = (level[-1].height + 1) / 2;
		size_t area = (size_t)level->width * level->height;
		level->z = next_z;
		level->rgb = next_rgb;
		level->weight = next_weight;
		next_z += area;
		next_rgb += 3 * area;
		next_weight += area;
	}
	return PSR_OK;
}

void fill_clear(struct fill *fill)
{
	psr_free(fill->storage);
	memset(fill, 0, sizeof *fill);
}

void fill_run(struct fill *fill, const struct plan *plan, struct psr_pool *pool, struct psr_report *report)
{
	struct pass pass = { .fill = fill, .plan = plan };
	const int top = fill->n_levels - 1;
	for (int l = 0; l < top; l++) {
		pass.level = l;
		psr_pool_for(pool, (int)((fill->level[l + 1].height + ROWS - 1) / ROWS), pull_rows, &pass);
	}
	if (top)
		finish_top(&fill->level[top], plan);
	for (int l = top - 1; l >= 0; l--) {
		pass.level = l;
		psr_pool_for(pool, (int)((fill->level[l].height + ROWS - 1) / ROWS), push_rows, &pass);
	}
	report->count[PSR_STAGE_FILL] = pass.n_changed;
	report->n_filled = pass.n_filled;
	if (pass.n_moved)
		report->error_bound += (double)(2 << pass.deepest);
}
