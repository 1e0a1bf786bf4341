#include <assert.h>
#include <math.h>
#include "filter.h"

#define LEAST_AXIS 1.5
#define MOST_ECCENTRICITY 8.0
#define MOST_AXIS 40 /* texels: 1.5 * 8 of the next level, which may have a third of the texels, and a rest */
#define MOST_RUN (2 * MOST_AXIS + 2)

/* The filter's variance along an axis over the square of its semi-axis: half of the mean of q under exp(-2 q) -
 * exp(-2). */
#define KERNEL_VARIANCE 0.13608

/* Bilinear interpolation and the mean over a texel add these variances to the square of a semi-axis. */
#define BILINEAR (1.0 / 6 / KERNEL_VARIANCE)
#define TEXEL (1.0 / 12 / KERNEL_VARIANCE)

/* Texels of one level around a centre: V of x^T V^-1 x = 1. */
struct ellipse {
	double xx, xy, yy;
	double long2, short2; /* squares of the semi-axes */
};

static struct ellipse ellipse_on(const struct mip_level *level, const double axes[2][2])
{
	double w = level->width, h = level->height;
	double m[2][2] = { { w * axes[0][0], w * axes[0][1] }, { h * axes[1][0], h * axes[1][1] } };
	double det = m[0][0] * m[1][1] - m[0][1] * m[1][0], half, root;
	struct ellipse e = { .xx = m[0][0] * m[0][0] + m[0][1] * m[0][1], .xy = m[0][0] * m[1][0] + m[0][1] * m[1][1],
		                 .yy = m[1][0] * m[1][0] + m[1][1] * m[1][1] };

	half = (e.xx + e.yy) / 2;
	root = half * half - det * det;
	e.long2 = half + sqrt(root > 0 ? root : 0);
	e.short2 = e.long2 > 0 ? det * det / e.long2 : 0;
	return e;
}

/* Square of the shorter semi-axis, as the choice of a level counts it. */
static double short_enough(const struct ellipse *e)
{
	double least = e->long2 / (MOST_ECCENTRICITY * MOST_ECCENTRICITY);

	return e->short2 > least ? e->short2 : least;
}

static int choose_level(const struct mip *mip, const double axes[2][2], struct ellipse *ellipse)
{
	int level = 0;

	*ellipse = ellipse_on(&mip->level[0], axes);
	if (!(ellipse->long2 < 0x1p100))
		return mip->n_levels - 1;
	for (; level + 1 < mip->n_levels; level++) {
		struct ellipse next = ellipse_on(&mip->level[level + 1], axes);

		if (short_enough(&next) < LEAST_AXIS * LEAST_AXIS)
			break;
		*ellipse = next;
	}
	return level;
}

/* Brings far coordinates near, onto the same texels. */
static double fold(double s, enum psr_wrap wrap)
{
	double period = wrap == PSR_WRAP_MIRROR ? 2 : 1;

	if (wrap == PSR_WRAP_CLAMP) /* 64 times the side: beyond any ellipse */
		return s < -64 ? -64 : s > 65 ? 65 : s;
	s -= period * floor(s / period);
	/* Beyond 2^53 there is no fraction left, and the difference may round to the period itself. */
	return s >= 0 && s < period ? s : 0;
}

static uint32_t wrap_index(int64_t i, uint32_t n, enum psr_wrap wrap)
{
	int64_t period = wrap == PSR_WRAP_MIRROR ? 2 * (int64_t)n : (int64_t)n;

	if (wrap == PSR_WRAP_CLAMP)
		return i <= 0 ? 0 : i >= (int64_t)n - 1 ? n - 1 : (uint32_t)i;
	i %= period;
	i = i < 0 ? i + period : i;
	return (uint32_t)(i < (int64_t)n ? i : period - 1 - i);
}

/* exp(-2 q) - exp(-2) for q in 0..1, by the series of exp(-1) exp(x) around q = 1/2; absolute error below 4e-6. */
static float kernel(float q)
{
	float x = 1 - 2 * q, e = 1.0f / 40320;

	e = e * x + 1.0f / 5040;
	e = e * x + 1.0f / 720;
	e = e * x + 1.0f / 120;
	e = e * x + 1.0f / 24;
	e = e * x + 1.0f / 6;
	e = e * x + 1.0f / 2;
	e = e * x + 1;
	e = e * x + 1;
	return 0.36787944f * e - 0.13533528f;
}

/* Finds the 1 or 4 texels that a point mixes. */
struct points {
	int n;
	uint32_t x[4], y[4];
	float weight[4];
};

static struct points points_at(uint32_t width, uint32_t height, const struct psr_texture *texture, const double st[2])
{
	double x = st[0] * width, y = st[1] * height, x0 = floor(x - 0.5), y0 = floor(y - 0.5);
	double fx = x - 0.5 - x0, fy = y - 0.5 - y0;
	struct points p = { .n = 4 };

