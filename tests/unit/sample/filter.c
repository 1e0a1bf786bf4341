#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "surface/filter.h"
#include "meshes.h"

#define MOST_TEXELS 600 /* under one ellipse, as surface/filter.h says */

/* Half a step of a mip map's 16 bits, and of float sums of so many products the rounding, above and below the line. */
#define EPSILON (0.5f / 65535 + 2 * MOST_TEXELS * 0x1p-24f)

struct picture {
	struct psr_image image;
	struct mip mip;
	struct psr_texture texture;
};

static void open_picture(struct picture *p, uint32_t width, uint32_t height, enum mip_kind kind, enum psr_wrap wrap,
                         const uint8_t *rgba)
{
	p->image = (struct psr_image){ width, height, malloc((size_t)4 * width * height) };
	memcpy(p->image.rgba, rgba, (size_t)4 * width * height);
	p->texture = (struct psr_texture){ .image = 0, .wrap_s = wrap, .wrap_t = wrap };
	assert_int_equal(mip_init(&p->mip, &p->image, kind), PSR_OK);
}

static void close_picture(struct picture *p)
{
	mip_fini(&p->mip);
	free(p->image.rgba);
}

/* Grey of each column, from a function of its number. */
static void open_columns(struct picture *p, uint32_t width, uint32_t height, enum psr_wrap wrap,
                         int (*grey)(uint32_t, uint32_t))
{
	uint8_t *rgba = malloc((size_t)4 * width * height);

	for (uint32_t i = 0; i < width * height; i++)
		memset(rgba + 4 * (size_t)i, grey(i % width, width), 4);
	open_picture(p, width, height, MIP_LINEAR, wrap, rgba);
	free(rgba);
}

static int left_is_black(uint32_t x, uint32_t width)
{
	return x < width / 2 ? 0 : 255;
}

static int ramp(uint32_t x, uint32_t width)
{
	(void)width;
	return (int)x;
}

/* Of an ellipse with these semi-axes in texels of level 0 along s and t. */
static float look(const struct picture *p, double s, double t, double along_s, double along_t)
{
	const double st[2] = { s, t };
	const double axes[2][2] = { { along_s / p->image.width, 0 }, { 0, along_t / p->image.height } };
	float out[4];

	filter_look_up(&p->mip, &p->texture, st, axes, out);
	return out[0];
}

static void random_bytes(uint64_t *seed, uint8_t *bytes, size_t n)
{
	for (size_t i = 0; i < n; i++)
		bytes[i] = (uint8_t)(256 * meshes_random(seed));
}

static void random_axes(uint64_t *seed, double axes[2][2])
{
	double length = exp2(24 * meshes_random(seed) - 14), ratio = exp2(-8 * meshes_random(seed));
	double a = 6.28 * meshes_random(seed), b = 6.28 * meshes_random(seed);

	axes[0][0] = length * cos(a);
	axes[1][0] = length * sin(a);
	axes[0][1] = length * ratio * cos(b);
	axes[1][1] = length * ratio * sin(b);
}

static void constant_images_stay_constant_under_every_ellipse(void **state)
{
	static const uint32_t sides[][2] = { { 1, 1 },  { 2, 2 },  { 7, 5 },   { 13, 1 },
		                                 { 1, 64 }, { 33, 3 }, { 64, 64 }, { 3, 255 } };
	uint64_t seed = 1;

	(void)state;
	for (size_t k = 0; k < sizeof sides / sizeof sides[0] * 4 * 3; k++) {
		const uint32_t *side = sides[k / 12];
		uint8_t rgba[64 * 64 * 4];
		struct picture p;
		float expected[4];

		random_bytes(&seed, rgba, 4);
		for (size_t i = 1; i < (size_t)side[0] * side[1]; i++)
			memcpy(rgba + 4 * i, rgba, 4);
		open_picture(&p, side[0], side[1], (enum mip_kind)(k % 4), (enum psr_wrap)(k / 4 % 3), rgba);
		mip_decode(p.mip.kind, rgba, expected);
		for (int i = 0; i < 200; i++) {
			double st[2] = { 4 * meshes_random(&seed) - 2, 4 * meshes_random(&seed) - 2 }, axes[2][2];
			float out[4];

			random_axes(&seed, axes);
			filter_look_up(&p.mip, &p.texture, st, (const double(*)[2])axes, out);
			for (int c = 0; c < 4; c++) /* the steps of normals are twice as large */
				assert_float_equal(out[c], expected[c], (p.mip.kind == MIP_NORMAL ? 2 : 1) * EPSILON);
		}
		close_picture(&p);
	}
}

