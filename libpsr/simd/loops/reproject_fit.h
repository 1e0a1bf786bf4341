/* Late warping: a received picture to cells. Loops of REPROJECT_SIDE have a constant length, for vectors. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/reproject.h"

static void reproject_depths(float *d, const float *z, uint32_t n, int is_inverse)
{
	for (uint32_t i = 0; i < n; i++) {
		const int is_surface = (z[i] >= 1 / REPROJECT_FAR) & (z[i] <= REPROJECT_FAR);
		const float value = is_inverse ? 1 / z[i] : z[i];

		d[i] = psr_where(is_surface, value);
	}
}

static inline int is_one_surface(float a, float b, struct reproject_limit limit)
{
	const float most = a > b ? a : b, least = a > b ? b : a;

	return (least > 0) & (most - least <= limit.scale * most + limit.offset);
}

static void reproject_texels(const struct reproject_source *source, const uint8_t *rgb, uint32_t y)
{
	const float *own = source->d + (size_t)y * source->stride, *below = own + source->stride;
	uint32_t *texel = source->texel + (size_t)y * source->stride;
	const struct reproject_limit limit = source->surface;

	for (uint32_t x = 0; x < source->width; x++) {
		const float a = own[x], b = own[x + 1], c = below[x], e = below[x + 1];
		const float top = a > b ? a : b, bottom = c > e ? c : e, low = a < b ? a : b, lower = c < e ? c : e;
		const float most = top > bottom ? top : bottom, least = low < lower ? low : lower;

		texel[x] = (uint32_t)((least > 0) & (most - least <= limit.scale * most + limit.offset)) << 24;
	}
	for (uint32_t x = 0; x + 1 < source->width; x++) { /* four bytes at once; assumes little-endian ones */
		uint32_t color;

		memcpy(&color, rgb + 3 * x, sizeof color);
		texel[x] |= color & 0xffffff;
	}
	rgb += 3 * (source->width - 1);
	texel[source->width - 1] |= (uint32_t)rgb[0] | (uint32_t)rgb[1] << 8 | (uint32_t)rgb[2] << 16;
}

static inline float add_lanes(const float *v, int n)
{
	return n == 8 ? ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]))
	     : n == 4 ? (v[0] + v[2]) + (v[1] + v[3]) : v[0] + v[1];
}

/* The plane of n x n pixels by least squares. Returns 0 if a pixel has no surface or is too far off the plane, or the
 * plane too steep: one of 2x2 pixels fits a step. */
static inline __attribute__((always_inline)) int fit_plane(struct reproject_cell *cell, const float *d, int n,
                                                           const struct reproject_source *source)
{
	const size_t stride = source->stride;
	const float middle = 0.5f * (float)(n - 1), squares = (float)(n * n * (n * n - 1) / 12);
	float sum[REPROJECT_SIDE] = { 0 }, down[REPROJECT_SIDE] = { 0 }, worst[REPROJECT_SIDE] = { 0 };
	float right[REPROJECT_SIDE], least[REPROJECT_SIDE];
	float off = 0, lowest = INFINITY;

	for (int i = 0; i < n; i++)
		least[i] = INFINITY;
	for (int j = 0; j < n; j++)
		for (int i = 0; i < n; i++) {
			const float v = d[(size_t)j * stride + (size_t)i];

			sum[i] += v;
			down[i] += ((float)j - middle) * v;
			least[i] = v < least[i] ? v : least[i];
		}
	for (int i = 0; i < n; i++) {
		right[i] = ((float)i - middle) * sum[i];
		lowest = least[i] < lowest ? least[i] : lowest;
	}
	if (!(lowest > 0))
		return 0;
	cell->d = add_lanes(sum, n) / (float)(n * n);
	cell->dx = add_lanes(right, n) / squares;
	cell->dy = add_lanes(down, n) / squares;
	const float steepest = source->surface.scale * cell->d + source->surface.offset;

	if (!(fabsf(cell->dx) <= steepest && fabsf(cell->dy) <= steepest))
		return 0;
	for (int j = 0; j < n; j++)
		for (int i = 0; i < n; i++) {
			const float plane = (cell->d + cell->dx * ((float)i - middle)) + cell->dy * ((float)j - middle);
			const float apart = fabsf(d[(size_t)j * stride + (size_t)i] - plane);

			worst[i] = apart > worst[i] ? apart : worst[i];
		}
	for (int i = 0; i < n; i++)
		off = worst[i] > off ? worst[i] : off;
	return off <= source->plane.scale * cell->d + source->plane.offset;
}

