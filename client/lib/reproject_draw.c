#include <math.h>
#include <stdatomic.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "base/pool.h"
#include "base/view.h"
#include "reproject_inside.h"

#define TILE_PIXELS 32768   /* about; keys and places of them fit L2 */
#define MOST_WORK 64        /* pixels that a tile's cells look at, for each of its own: bounds the time of odd depths */

/* Whether things at different depths move apart rather up and down than to the sides. */
static int moves_up(const struct reproject_warp *warp)
{
	const float x = warp->of_d[0] - 0.5f * (float)warp->width * warp->of_d[2];
	const float y = warp->of_d[1] - 0.5f * (float)warp->height * warp->of_d[2];

	return fabsf(y) > fabsf(x);
}

/* Gaps are filled along lines: rows, or columns where depths move up and down. Tiles are bundles of lines. */
struct drawing {
	struct psr_reproject *r;
	struct psr_frame *to;
	struct reproject_warp warp;
	int has_columns;
	uint32_t n_lines, length, lines_a_tile; /* length: pixels of a line */
	unsigned bits;
	size_t tile_bytes;
	struct reproject_limit surface;
	atomic_uint next_tile;
	atomic_uint_least64_t covered, filled;
};

static void bound_row(int row, void *userdata)
{
	const struct drawing *d = userdata;
	const struct psr_reproject *r = d->r;
	const size_t at = (size_t)row * r->cells_a_row;
	const uint32_t n = r->n_cells[row];

	r->simd->reproject_bound(r->box + at, &d->warp, r->cell + at, n);
	for (uint32_t first = 0; first < n; first += REPROJECT_CHUNK) {
		struct reproject_range range = { UINT16_MAX, 0 };

		for (uint32_t i = first; i < first + REPROJECT_CHUNK && i < n; i++) {
			const struct reproject_box box = r->box[at + i];
			const uint16_t low = d->has_columns ? box.x0 : box.y0, high = d->has_columns ? box.x1 : box.y1;

			if (low < high) {
				range.first = low < range.first ? low : range.first;
				range.end = high > range.end ? high : range.end;
			}
		}
		r->range[(size_t)row * r->ranges_a_row + first / REPROJECT_CHUNK] = range;
	}
}

/* Cells that reach the tile, until they are enough for a call. */
struct list {
	struct reproject_cell cell[REPROJECT_LIST];
	struct reproject_box box[REPROJECT_LIST];
	uint32_t n;
	uint64_t work, most_work;
};

static void flush(const struct drawing *d, const struct reproject_tile *tile, struct list *list)
{
	if (list->n > 0)
		list->work += d->r->simd->reproject_cells(tile, &d->warp, list->cell, list->box, list->n);
	list->n = 0;
}

static void draw_chunk(const struct drawing *d, const struct reproject_tile *tile, struct list *list, size_t at,
                       uint32_t n)
{
	for (size_t i = at; i < at + n; i++) {
		const struct reproject_box box = d->r->box[i];

		list->cell[list->n] = d->r->cell[i];
		list->box[list->n] = box;
		list->n += (box.x0 < tile->x1) & (box.x1 > tile->x0) & (box.y0 < tile->y1) & (box.y1 > tile->y0);
		if (list->n == REPROJECT_LIST)
			flush(d, tile, list);
	}
}

static void draw_cells(const struct drawing *d, const struct reproject_tile *tile)
{
	const struct psr_reproject *r = d->r;
	const uint32_t low = d->has_columns ? tile->x0 : tile->y0, high = d->has_columns ? tile->x1 : tile->y1;
	struct list list = { .most_work = (uint64_t)MOST_WORK * (tile->x1 - tile->x0) * (tile->y1 - tile->y0) };

	for (uint32_t row = 0; row < r->n_rows && list.work <= list.most_work; row++)
		for (uint32_t first = 0; first < r->n_cells[row]; first += REPROJECT_CHUNK) {
			const struct reproject_range range = r->range[(size_t)row * r->ranges_a_row + first / REPROJECT_CHUNK];
			const uint32_t left = r->n_cells[row] - first, n = left < REPROJECT_CHUNK ? left : REPROJECT_CHUNK;

			if (range.first < high && range.end > low)
				draw_chunk(d, tile, &list, (size_t)row * r->cells_a_row + first, n);
		}
	flush(d, tile, &list);
}

