/* strip_light, strip_lit, strip_color, strip_write and depth_row: 1 to STRIP samples, lights of each kind, any
 * numbers. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "base/maths.h"
#include "base/direction.h"
#include "tests/simd/lib/check.h"

static void settle(struct strip *strip)
{
	check_settle(strip->px, (offsetof(struct strip, r) - offsetof(struct strip, px)) / sizeof(float));
}

static void random_samples(struct check *c, struct strip *strip, uint32_t n, int is_specular, int is_spoilt)
{
	strip->n = n;
	strip->is_specular = is_specular;
	for (float *value = strip->px; value < strip->sr; value++)
		*value = check_plain_or_any(c, is_spoilt, -1, 1);
	for (float *value = strip->sr; value < strip->lr; value++)
		*value = check_plain_or_any(c, is_spoilt, 0, 1);
	for (float *value = strip->lr; value < (float *)strip->r; value++)
		*value = check_plain_or_any(c, is_spoilt, 0, 2);
}

static void light(struct check *c, uint32_t n, enum psr_light_kind kind, int is_specular, int is_spoilt)
{
	struct strip *strip = check_out(c, 1, sizeof *strip);
	struct strip_light *to = check_in(c, 1, sizeof *to);

	float *reaches = check_one_in(c, 2) && !c->is_bench ? check_in(c, n, sizeof *reaches) : NULL;

	random_samples(c, strip, n, is_specular, is_spoilt);
	for (uint32_t i = 0; reaches && i < n; i++)
		reaches[i] = check_plain_or_any(c, is_spoilt, 0, 1);
	to->kind = kind;
	for (int k = 0; k < 3; k++) {
		to->position[k] = check_plain_or_any(c, is_spoilt, -2, 2);
		to->to_light[k] = check_plain_or_any(c, is_spoilt, -1, 1);
		to->axis[k] = check_plain_or_any(c, is_spoilt, -1, 1);
		to->color[k] = check_plain_or_any(c, is_spoilt, 0, 2);
	}
	to->cos_outer = check_plain_or_any(c, is_spoilt, -1, 1);
	to->cos_inner = check_one_in(c, 4) ? to->cos_outer : check_plain_or_any(c, is_spoilt, (double)to->cos_outer, 1);
	to->reference2 = check_one_in(c, 3) ? 0 : check_plain_or_any(c, is_spoilt, 0, 4);
	if (check_one_in(c, 2)) { /* a light in a sample */
		to->position[0] = strip->px[0];
		to->position[1] = strip->py[0];
		to->position[2] = strip->pz[0];
	}
	check_units(c, n);
	while (check_next(c)) {
		c->simd->strip_light(strip, to, reaches);
		if (!c->is_bench)
			settle(strip);
	}
}

static void random_light(struct check *c)
{
	light(c, 1 + check_below(c, STRIP), (enum psr_light_kind)check_below(c, 3), (int)check_below(c, 2), 0);
}

static void spoilt_light(struct check *c)
{
	light(c, 1 + check_below(c, STRIP), (enum psr_light_kind)check_below(c, 3), (int)check_below(c, 2), 1);
}

static void bench_sun(struct check *c)
{
	light(c, STRIP, PSR_LIGHT_DIRECTIONAL, 0, 0);
}

static void bench_sun_specular(struct check *c)
{
	light(c, STRIP, PSR_LIGHT_DIRECTIONAL, 1, 0);
}

static void bench_spot_specular(struct check *c)
{
	light(c, STRIP, PSR_LIGHT_SPOT, 1, 0);
}

/* Of directional lights: tables are made for these alone. */
static void lit(struct check *c, uint32_t first, uint32_t n, uint32_t n_lights, int is_spoilt)
{
	float (*table)[4] = check_out(c, first + n, sizeof *table);
	struct strip_light *lights = check_in(c, n_lights, sizeof *lights);
	struct warp_instance *instance = check_in(c, 1, sizeof *instance);
	const struct strip_view view = { .instance = instance, .n_instances = 1, .direction_word = psr_direction_words() };

	for (uint32_t l = 0; l < n_lights; l++) {
		lights[l].kind = PSR_LIGHT_DIRECTIONAL;
		for (int k = 0; k < 3; k++) {
			lights[l].to_light[k] = check_plain_or_any(c, is_spoilt, -1, 1);
			lights[l].color[k] = check_plain_or_any(c, is_spoilt, 0, 2);
		}
	}
	for (int k = 0; k < 9; k++)
		instance->turn[k / 3][k % 3] = check_plain_or_any(c, is_spoilt, -1, 1);
	const struct strip_lights all = { lights, n_lights };
	check_units(c, n);
	while (check_next(c)) {
		c->simd->strip_lit(table, &view, &all, first, n);
		if (!c->is_bench)
			check_settle(table[0], 4 * (size_t)(first + n));
	}
}

static void random_lit(struct check *c)
{
	lit(c, check_below(c, 1000), 1 + check_below(c, STRIP), check_below(c, 5), (int)check_below(c, 2));
}

static void bench_lit(struct check *c)
{
	lit(c, 0, STRIP, 2, 0);
}