/* How d changes from pixel to pixel, by those of both neighbours that are the same surface. */
static inline float slope_of(float before, float own, float after, struct reproject_limit limit)
{
	const int is_before = is_one_surface(before, own, limit), is_after = is_one_surface(own, after, limit);

	return is_before && is_after ? 0.5f * (after - before) : is_before ? own - before : is_after ? after - own : 0;
}

static inline struct reproject_cell fit_pixel(const struct reproject_source *source, uint32_t x, uint32_t y)
{
	const float *d = source->d + (size_t)y * source->stride + x;
	const float left = x > 0 ? *(d - 1) : 0, above = y > 0 ? *(d - source->stride) : 0;

	return (struct reproject_cell){ .d = *d, .dx = slope_of(left, *d, d[1], source->surface),
		                            .dy = slope_of(above, *d, d[source->stride], source->surface) };
}

/* Whether n x n pixels hold any surface. */
static inline int has_surface(const float *d, size_t stride, int n)
{
	float most[REPROJECT_SIDE] = { 0 };
	int any = 0;

	for (int j = 0; j < n; j++)
		for (int i = 0; i < n; i++)
			most[i] = d[(size_t)j * stride + (size_t)i] > most[i] ? d[(size_t)j * stride + (size_t)i] : most[i];
	for (int i = 0; i < n; i++)
		any |= most[i] > 0;
	return any;
}

static inline uint32_t place_of(uint32_t x, uint32_t y, uint32_t log_side)
{
	return x | y << 14 | log_side << 28;
}

static inline uint32_t fit_quarter(const struct reproject_source *source, uint32_t x, uint32_t y,
                                   struct reproject_cell *cell)
{
	const size_t stride = source->stride;
	const float *d = source->d + (size_t)y * stride + x;
	uint32_t n = 0;

	if (!has_surface(d, stride, 4))
		return 0;
	if (fit_plane(cell, d, 4, source)) {
		cell->place = place_of(x, y, 2);
		return 1;
	}
	for (uint32_t part = 0; part < 4; part++) {
		const uint32_t px = 2 * (part & 1), py = 2 * (part >> 1);

		if (fit_plane(&cell[n], d + py * stride + px, 2, source)) {
			cell[n++].place = place_of(x + px, y + py, 1);
			continue;
		}
		for (uint32_t k = 0; k < 4; k++) {
			const uint32_t qx = px + (k & 1), qy = py + (k >> 1);

			if (!(d[qy * stride + qx] > 0))
				continue;
			cell[n] = fit_pixel(source, x + qx, y + qy);
			cell[n++].place = place_of(x + qx, y + qy, 0);
		}
	}
	return n;
}

static uint32_t reproject_fit(const struct reproject_source *source, uint32_t y, struct reproject_cell *cell)
{
	uint32_t n = 0;

	for (uint32_t x = 0; x < source->width; x += REPROJECT_SIDE) {
		const float *d = source->d + (size_t)y * source->stride + x;

		if (!has_surface(d, source->stride, REPROJECT_SIDE))
			continue;
		if (fit_plane(&cell[n], d, REPROJECT_SIDE, source)) {
			cell[n++].place = place_of(x, y, 3);
			continue;
		}
		for (uint32_t part = 0; part < 4; part++)
			n += fit_quarter(source, x + 4 * (part & 1), y + 4 * (part >> 1), cell + n);
	}
	return n;
}
