/* Late warping: cells to another camera's picture. Loops of REPROJECT_SIDE have a constant length, for vectors. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/reproject.h"

/* Eight cells: their middles, the half of their sides, and (X, Y, W, N) there with its changes, all over W. */
struct reproject_placed {
	float x[REPROJECT_SIDE], y[REPROJECT_SIDE], half[REPROJECT_SIDE];
	float to_x[REPROJECT_SIDE], to_y[REPROJECT_SIDE];                      /* X/W and Y/W */
	/* X - to_x W and Y - to_y W, a pixel to the right and down: */
	float a[REPROJECT_SIDE], b[REPROJECT_SIDE], d[REPROJECT_SIDE], e[REPROJECT_SIDE];
	float g[REPROJECT_SIDE], h[REPROJECT_SIDE];                            /* W */
	float key[REPROJECT_SIDE], right[REPROJECT_SIDE], down[REPROJECT_SIDE];         /* N */
	int32_t is_there[REPROJECT_SIDE];                             /* in front of the eye */
};

static inline void place_cells(struct reproject_placed *p, const struct reproject_warp *w,
                               const struct reproject_cell *cell, uint32_t n)
{
	float d[REPROJECT_SIDE], dx[REPROJECT_SIDE], dy[REPROJECT_SIDE];
	uint32_t place[REPROJECT_SIDE];

	for (uint32_t l = 0; l < REPROJECT_SIDE; l++) {
		const struct reproject_cell *c = &cell[l < n ? l : n - 1];

		d[l] = c->d;
		dx[l] = c->dx;
		dy[l] = c->dy;
		place[l] = c->place;
	}
	for (uint32_t l = 0; l < REPROJECT_SIDE; l++) {
		const float half = psr_float_from_bits((126 + (place[l] >> 28)) << 23); /* 2^(log2 of the side - 1) */

		p->half[l] = half;
		p->x[l] = (float)(int32_t)(place[l] & 0x3fff) + half;
		p->y[l] = (float)(int32_t)(place[l] >> 14 & 0x3fff) + half;
	}
	for (uint32_t l = 0; l < REPROJECT_SIDE; l++) {
		float at[4], right[4], down[4];

		for (int k = 0; k < 4; k++) {
			at[k] = ((w->of_x[k] * p->x[l] + w->of_y[k] * p->y[l]) + w->of_one[k]) + w->of_d[k] * d[l];
			right[k] = w->of_x[k] + w->of_d[k] * dx[l];
			down[k] = w->of_y[k] + w->of_d[k] * dy[l];
		}
		const float inverse = 1 / at[2], x = at[0] * inverse, y = at[1] * inverse;
		const float g = right[2] * inverse, h = down[2] * inverse;

		p->is_there[l] = at[2] > 0;
		p->to_x[l] = x;
		p->to_y[l] = y;
		p->g[l] = g;
		p->h[l] = h;
		p->a[l] = right[0] * inverse - x * g;
		p->b[l] = down[0] * inverse - x * h;
		p->d[l] = right[1] * inverse - y * g;
		p->e[l] = down[1] * inverse - y * h;
		p->key[l] = at[3] * inverse;
		p->right[l] = right[3] * inverse;
		p->down[l] = down[3] * inverse;
	}
}

/* A number of pixels from the corner of the picture on: those whose centres are at `at` or beyond. */
static inline int32_t first_centre(float at, float most)
{
	const float inside = at - 0.5f > 0 ? at - 0.5f : 0, low = inside < most ? inside : most;
	const int32_t whole = (int32_t)low;

	return whole + (low > (float)whole);
}

