#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "codec_parts.h"

static uint32_t count(uint32_t side, uint32_t part)
{
	return (side + part - 1) / part;
}

static uint64_t count_parts(uint32_t width, uint32_t height, uint32_t planes)
{
	return (uint64_t)count(width, PSR_WIRE_PART_WIDTH) * count(height, PSR_WIRE_PART_HEIGHT)
	       * (uint32_t)__builtin_popcount(planes);
}

uint64_t codec_parts_bytes(uint32_t width, uint32_t height, uint32_t planes)
{
	return sizeof(struct codec_parts) + count_parts(width, height, planes) * (sizeof(uint64_t) + 1);
}

struct codec_parts *codec_parts_create(uint32_t width, uint32_t height, uint32_t planes)
{
	struct codec_parts *parts = malloc(codec_parts_bytes(width, height, planes));

	if (parts == NULL)
		return NULL;
	*parts = (struct codec_parts){
		.width = width, .height = height, .planes = planes, .n_columns = count(width, PSR_WIRE_PART_WIDTH),
		.n_rows = count(height, PSR_WIRE_PART_HEIGHT),
		.quality = (uint8_t *)(parts->hash + count_parts(width, height, planes)),
	};
	return parts;
}

int codec_parts_fit(const struct codec_parts *base, const struct psr_msg_frame *request, uint32_t scale)
{
	const struct psr_depth_range range = psr_depth_range_of(request);

	if (base->width != request->width || base->height != request->height || base->planes != request->planes
	    || base->scale != scale)
		return 0;
	return request->depth_format <= PSR_WIRE_DEPTH_F32
	       || (base->range.min == range.min && base->range.max == range.max && base->range.is_linear == range.is_linear);
}

static size_t index_of(const struct codec_parts *parts, unsigned plane, uint32_t row, uint32_t column)
{
	const uint32_t before = (uint32_t)__builtin_popcount(parts->planes & ((1u << plane) - 1));

	return ((size_t)before * parts->n_rows + row) * parts->n_columns + column;
}

/* Hashes row by row: hashes of neighbouring parts do not wait for each other, and memory is read in order. */
void codec_parts_hash(struct codec_parts *parts, unsigned plane, uint32_t strip, const uint8_t *pixels, uint32_t n)
{
	const uint32_t n_rows = PSR_WIRE_PART_HEIGHT / parts->scale;
	const size_t pixel = psr_plane_bytes(plane), row = parts->width / parts->scale * pixel;
	const size_t part = PSR_WIRE_PART_WIDTH / parts->scale * pixel;

	for (uint32_t y = 0; y < n; y++, pixels += row) {
		uint64_t *hash = &parts->hash[index_of(parts, plane, strip * PARTS_A_STRIP + y / n_rows, 0)];

		for (size_t x = 0; x < row; x += part, hash++)
			*hash = XXH64(pixels + x, row - x < part ? row - x : part, y % n_rows == 0 ? 0 : *hash);
	}
}

struct part_area codec_parts_all(const struct codec_parts *parts, uint32_t strip)
{
	const uint32_t left = parts->n_rows - strip * PARTS_A_STRIP;

	return (struct part_area){ 0, (uint8_t)parts->n_columns, 0, (uint8_t)(left < PARTS_A_STRIP ? left : PARTS_A_STRIP) };
}

void codec_parts_sent(struct codec_parts *parts, unsigned plane, uint32_t strip, const struct part_area *area,
                      unsigned quality)
{
	for (uint32_t y = area->y0; y < area->y1; y++)
		memset(&parts->quality[index_of(parts, plane, strip * PARTS_A_STRIP + y, area->x0)], (int)quality,
		       (size_t)(area->x1 - area->x0));
}

/* with a column of 0 at the end */
typedef uint8_t part_marks[PARTS_A_STRIP][PSR_WIRE_MAX_SIDE / PSR_WIRE_PART_WIDTH + 1];

/* Whether a row has a run of marks from x0 to x1, and no longer one. */
static int has_run(const uint8_t *marks, uint32_t x0, uint32_t x1)
{
	return (x0 == 0 || !marks[x0 - 1]) && !marks[x1] && memchr(marks + x0, 0, x1 - x0) == NULL;
}

/* Finds runs of marks; equal runs below each other are one area. */
static unsigned join(struct part_area area[PART_AREAS], part_marks marks, const struct part_area *all)
{
	unsigned n = 0;

	for (uint32_t y0 = 0; y0 < all->y1; y0++) {
		for (uint32_t x0 = 0, x1; x0 < all->x1; x0 = x1) {
			uint32_t y1 = y0 + 1;

			x1 = x0 + 1;
			if (!marks[y0][x0])
				continue;
			while (marks[y0][x1])
				x1++;
			for (; y1 < all->y1 && has_run(marks[y1], x0, x1); y1++)
				memset(marks[y1] + x0, 0, x1 - x0);
			area[n++] = (struct part_area){ (uint8_t)x0, (uint8_t)x1, (uint8_t)y0, (uint8_t)y1 };
		}
	}
	return n;
}

unsigned codec_parts_changed(struct part_area area[PART_AREAS], struct codec_parts *parts,
                             const struct codec_parts *base, unsigned plane, uint32_t strip, unsigned quality)
{
	const struct part_area all = codec_parts_all(parts, strip);
	part_marks marks = { 0 };

	for (uint32_t y = 0; y < all.y1; y++) {
		const size_t row = index_of(parts, plane, strip * PARTS_A_STRIP + y, 0);

		for (uint32_t x = 0; x < all.x1; x++) {
			parts->quality[row + x] = base->quality[row + x];
			marks[y][x] = base->quality[row + x] < quality || base->hash[row + x] != parts->hash[row + x];
		}
	}
	return join(area, marks, &all);
}