/* Each level rounds to 16 bits anew, and rounding its sums of floats is far below that. */
static void every_level_has_the_mean_of_the_image(void **state)
{
	static const uint32_t sides[][2] = { { 16, 16 }, { 15, 9 }, { 31, 2 }, { 1, 37 }, { 23, 23 } };
	uint64_t seed = 2;

	(void)state;
	for (size_t k = 0; k < sizeof sides / sizeof sides[0]; k++) {
		uint8_t rgba[23 * 23 * 4];
		struct picture p;
		double first = 0;

		random_bytes(&seed, rgba, sizeof rgba);
		open_picture(&p, sides[k][0], sides[k][1], MIP_COVERED, PSR_WRAP_REPEAT, rgba);
		for (int level = 0; level < p.mip.n_levels; level++) {
			uint32_t w = p.mip.level[level].width, h = p.mip.level[level].height;
			double sum = 0;

			for (uint32_t i = 0; i < w * h; i++) {
				float texel[4];

				mip_texel(&p.mip, level, i % w, i / w, texel);
				sum += (double)texel[1] / (w * h);
			}
			first = level == 0 ? sum : first;
			assert_float_equal(sum, first, level * (0.5 / 65535 + 1e-6));
		}
		assert_int_equal(p.mip.level[p.mip.n_levels - 1].width * p.mip.level[p.mip.n_levels - 1].height, 1);
		close_picture(&p);
	}
}

static uint32_t wrapped(int i, int n, enum psr_wrap wrap)
{
	if (wrap == PSR_WRAP_CLAMP)
		return (uint32_t)(i < 0 ? 0 : i >= n ? n - 1 : i);
	while (i < 0)
		i += 2 * n;
	i %= wrap == PSR_WRAP_MIRROR ? 2 * n : n;
	return (uint32_t)(i < n ? i : 2 * n - 1 - i);
}

/* What adds to the square of a semi-axis for bilinear interpolation: its variance, 1/6, over that of the kernel, half
 * of the mean of q under exp(-2 q) - exp(-2). */
static double bilinear(void)
{
	double e = exp(-2), mean = ((1 - 3 * e) / 4 - e / 2) / ((1 - e) / 2 - e);

	return 1.0 / 6 / (mean / 2);
}

/* The definition, on level 0: 16 texels a side halve exactly, so a shorter axis below 3 texels stays there. */
static void the_filter_is_a_gaussian_over_the_ellipse(void **state)
{
	uint64_t seed = 3;

	(void)state;
	for (int k = 0; k < 300; k++) {
		double least = 1.5 + 1.49 * meshes_random(&seed), most = least * (1 + 7 * meshes_random(&seed));
		double angle = 3.1 * meshes_random(&seed);
		double st[2] = { 3 * meshes_random(&seed) - 1, 3 * meshes_random(&seed) - 1 };
		double axes[2][2] = { { most * cos(angle) / 16, -least * sin(angle) / 16 },
			                  { most * sin(angle) / 16, least * cos(angle) / 16 } };
		double long_axis = sqrt(most * most + bilinear()), short_axis = sqrt(least * least + bilinear());
		double sum = 0, expected[4] = { 0 };
		uint8_t rgba[16 * 16 * 4];
		struct picture p;
		int n = 0;
		float out[4];

		random_bytes(&seed, rgba, sizeof rgba);
		open_picture(&p, 16, 16, MIP_LINEAR, (enum psr_wrap)(k % 3), rgba);
		for (int y = -48; y < 64; y++) {
			for (int x = -48; x < 64; x++) {
				double dx = x + 0.5 - 16 * st[0], dy = y + 0.5 - 16 * st[1];
				double along = (dx * cos(angle) + dy * sin(angle)) / long_axis;
				double across = (dy * cos(angle) - dx * sin(angle)) / short_axis;
				double q = along * along + across * across, weight = exp(-2 * q) - exp(-2);
				size_t at = 4 * (16 * wrapped(y, 16, p.texture.wrap_t) + wrapped(x, 16, p.texture.wrap_s));

				for (int c = 0; q < 1 && c < 4; c++)
					expected[c] += weight * rgba[at + (size_t)c] / 255;
				sum += q < 1 ? weight : 0;
				n += q < 1;
			}
		}
		filter_look_up(&p.mip, &p.texture, st, (const double(*)[2])axes, out);
		/* The kernel's series is 4e-6 off, and a texel on the edge may be in or out with less. */
		for (int c = 0; c < 4; c++)
			assert_float_equal(out[c], expected[c] / sum, 2 * (n + 2) * 4e-6 / sum + EPSILON);
		close_picture(&p);
	}
}