static void fill_tile(const struct drawing *d, const struct reproject_tile *tile, struct reproject_counts *counts)
{
	const size_t pitch = (size_t)3 * d->to->width;
	struct reproject_line line = {
		.source = &d->r->source, .n = d->length, .bits = d->bits, .surface = d->surface,
		.step = d->has_columns ? tile->stride : 1, .rgb_step = d->has_columns ? pitch : 3,
	};
	const uint32_t n_lines = d->has_columns ? tile->x1 - tile->x0 : tile->y1 - tile->y0;

	for (uint32_t i = 0; i < n_lines; i++) {
		const size_t first = d->has_columns ? i : (size_t)i * tile->stride;

		line.key = tile->key + first;
		line.at = tile->at + first;
		line.rgb = d->to->rgb + (size_t)tile->y0 * pitch + (size_t)3 * tile->x0 + i * (d->has_columns ? 3 : pitch);
		reproject_fill(&line, counts);
	}
}

/* Elements of a row of a tile. */
static uint32_t stride_of(uint32_t width)
{
	return reproject_round_up(width, REPROJECT_SIDE) + REPROJECT_SIDE;
}

static void draw_tile(const struct drawing *d, uint32_t first, void *scratch, struct reproject_counts *counts)
{
	const uint32_t end = d->n_lines - first < d->lines_a_tile ? d->n_lines : first + d->lines_a_tile;
	struct reproject_tile tile = { .bits = d->bits, .key = scratch };

	if (d->has_columns)
		tile = (struct reproject_tile){ first, end, 0, d->length, 0, scratch, NULL, d->bits };
	else
		tile = (struct reproject_tile){ 0, d->length, first, end, 0, scratch, NULL, d->bits };
	const uint32_t width = tile.x1 - tile.x0, height = tile.y1 - tile.y0;

	tile.stride = stride_of(width);
	tile.at = (uint32_t *)scratch + (size_t)tile.stride * height;
	for (size_t i = 0; i < (size_t)tile.stride * height; i++)
		tile.key[i] = REPROJECT_EMPTY;
	draw_cells(d, &tile);
	for (uint32_t y = 0; y < height; y++)
		d->r->simd->reproject_look(d->to->rgb + 3 * ((size_t)(tile.y0 + y) * d->to->width + tile.x0), &d->r->source,
		                           &tile, y * tile.stride, width, d->r->background);
	fill_tile(d, &tile, counts);
}

static void draw_tiles(int thread, void *userdata)
{
	struct drawing *d = userdata;
	struct reproject_counts counts = { 0 };
	uint32_t tile;

	while ((tile = atomic_fetch_add(&d->next_tile, 1)) < (d->n_lines + d->lines_a_tile - 1) / d->lines_a_tile)
		draw_tile(d, tile * d->lines_a_tile, (uint8_t *)d->r->scratch + (size_t)thread * d->tile_bytes, &counts);
	atomic_fetch_add(&d->covered, counts.covered);
	atomic_fetch_add(&d->filled, counts.filled);
}

static void copy_row(int y, void *userdata)
{
	const struct drawing *d = userdata;
	const uint32_t *texel = d->r->source.texel + (size_t)y * d->r->source.stride;
	uint8_t *rgb = d->to->rgb + (size_t)3 * y * d->to->width;

	for (uint32_t x = 0; x < d->to->width; x++) {
		rgb[3 * x] = (uint8_t)texel[x];
		rgb[3 * x + 1] = (uint8_t)(texel[x] >> 8);
		rgb[3 * x + 2] = (uint8_t)(texel[x] >> 16);
	}
}