	if (texture->is_nearest) {
		p.n = 1;
		p.x[0] = wrap_index((int64_t)floor(x), width, texture->wrap_s);
		p.y[0] = wrap_index((int64_t)floor(y), height, texture->wrap_t);
		p.weight[0] = 1;
		return p;
	}
	for (int i = 0; i < 4; i++) {
		p.x[i] = wrap_index((int64_t)x0 + (i & 1), width, texture->wrap_s);
		p.y[i] = wrap_index((int64_t)y0 + (i >> 1), height, texture->wrap_t);
		p.weight[i] = (float)((i & 1 ? fx : 1 - fx) * (i & 2 ? fy : 1 - fy));
	}
	return p;
}

void filter_point(const struct psr_image *image, enum mip_kind kind, const struct psr_texture *texture,
                  const double st[2], float out[4])
{
	const double folded[2] = { fold(st[0], texture->wrap_s), fold(st[1], texture->wrap_t) };
	struct points p = points_at(image->width, image->height, texture, folded);

	for (int c = 0; c < 4; c++)
		out[c] = 0;
	for (int i = 0; i < p.n; i++) {
		float texel[4];

		mip_decode(kind, image->rgba + 4 * ((size_t)p.y[i] * image->width + p.x[i]), texel);
		for (int c = 0; c < 4; c++)
			out[c] += p.weight[i] * texel[c];
	}
}

/* Computes the weighted mean of the texels of a level under an ellipse around st. */
static void average(const struct mip *mip, int level, const struct psr_texture *texture, const double st[2],
                    const struct ellipse *e, float out[4])
{
	uint32_t w = mip->level[level].width, h = mip->level[level].height, column[MOST_RUN];
	double x = st[0] * w - 0.5, y = st[1] * h - 0.5, det = e->xx * e->yy - e->xy * e->xy;
	double a = e->yy / det, b = -e->xy / det, c = e->xx / det; /* a x^2 + 2 b x y + c y^2 < 1 */
	int64_t left = (int64_t)ceil(x - sqrt(e->xx)), right = (int64_t)floor(x + sqrt(e->xx));
	int64_t top = (int64_t)ceil(y - sqrt(e->yy)), bottom = (int64_t)floor(y + sqrt(e->yy));
	float sum = 0;

	assert(right - left < MOST_RUN && bottom - top < MOST_RUN);
	for (int64_t i = left; i <= right; i++)
		column[i - left] = wrap_index(i, w, texture->wrap_s);
	for (int k = 0; k < 4; k++)
		out[k] = 0;
	for (int64_t j = top; j <= bottom; j++) {
		double dy = (double)j - y, root = a - dy * dy / det;
		uint32_t row = wrap_index(j, h, texture->wrap_t);
		int64_t first, last;

		if (!(root > 0))
			continue;
		root = sqrt(root);
		first = (int64_t)ceil(x + (-b * dy - root) / a);
		last = (int64_t)floor(x + (-b * dy + root) / a);
		first = first > left ? first : left;
		last = last < right ? last : right;
		for (int64_t i = first; i <= last; i++) {
			double dx = (double)i - x;
			float weight = kernel((float)(a * dx * dx + 2 * b * dx * dy + c * dy * dy)), texel[4];

			mip_texel(mip, level, column[i - left], row, texel);
			for (int k = 0; k < 4; k++)
				out[k] += weight * texel[k];
			sum += weight;
		}
	}
	for (int k = 0; k < 4; k++)
		out[k] /= sum;
}

double filter_look_up(const struct mip *mip, const struct psr_texture *texture, const double st[2],
                      const double axes[2][2], float out[4])
{
	struct ellipse e;
	int level = choose_level(mip, axes, &e);
	double folded[2] = { fold(st[0], texture->wrap_s), fold(st[1], texture->wrap_t) };
	double least = short_enough(&e), longest2 = e.long2, own = e.long2 + e.short2, part = ldexp(1, -2 * level), added;
	float point[4];

	if (level == mip->n_levels - 1) {
		mip_texel(mip, level, 0, 0, out);
		return 1;
	}
	if (!(longest2 > 0)) {
		filter_point(mip->image, mip->kind, texture, st, out);
		return 0;
	}
	added = (least > LEAST_AXIS * LEAST_AXIS ? least : LEAST_AXIS * LEAST_AXIS) - e.short2;
	added = added > BILINEAR * part ? added : BILINEAR * part;
	e.xx += added - TEXEL * (1 - part);
	e.yy += added - TEXEL * (1 - part);
	average(mip, level, texture, folded, &e, out);
	if (longest2 < 1) {
		filter_point(mip->image, mip->kind, texture, st, point);
		for (int c = 0; c < 4; c++)
			out[c] = point[c] + (float)longest2 * (out[c] - point[c]);
	}
	return own / (own + 2 * added);
}