static void reproject_bound(struct reproject_box *box, const struct reproject_warp *w,
                            const struct reproject_cell *cell, uint32_t n)
{
	const float width = (float)w->width, height = (float)w->height;

	for (uint32_t i = 0; i < n; i += REPROJECT_SIDE) {
		const uint32_t n_lanes = n - i < REPROJECT_SIDE ? n - i : REPROJECT_SIDE;
		struct reproject_placed p;
		int32_t x0[REPROJECT_SIDE], x1[REPROJECT_SIDE], y0[REPROJECT_SIDE], y1[REPROJECT_SIDE];

		place_cells(&p, w, cell + i, n_lanes);
		for (uint32_t l = 0; l < REPROJECT_SIDE; l++) {
			const float r = p.half[l] + REPROJECT_MARGIN, area = p.a[l] * p.e[l] - p.b[l] * p.d[l];
			const int is_near = r * (fabsf(p.g[l]) + fabsf(p.h[l])) <= 0.875f;
			const int is_seen = p.is_there[l] & is_near & (area > 0) & (p.key[l] > -INFINITY) & (p.key[l] < INFINITY);
			float low_x = INFINITY, high_x = -INFINITY, low_y = INFINITY, high_y = -INFINITY;

			for (int corner = 0; corner < 4; corner++) {
				const float u = corner & 1 ? r : -r, v = corner & 2 ? r : -r;
				const float inverse = 1 / ((p.g[l] * u + p.h[l] * v) + 1);
				const float x = p.to_x[l] + (p.a[l] * u + p.b[l] * v) * inverse;
				const float y = p.to_y[l] + (p.d[l] * u + p.e[l] * v) * inverse;

				low_x = x < low_x ? x : low_x;
				high_x = x > high_x ? x : high_x;
				low_y = y < low_y ? y : low_y;
				high_y = y > high_y ? y : high_y;
			}
			const int32_t left = first_centre(low_x, width), right = first_centre(high_x, width);
			const int32_t top = first_centre(low_y, height), bottom = first_centre(high_y, height);
			const int32_t mask = -(is_seen & (left < right) & (top < bottom));

			x0[l] = left & mask;
			x1[l] = right & mask;
			y0[l] = top & mask;
			y1[l] = bottom & mask;
		}
		for (uint32_t l = 0; l < n_lanes; l++)
			box[i + l] = (struct reproject_box){ (uint16_t)x0[l], (uint16_t)x1[l], (uint16_t)y0[l], (uint16_t)y1[l] };
	}
}

/* Eight cells, ready to be drawn: from a place (p, q) from (to_x, to_y) to one (u, v) from (x, y),
 *   s = 1 + g p + h q,  u = (a p + b q) / s,  v = (c p + d q) / s,  key = key + across p + down q. */
struct reproject_inverse {
	float x[REPROJECT_SIDE], y[REPROJECT_SIDE], half[REPROJECT_SIDE], to_x[REPROJECT_SIDE], to_y[REPROJECT_SIDE];
	float a[REPROJECT_SIDE], b[REPROJECT_SIDE], c[REPROJECT_SIDE], d[REPROJECT_SIDE];
	float g[REPROJECT_SIDE], h[REPROJECT_SIDE];
	float key[REPROJECT_SIDE], across[REPROJECT_SIDE], down[REPROJECT_SIDE];
};

static inline void invert_cells(struct reproject_inverse *to, const struct reproject_placed *p)
{
	memcpy(to->x, p->x, sizeof to->x);
	memcpy(to->y, p->y, sizeof to->y);
	memcpy(to->half, p->half, sizeof to->half);
	memcpy(to->to_x, p->to_x, sizeof to->to_x);
	memcpy(to->to_y, p->to_y, sizeof to->to_y);
	memcpy(to->key, p->key, sizeof to->key);
	for (uint32_t l = 0; l < REPROJECT_SIDE; l++) {
		const float inverse = 1 / (p->a[l] * p->e[l] - p->b[l] * p->d[l]);
		const float a = p->e[l] * inverse, b = -p->b[l] * inverse, c = -p->d[l] * inverse, d = p->a[l] * inverse;
		const float g = -(p->g[l] * a + p->h[l] * c), h = -(p->g[l] * b + p->h[l] * d);

		to->a[l] = a;
		to->b[l] = b;
		to->c[l] = c;
		to->d[l] = d;
		to->g[l] = g;
		to->h[l] = h;
		to->across[l] = p->key[l] * g + (p->right[l] * a + p->down[l] * c);
		to->down[l] = p->key[l] * h + (p->right[l] * b + p->down[l] * d);
	}
}

/* Eight pixels of a row. */
struct reproject_span {
	float p, u, v, s, key; /* of the first: its p, and u s, v s, s and key without the parts of p */
	float a, c, g, across, most_key;
	float half, x, y, parts;
};

static inline void draw_span(float *restrict key, uint32_t *restrict at, const struct reproject_span *b)
{
	const float reach = b->half + REPROJECT_MARGIN, high = b->half - 1 / b->parts;

	for (uint32_t l = 0; l < REPROJECT_SIDE; l++) {
		const float p = b->p + (float)(int32_t)l, inverse = 1 / (b->g * p + b->s);
		const float u = (b->a * p + b->u) * inverse, v = (b->c * p + b->v) * inverse, own = b->across * p + b->key;
		const float low_u = u > -b->half ? u : -b->half, low_v = v > -b->half ? v : -b->half;
		const float in_u = low_u < high ? low_u : high, in_v = low_v < high ? low_v : high;
		const uint32_t place = (uint32_t)(int32_t)((b->x + in_u) * b->parts + 0.5f)
		                       | (uint32_t)(int32_t)((b->y + in_v) * b->parts + 0.5f) << 16;
		const int is_nearest = (fabsf(u) <= reach) & (fabsf(v) <= reach) & (own > key[l]) & (own <= b->most_key);
		const uint32_t mask = 0u - (uint32_t)is_nearest;

		key[l] = psr_choose(is_nearest, own, key[l]);
		at[l] = (place & mask) | (at[l] & ~mask);
	}
}