static int is_same_camera(const struct psr_camera *a, const struct psr_camera *b)
{
	return memcmp(a->eye, b->eye, sizeof a->eye) == 0 && memcmp(a->target, b->target, sizeof a->target) == 0
	       && memcmp(a->up, b->up, sizeof a->up) == 0 && a->kind == b->kind
	       && (a->kind == PSR_CAMERA_PERSPECTIVE ? a->fov_y == b->fov_y : a->ortho_height == b->ortho_height);
}

/* Fractions of a pixel in a place of 16 bits. */
static unsigned bits_for(const struct reproject_source *source)
{
	const uint32_t side = source->width > source->height ? source->width : source->height;
	unsigned bits = 7;

	while (side << bits > 0x10000)
		bits--;
	return bits;
}

static int warp(struct drawing *d, const struct psr_camera *camera, struct psr_pool *pool)
{
	struct psr_reproject *r = d->r;
	const int n_threads = psr_pool_threads(pool);

	reproject_map(&d->warp, r, camera, d->to);
	d->has_columns = moves_up(&d->warp);
	d->n_lines = d->has_columns ? d->to->width : d->to->height;
	d->length = d->has_columns ? d->to->height : d->to->width;
	d->lines_a_tile = TILE_PIXELS / d->length;
	d->lines_a_tile = d->lines_a_tile < 1 ? 1 : d->lines_a_tile;
	d->lines_a_tile = d->has_columns ? reproject_round_up(d->lines_a_tile, 4 * REPROJECT_SIDE) : d->lines_a_tile;
	d->bits = bits_for(&r->source);
	d->surface = reproject_limit_of(camera, d->to->height, REPROJECT_MOST_SLOPE);
	const uint32_t width = d->has_columns ? d->lines_a_tile : d->length;

	d->tile_bytes = (size_t)8 * stride_of(width) * (d->has_columns ? d->length : d->lines_a_tile);
	if (d->tile_bytes * (size_t)n_threads > r->scratch_bytes) {
		psr_free(r->scratch);
		r->scratch = psr_alloc_array((size_t)n_threads, d->tile_bytes);
		r->scratch_bytes = r->scratch != NULL ? d->tile_bytes * (size_t)n_threads : 0;
		if (r->scratch == NULL)
			return PSR_ERR_MEMORY;
	}
	psr_pool_for(pool, (int)r->n_rows, bound_row, d);
	psr_pool_for(pool, n_threads, draw_tiles, d);
	return PSR_OK;
}

int psr_reproject_draw(struct psr_reproject *r, const struct psr_camera *camera, struct psr_frame *to,
                       struct psr_pool *pool, struct psr_reproject_stats *stats, struct psr_error *err)
{
	const uint64_t start_ns = clock_ns();
	struct drawing d = { .r = r, .to = to };
	int code = reproject_check_size(to, "drawn", err), is_copy;

	if (code == PSR_OK && !r->is_taken)
		return psr_fail(err, PSR_ERR_ARG, "no picture was received that could be warped");
	if (code == PSR_OK)
		code = view_check_camera(camera, err);
	if (code != PSR_OK)
		return code;
	is_copy = to->width == r->source.width && to->height == r->source.height && is_same_camera(camera, &r->camera);
	if (is_copy)
		psr_pool_for(pool, (int)to->height, copy_row, &d);
	else if (warp(&d, camera, pool) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to warp a picture to %ux%u pixels", to->width, to->height);
	if (stats != NULL) {
		const double n_pixels = (double)to->width * to->height;

		*stats = (struct psr_reproject_stats){ .ms = (double)(clock_ns() - start_ns) / 1e6, .is_copy = is_copy,
			                                   .covered = (double)d.covered / n_pixels,
			                                   .filled = (double)d.filled / n_pixels };
		for (uint32_t row = 0; row < r->n_rows; row++)
			stats->n_cells += r->n_cells[row];
	}
	return PSR_OK;
}