static void a_far_checkerboard_is_its_linear_mean(void **state)
{
	uint8_t rgba[64 * 64 * 4];
	struct picture p;
	uint64_t seed = 4;

	(void)state;
	for (int i = 0; i < 64 * 64; i++)
		memset(rgba + 4 * i, (i + i / 64) & 1 ? 255 : 0, 4);
	open_picture(&p, 64, 64, MIP_COLOR, PSR_WRAP_REPEAT, rgba);
	for (int i = 0; i < 500; i++) /* from 3 texels on the level is one whose every texel has as many of both */
		assert_float_equal(look(&p, meshes_random(&seed), meshes_random(&seed), 3 + 60 * meshes_random(&seed), 30), 0.5,
		                   EPSILON);
	close_picture(&p);
}

/* Around a texel's centre or edge the grid is symmetric, so the mean of a ramp is its value there. */
static void a_gradient_keeps_its_value(void **state)
{
	struct picture p;

	(void)state;
	open_columns(&p, 256, 256, PSR_WRAP_CLAMP, ramp);
	for (int level = 0; level < 4; level++)
		for (int half = 0; half < 8; half++) { /* not as far as the edge of the image */
			double s = 0.5 + half * 0.5 * (1 << level) / 256, radius = 1.7 * (1 << level);

			assert_float_equal(look(&p, s, 0.5, radius, radius), (s * 256 - 0.5) / 255, EPSILON);
			assert_float_equal(look(&p, s, 0.5, radius, 4 * radius), (s * 256 - 0.5) / 255, EPSILON);
			assert_float_equal(look(&p, s, 0.5, 4 * radius, radius), (s * 256 - 0.5) / 255, EPSILON);
		}
	close_picture(&p);
}

static void a_long_ellipse_blurs_along_itself_only(void **state)
{
	struct picture p;

	(void)state;
	open_columns(&p, 64, 64, PSR_WRAP_CLAMP, left_is_black);
	for (int t = 20; t < 44; t++) {
		assert_float_equal(look(&p, 0.5 - 2.0 / 64, t / 64.0, 1.5, 12), 0, EPSILON);
		assert_float_equal(look(&p, 0.5 + 2.0 / 64, t / 64.0, 1.5, 12), 1, EPSILON);
		/* 2 of 12 texels off, a third to a half is on the other side. */
		assert_in_range((int)(1000 * look(&p, 0.5 - 2.0 / 64, t / 64.0, 12, 1.5)), 333, 499);
	}
	close_picture(&p);
}

/* Black on the left and white on the right, met at the outer edge by ellipses that level 1 serves. */
static void every_level_wraps_where_the_image_does(void **state)
{
	static const struct {
		enum psr_wrap wrap;
		float at_0, at_1;
	} expected[] = { { PSR_WRAP_CLAMP, 0, 1 }, { PSR_WRAP_REPEAT, 0.5f, 0.5f }, { PSR_WRAP_MIRROR, 0, 1 } };

	(void)state;
	for (size_t i = 0; i < 3; i++) {
		for (uint32_t side = 16; side <= 17; side++) {
			struct picture p;

			open_columns(&p, side, 16, expected[i].wrap, left_is_black);
			assert_float_equal(look(&p, 0, 0.4, 3.5, 4), expected[i].at_0, EPSILON);
			assert_float_equal(look(&p, 1, 0.4, 3.5, 4), expected[i].at_1, EPSILON);
			assert_float_equal(look(&p, -1, 0.4, 3.5, 4), expected[i].wrap == PSR_WRAP_MIRROR ? 1 : expected[i].at_0,
			                   EPSILON);
			close_picture(&p);
		}
	}
}

/* How much of a wave of 16 texels along t is left under a circle. */
static double amplitude(const struct picture *p, double radius)
{
	double sum = 0;

	for (int i = 0; i < 64; i++)
		sum += (double)look(p, 0.37, i / 64.0, radius, radius) * cos(2 * 3.14159265358979 * i / 16);
	return sum / 32;
}

/* A variance of v texels^2 leaves exp(-2 pi^2 v / 16^2) of the wave: that of a texel of level 1, (4 - 1) / 12, counted twice
 * takes 2 %, or 0.009. */
static void the_level_does_not_show(void **state)
{
	uint8_t rgba[64 * 64 * 4];
	struct picture p;

	(void)state;
	for (int i = 0; i < 64 * 64; i++)
		memset(rgba + 4 * i, (int)(127.5 + 127 * cos(2 * 3.14159265358979 * (i / 64 + 0.5) / 16) + 0.5), 4);
	open_picture(&p, 64, 64, MIP_LINEAR, PSR_WRAP_REPEAT, rgba);
	assert_float_equal(amplitude(&p, 2.999), amplitude(&p, 3.001), 0.0045);
	assert_true(amplitude(&p, 2.999) > amplitude(&p, 4) + 0.01); /* 0.136 (16 - 9) texels^2 more: 7 % */
	close_picture(&p);
}

