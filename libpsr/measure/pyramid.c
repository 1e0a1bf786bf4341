#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "base/srgb.h"
#include "psr/error.h"
#include "pyramid.h"

static void decode(const struct pyramid *pyramid, uint32_t x, uint32_t y, float out[4])
{
	const uint8_t *code = pyramid->image->rgba + 4 * ((size_t)y * pyramid->image->width + x);

	for (int c = 0; c < 4; c++)
		out[c] = (float)code[c] / 255;
	if (pyramid->kind == PYRAMID_NORMAL)
		for (int c = 0; c < 3; c++)
			out[c] = 2 * out[c] - 1;
	if (pyramid->kind == PYRAMID_COLOR || pyramid->kind == PYRAMID_COVERED)
		for (int c = 0; c < 3; c++)
			out[c] = psr_srgb_to_linear[code[c]] * (pyramid->kind == PYRAMID_COVERED ? out[3] : 1);
}

static void texel_at(const struct pyramid *pyramid, int level, uint32_t x, uint32_t y, float out[4])
{
	const struct pyramid_level *l = &pyramid->level[level];

	if (level == 0)
		decode(pyramid, x, y, out);
	else
		memcpy(out, l->texel[(size_t)y * l->width + x], 4 * sizeof *out);
}

/* Finds the texels from *first on that lie under texel i of n, in a row of `below`: at most three, and their shares. */
static int under(uint32_t i, uint32_t n, uint32_t below, uint32_t *first, double share[3])
{
	const double low = (double)i * below / n, high = (double)(i + 1) * below / n;
	int count = 0;

	*first = (uint32_t)low;
	for (uint32_t k = *first; k < below && k < high && count < 3; k++)
		share[count++] = (fmin(high, k + 1.0) - fmax(low, k)) / (high - low);
	return count;
}

static void fill_level(struct pyramid *pyramid, int level)
{
	const struct pyramid_level *to = &pyramid->level[level], *from = &pyramid->level[level - 1];

	for (uint32_t y = 0; y < to->height; y++)
		for (uint32_t x = 0; x < to->width; x++) {
			uint32_t x0, y0;
			double across[3], along[3], sum[4] = { 0 };
			const int nx = under(x, to->width, from->width, &x0, across);
			const int ny = under(y, to->height, from->height, &y0, along);

			for (int k = 0; k < nx * ny; k++) {
				float texel[4];

				texel_at(pyramid, level - 1, x0 + (uint32_t)(k % nx), y0 + (uint32_t)(k / nx), texel);
				for (int c = 0; c < 4; c++)
					sum[c] += across[k % nx] * along[k / nx] * (double)texel[c];
			}
			for (int c = 0; c < 4; c++)
				to->texel[(size_t)y * to->width + x][c] = (float)sum[c];
		}
}

int pyramid_init(struct pyramid *pyramid, const struct psr_image *image, enum pyramid_kind kind)
{
	*pyramid = (struct pyramid){ .image = image, .kind = kind, .n_levels = 1 };
	pyramid->level[0] = (struct pyramid_level){ image->width, image->height, NULL };
	for (int i = 1; i < PYRAMID_LEVELS; i++) {
		const struct pyramid_level *below = &pyramid->level[i - 1];
		struct pyramid_level *level = &pyramid->level[i];

		if (below->width == 1 && below->height == 1)
			break;
		level->width = below->width > 1 ? below->width / 2 : 1;
		level->height = below->height > 1 ? below->height / 2 : 1;
		level->texel = psr_alloc_array((size_t)level->width * level->height, sizeof *level->texel);
		if (level->texel == NULL)
			return PSR_ERR_MEMORY;
		pyramid->n_levels++;
		fill_level(pyramid, i);
	}
	return PSR_OK;
}

void pyramid_fini(struct pyramid *pyramid)
{
	for (int i = 0; i < pyramid->n_levels; i++)
		psr_free(pyramid->level[i].texel);
	*pyramid = (struct pyramid){ .image = NULL };
}

static uint32_t wrap(int64_t i, uint32_t n, enum psr_wrap how)
{
	if (how == PSR_WRAP_CLAMP)
		return i < 0 ? 0 : i >= n ? n - 1 : (uint32_t)i;
	const int64_t period = how == PSR_WRAP_MIRROR ? 2 * (int64_t)n : n, at = ((i % period) + period) % period;

	return at < n ? (uint32_t)at : (uint32_t)(2 * (int64_t)n - 1 - at);
}

/* Keeps far coordinates within reach of integers; changes none of their texels. */
static double near_zero(double x, enum psr_wrap how)
{
	if (how == PSR_WRAP_CLAMP)
		return fmin(fmax(x, -1), 2);
	return x - 2 * floor(x / 2);
}

static void bilinear(const struct pyramid *pyramid, const struct psr_texture *texture, int level, const double st[2],
                     float out[4])
{
	const struct pyramid_level *l = &pyramid->level[level];
	const int is_nearest = level == 0 && texture->is_nearest;
	const double x = near_zero(st[0], texture->wrap_s) * l->width - (is_nearest ? 0 : 0.5);
	const double y = near_zero(st[1], texture->wrap_t) * l->height - (is_nearest ? 0 : 0.5);
	const double fx = is_nearest ? 0 : x - floor(x), fy = is_nearest ? 0 : y - floor(y);

	memset(out, 0, 4 * sizeof *out);
	for (int k = 0; k < 4; k++) {
		const double weight = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy);
		float texel[4];

		if (weight == 0)
			continue;
		texel_at(pyramid, level, wrap((int64_t)floor(x) + k % 2, l->width, texture->wrap_s),
		         wrap((int64_t)floor(y) + k / 2, l->height, texture->wrap_t), texel);
		for (int c = 0; c < 4; c++)
			out[c] += (float)weight * texel[c];
	}
}

static void trilinear(const struct pyramid *pyramid, const struct psr_texture *texture, double lod, const double st[2],
                      float out[4])
{
	const int low = (int)fmin(fmax(lod, 0), pyramid->n_levels - 1);
	const float share = (float)fmin(fmax(lod - low, 0), 1);
	float above[4];

	bilinear(pyramid, texture, low, st, out);
	if (share == 0 || low + 1 >= pyramid->n_levels)
		return;
	bilinear(pyramid, texture, low + 1, st, above);
	for (int c = 0; c < 4; c++)
		out[c] += share * (above[c] - out[c]);
}

void pyramid_mean(const struct pyramid *pyramid, const struct psr_texture *texture, const double st[2],
                  const double axes[2][2], float out[4])
{
	double length[2];

	for (int i = 0; i < 2; i++)
		length[i] = hypot(axes[i][0] * pyramid->image->width, axes[i][1] * pyramid->image->height);
	const int longer = length[1] > length[0];
	const double ratio = length[longer] / fmax(length[!longer], 1);
	const int n = ratio > 1 ? (int)fmin(ceil(ratio), PYRAMID_TAPS) : 1;
	const double lod = log2(fmax(length[longer] / n, 1));

	memset(out, 0, 4 * sizeof *out);
	for (int i = 0; i < n; i++) {
		const double off = (i + 0.5) / n - 0.5;
		const double at[2] = { st[0] + off * axes[longer][0], st[1] + off * axes[longer][1] };
		float texel[4];

		trilinear(pyramid, texture, lod, at, texel);
		for (int c = 0; c < 4; c++)
			out[c] += texel[c] / (float)n;
	}
}