static uint64_t reproject_cells(const struct reproject_tile *tile, const struct reproject_warp *warp,
                                const struct reproject_cell *cell, const struct reproject_box *box, uint32_t n)
{
	struct reproject_placed placed;
	struct reproject_inverse inv;
	uint64_t n_pixels = 0;

	for (uint32_t i = 0; i < n; i++) {
		const uint32_t l = i % REPROJECT_SIDE;

		if (l == 0) {
			place_cells(&placed, warp, cell + i, n - i < REPROJECT_SIDE ? n - i : REPROJECT_SIDE);
			invert_cells(&inv, &placed);
		}
		const struct reproject_box b = box[i];
		const uint32_t x0 = b.x0 > tile->x0 ? b.x0 : tile->x0, x1 = b.x1 < tile->x1 ? b.x1 : tile->x1;
		const uint32_t y0 = b.y0 > tile->y0 ? b.y0 : tile->y0, y1 = b.y1 < tile->y1 ? b.y1 : tile->y1;
		struct reproject_span span = { .a = inv.a[l], .c = inv.c[l], .g = inv.g[l], .across = inv.across[l],
			                           .most_key = warp->most_key, .half = inv.half[l], .x = inv.x[l], .y = inv.y[l],
			                           .parts = (float)(1 << tile->bits) };

		for (uint32_t y = y0; y < y1; y++) {
			const float q = ((float)(int32_t)y + 0.5f) - inv.to_y[l];
			const size_t row = (size_t)(y - tile->y0) * tile->stride;

			span.u = inv.b[l] * q;
			span.v = inv.d[l] * q;
			span.s = inv.h[l] * q + 1;
			span.key = inv.down[l] * q + inv.key[l];
			for (uint32_t x = x0; x < x1; x += REPROJECT_SIDE) {
				span.p = ((float)(int32_t)x + 0.5f) - inv.to_x[l];
				draw_span(tile->key + row + (x - tile->x0), tile->at + row + (x - tile->x0), &span);
				n_pixels += REPROJECT_SIDE;
			}
		}
	}
	return n_pixels;
}

/* ---- colours ---- */

static inline uint32_t blend_channel(const uint32_t t[4], int shift, uint32_t wx, uint32_t wy, unsigned bits)
{
	const uint32_t one = 1u << bits;
	const uint32_t top = (t[0] >> shift & 255) * (one - wx) + (t[1] >> shift & 255) * wx;
	const uint32_t bottom = (t[2] >> shift & 255) * (one - wx) + (t[3] >> shift & 255) * wx;

	return (top * (one - wy) + bottom * wy + (1u << (2 * bits - 1))) >> (2 * bits);
}

static inline void look_pixel(uint8_t *rgb, const struct reproject_source *source, uint32_t place, unsigned bits)
{
	const uint32_t half = 1u << (bits - 1), x = place & 0xffff, y = place >> 16;
	const uint32_t left = x > half ? x - half : 0, top = y > half ? y - half : 0;
	const uint32_t *texel = source->texel + (size_t)(top >> bits) * source->stride + (left >> bits);
	const uint32_t mask = (1u << bits) - 1;

	if (*texel >> 24) {
		const uint32_t t[4] = { texel[0], texel[1], texel[source->stride], texel[source->stride + 1] };

		for (int c = 0; c < 3; c++)
			rgb[c] = (uint8_t)blend_channel(t, 8 * c, left & mask, top & mask, bits);
	} else {
		const uint32_t nearest = source->texel[(size_t)(y >> bits) * source->stride + (x >> bits)];

		for (int c = 0; c < 3; c++)
			rgb[c] = (uint8_t)(nearest >> 8 * c);
	}
}

static inline void reproject_look(uint8_t *rgb, const struct reproject_source *source,
                                  const struct reproject_tile *tile, uint32_t first, uint32_t n,
                                  const uint8_t background[3])
{
	for (uint32_t i = 0; i < n; i++) {
		if (tile->key[first + i] > REPROJECT_EMPTY)
			look_pixel(rgb + 3 * i, source, tile->at[first + i], tile->bits);
		else
			memcpy(rgb + 3 * i, background, 3);
	}
}