static void a_point_is_bilinear_or_nearest(void **state)
{
	struct picture p;

	(void)state;
	open_columns(&p, 4, 4, PSR_WRAP_CLAMP, left_is_black);
	assert_float_equal(look(&p, 0.5, 0.5, 0, 0), 0.5, EPSILON);
	assert_float_equal(look(&p, 0.5 + 0.2 / 4, 0.5, 0, 0), 0.7, EPSILON);
	assert_float_equal(look(&p, 0.5 + 0.2 / 4, 0.5, 1e-9, 1e-9), 0.7, EPSILON);
	p.texture.is_nearest = 1;
	assert_float_equal(look(&p, 0.5 + 0.2 / 4, 0.5, 0, 0), 1, EPSILON);
	assert_float_equal(look(&p, 0.5 - 0.2 / 4, 0.5, 1e-9, 1e-9), 0, EPSILON);
	close_picture(&p);
}

static void clear_texels_lend_no_color(void **state)
{
	uint8_t rgba[8 * 8 * 4];
	struct picture p;

	(void)state;
	for (int i = 0; i < 64; i++) { /* clear red, solid green */
		memset(rgba + 4 * i, 0, 4);
		rgba[4 * i + (i & 1)] = 255;
		rgba[4 * i + 3] = i & 1 ? 255 : 0;
	}
	open_picture(&p, 8, 8, MIP_COVERED, PSR_WRAP_REPEAT, rgba);
	for (double radius = 0; radius < 10; radius += 0.37) {
		const double st[2] = { 0.43, 0.5 }, axes[2][2] = { { radius / 8, 0 }, { 0, radius / 8 } };
		float out[4];

		filter_look_up(&p.mip, &p.texture, st, axes, out);
		assert_float_equal(out[0], 0, 0);
		assert_float_equal(out[1], out[3], 1e-6f);
		assert_true(out[3] > 0.1f);
	}
	close_picture(&p);
}

static void the_share_of_the_ellipse_grows_with_it(void **state)
{
	struct picture p;
	double last = 0;

	(void)state;
	open_columns(&p, 64, 64, PSR_WRAP_REPEAT, ramp);
	for (double radius = 0; radius < 200; radius = radius * 1.1 + 0.01) {
		const double st[2] = { 0.3, 0.3 }, axes[2][2] = { { radius / 64, 0 }, { 0, radius / 64 } };
		double share;
		float out[4];

		share = filter_look_up(&p.mip, &p.texture, st, axes, out);
		/* A circle is raised to 1.5 texels, or by bilinear interpolation; from 1.5 texels of level 6 on it is the mean.
		 * The kernel's variance is rounded to five digits. */
		assert_float_equal(share, radius >= 1.5 * 64 ? 1 : radius * radius / fmax(2.25, radius * radius + bilinear()),
		                   1e-5);
		assert_true(share >= last);
		last = share;
	}
	close_picture(&p);
}

static void wild_numbers_stay_inside(void **state)
{
	static const double wild[] = { 0, 1e-300, 1, -1, 1e10, -1e10, 1e17, -1e100, 1e308, (double)INFINITY, (double)NAN };
	enum { N = sizeof wild / sizeof wild[0] };
	uint8_t rgba[5 * 3 * 4];
	uint64_t seed = 9;

	(void)state;
	random_bytes(&seed, rgba, sizeof rgba);
	for (int k = 0; k < 3; k++) {
		struct picture p;

		open_picture(&p, 5, 3, MIP_COLOR, (enum psr_wrap)k, rgba);
		for (int i = 0; i < N * N * N * N; i++) {
			const double st[2] = { wild[i % (N - 2)], wild[i / N % (N - 2)] };
			const double axes[2][2] = { { wild[i % N], wild[i / N % N] },
				                        { wild[i / N / N % N], wild[i / N / N / N] } };
			double share;
			float out[4];

			share = filter_look_up(&p.mip, &p.texture, st, axes, out);
			assert_true(share >= 0 && share <= 1);
			for (int c = 0; c < 4; c++)
				assert_true(out[c] >= -EPSILON && out[c] <= 1 + EPSILON);
		}
		close_picture(&p);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(constant_images_stay_constant_under_every_ellipse),
		cmocka_unit_test(every_level_has_the_mean_of_the_image),
		cmocka_unit_test(the_filter_is_a_gaussian_over_the_ellipse),
		cmocka_unit_test(a_far_checkerboard_is_its_linear_mean),
		cmocka_unit_test(a_gradient_keeps_its_value),
		cmocka_unit_test(a_long_ellipse_blurs_along_itself_only),
		cmocka_unit_test(every_level_wraps_where_the_image_does),
		cmocka_unit_test(the_level_does_not_show),
		cmocka_unit_test(a_point_is_bilinear_or_nearest),
		cmocka_unit_test(clear_texels_lend_no_color),
		cmocka_unit_test(the_share_of_the_ellipse_grows_with_it),
		cmocka_unit_test(wild_numbers_stay_inside),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