static void color(struct check *c, uint32_t n, int is_specular, int is_wide, int is_spoilt)
{
	struct strip *strip = check_out(c, 1, sizeof *strip);
	float *ambient = check_in(c, 3, sizeof *ambient);
	random_samples(c, strip, n, is_specular, is_spoilt);
	for (int k = 0; k < 3; k++)
		ambient[k] = check_plain_or_any(c, is_spoilt, 0, 1);
	check_units(c, n);
	while (check_next(c))
		c->simd->strip_color(strip, ambient, is_wide);
}

static void random_color(struct check *c)
{
	color(c, 1 + check_below(c, STRIP), (int)check_below(c, 2), (int)check_below(c, 2), (int)check_below(c, 2));
}

static void bench_color(struct check *c)
{
	color(c, STRIP, 1, 0, 0);
}

static void bench_wide(struct check *c)
{
	color(c, STRIP, 1, 1, 0);
}

/* ---- write and depths ---- */

static void write_pixels(struct check *c, uint32_t width, uint32_t height, int has_rgb, int has_linear)
{
	struct strip *strip = check_in(c, 1, sizeof *strip);
	struct strip_pixels *p = check_in(c, 1, sizeof *p);
	struct strip_target *to = check_in(c, 1, sizeof *to);
	const size_t area = (size_t)width * height;

	p->x0 = STRIP * check_below(c, (width + STRIP - 1) / STRIP);
	p->y = check_below(c, height);
	const uint32_t n = width - p->x0 < STRIP ? width - p->x0 : STRIP;
	p->n = 0;
	memset(p->has_sample, 0, sizeof p->has_sample);
	for (uint32_t x = check_below(c, 3); x < n; x += check_one_in(c, 6) ? 1 + check_below(c, 40) : 1) {
		p->has_sample[x / 32] |= 1u << x % 32;
		p->x[p->n++] = (uint16_t)x;
	}
	strip->pixels = p;
	to->width = width;
	to->srgb = check_in(c, 65536, 1);
	to->rgb = has_rgb ? check_out(c, area, 3) : NULL;
	uint8_t *wants = has_linear ? check_in(c, (n + STRIP_BRICK - 1) / STRIP_BRICK, 1) : NULL;
	for (uint32_t i = 0; wants && i < (n + STRIP_BRICK - 1) / STRIP_BRICK; i++)
		wants[i] = (uint8_t)check_below(c, 3);
	to->wants = wants;
	to->r = has_linear ? check_out(c, area, 2) : NULL;
	to->g = has_linear ? check_out(c, area, 2) : NULL;
	to->b = has_linear ? check_out(c, area, 2) : NULL;
	check_units(c, n);
	while (check_next(c))
		c->simd->strip_write(strip, to, n);
}

static void random_write(struct check *c)
{
	const uint32_t kind = check_below(c, 3);
	write_pixels(c, 1 + check_below(c, 3 * STRIP), 1 + check_below(c, 4), kind < 2, kind > 0);
}

static void bench_write(struct check *c)
{
	write_pixels(c, STRIP, 1, 1, 0);
}

static void depths(struct check *c, uint32_t n, int exponent)
{
	uint64_t *word = check_in(c, n, sizeof *word);
	float *depth = check_out(c, n, sizeof *depth);
	for (uint32_t i = 0; i < n; i++) {
		const float z = c->is_bench ? (float)check_real(c, 0.1, 1) : fabsf(check_float(c));
		word[i] = (uint64_t)psr_bits_from_float(z) << 32 | check_u32(c);
		if (check_one_in(c, 4))
			word[i] = PSR_WORD_EMPTY;
	}
	check_units(c, n);
	while (check_next(c)) {
		c->simd->depth_row(depth, word, n, exponent);
		if (!c->is_bench)
			check_settle(depth, n);
	}
}

static void random_depths(struct check *c)
{
	depths(c, 1 + check_below(c, 700), (int)check_below(c, 900) - 450);
}

static void bench_depths(struct check *c)
{
	depths(c, 1024, 3);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "strip_light: random lights", random_light, 2000, NULL },
		{ "strip_light: infinite, huge, denormal and no numbers", spoilt_light, 2000, NULL },
		{ "strip_lit: random normals and lights", random_lit, 1000, NULL },
		{ "strip_color: random samples", random_color, 1000, NULL },
		{ "strip_write: random rows", random_write, 1000, NULL },
		{ "depth_row: any depths and exponents", random_depths, 1000, NULL },
		{ "strip_light, directional", bench_sun, 0, "sample" },
		{ "strip_light, directional, highlights", bench_sun_specular, 0, "sample" },
		{ "strip_light, spot, highlights", bench_spot_specular, 0, "sample" },
		{ "strip_lit, two lights", bench_lit, 0, "normal" },
		{ "strip_color, highlights", bench_color, 0, "sample" },
		{ "strip_color, highlights, wide", bench_wide, 0, "sample" },
		{ "strip_write, 8 bits", bench_write, 0, "pixel" },
		{ "depth_row", bench_depths, 0, "pixel" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
