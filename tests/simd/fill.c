/* fill_pull_weights, fill_pull_colors, fill_push, fill_push_picture, fill_far, fill_own and fill_depths: rows of 1 to
 * FILL_WIDTH cells; whole, partial and empty ones, and outside of the picture. fill_beside and fill_pick: squares. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "tests/simd/lib/check.h"

/* n cells, and `around` more on each side. */
static struct fill_row random_row(struct check *c, uint32_t n, uint32_t around, int is_output, int has_colors,
                                  int is_spoilt)
{
	void *(*buffer)(struct check *, size_t, size_t) = is_output ? check_out : check_in;
	const uint32_t all = n + 2 * around;
	struct fill_row row = { .weight = buffer(c, all, 2), .z = buffer(c, all, 4) };
	if (has_colors) {
		row.r = (uint16_t *)buffer(c, all, 2) + around;
		row.g = (uint16_t *)buffer(c, all, 2) + around;
		row.b = (uint16_t *)buffer(c, all, 2) + around;
	}
	const float far = (float)check_real(c, 0.5, 1);
	for (uint32_t i = 0; i < all; i++) {
		const uint32_t kind = check_below(c, 5);
		row.weight[i] = (uint16_t)(kind == 0 ? 0 : kind < 3 ? GAPS_WHOLE : check_below(c, GAPS_WHOLE + 1));
		row.z[i] = kind == 0 ? INFINITY : check_one_in(c, 3) ? far : (float)check_real(c, 0.5, 0.52);
		if (check_one_in(c, 40)) {
			row.weight[i] = GAPS_WHOLE;
			row.z[i] = NAN;
		}
		if (is_spoilt && check_one_in(c, 5))
			row.z[i] = fabsf(check_float(c));
	}
	row.weight += around;
	row.z += around;
	return row;
}

static void pull_weights(struct check *c, uint32_t n, int is_spoilt)
{
	const struct fill_row upper = random_row(c, 2 * n, 0, 0, 0, is_spoilt);
	const struct fill_row lower = random_row(c, 2 * n, 0, 0, 0, is_spoilt);
	const float scale = check_one_in(c, 2) ? 1 : (float)check_real(c, 1, 1.1), offset = (float)check_real(c, 0, 0.1);
	struct fill_row to = random_row(c, n, 0, 1, 0, 0);
	to.near = check_out(c, n, 1);
	check_units(c, n);
	while (check_next(c)) {
		check_result(c, c->simd->fill_pull_weights(&to, &upper, &lower, n, scale, offset));
		if (!c->is_bench)
			check_settle(to.z, n);
	}
}

static void random_pull_weights(struct check *c)
{
	pull_weights(c, 1 + check_below(c, FILL_WIDTH), 0);
}

static void spoilt_pull_weights(struct check *c)
{
	pull_weights(c, 1 + check_below(c, FILL_WIDTH), 1);
}

static void bench_pull_weights(struct check *c)
{
	pull_weights(c, FILL_WIDTH, 0);
}

static void pull_colors(struct check *c, uint32_t n, int is_picture)
{
	const struct fill_row upper = random_row(c, 2 * n, 0, 0, 1, 0), lower = random_row(c, 2 * n, 0, 0, 1, 0);
	struct fill_row to = random_row(c, n, 0, 1, 1, 0);
	to.near = check_in(c, n, 1);
	for (uint32_t i = 0; i < n; i++) { /* whatever has a weight may be near */
		const uint16_t weight[4] = { upper.weight[2 * i], upper.weight[2 * i + 1], lower.weight[2 * i],
			                         lower.weight[2 * i + 1] };
		to.near[i] = 0;
		for (int k = 0; k < 4; k++)
			to.near[i] |= (uint8_t)((weight[k] > 0 && !check_one_in(c, 5)) << k);
	}
	check_units(c, n);
	while (check_next(c))
		c->simd->fill_pull_colors(&to, &upper, &lower, n, is_picture);
}

static void random_pull_colors(struct check *c)
{
	pull_colors(c, 1 + check_below(c, FILL_WIDTH), (int)check_below(c, 2));
}

static void bench_pull_colors(struct check *c)
{
	pull_colors(c, FILL_WIDTH, 1);
}

static void push(struct check *c, uint32_t n, int is_spoilt)
{
	const struct fill_row to = random_row(c, 2 * n, 0, 1, 1, is_spoilt), own = random_row(c, n, 1, 0, 1, is_spoilt);
	const struct fill_row beside = random_row(c, n, 0, 0, 1, is_spoilt);
	const float scale = check_one_in(c, 2) ? 1 : (float)check_real(c, 1, 1.1), offset = (float)check_real(c, 0, 0.1);
	const struct fill_parents parents = { own, beside, n, scale, offset };
	while (check_next(c)) {
		c->simd->fill_push(&to, &parents);
		check_settle(to.z, 2 * (size_t)n);
	}
}

/* Beyond the pixels that are listed there may be anything. */
static void settle_places(struct fill_places *places, uint32_t n)
{
	uint16_t *const list[] = { places->at, places->weight, places->r, places->g, places->b };
	for (size_t i = 0; i < sizeof list / sizeof list[0]; i++)
		memset(list[i] + n, 0, (FILL_PLACES - n) * sizeof *list[i]);
	memset(places->z + n, 0, (FILL_PLACES - n) * sizeof *places->z);
	check_settle(places->z, n);
}

static void push_picture(struct check *c, uint32_t n, int is_spoilt)
{
	const struct fill_row own = random_row(c, n, 1, 0, 1, is_spoilt), beside = random_row(c, n, 0, 0, 1, is_spoilt);
	struct fill_row was = random_row(c, 2 * n, 0, 0, 1, is_spoilt);
	const uint16_t *weight = was.weight;
	const float scale = check_one_in(c, 2) ? 1 : (float)check_real(c, 1, 1.1), offset = (float)check_real(c, 0, 0.1);
	const uint32_t n_blocks = (n + FILL_BLOCK - 1) / FILL_BLOCK, bit = 1u << check_below(c, 32);
	const struct fill_parents parents = { own, beside, n, scale, offset };
	struct fill_places *places = check_out(c, 1, sizeof *places);
	uint32_t *left = check_out(c, n_blocks, sizeof *left);
	for (uint32_t i = 0; i < n_blocks; i++)
		left[i] |= c->is_bench ? bit : 0;
	check_units(c, 2 * n);
	was.weight = check_out(c, 2 * (size_t)n, sizeof *was.weight);
	while (check_next(c)) {
		memcpy(was.weight, weight, 2 * (size_t)n * sizeof *weight);
		const uint32_t n_places =
			c->simd->fill_push_picture(places, left, bit, &was, &parents);
		check_result(c, n_places);
		if (!c->is_bench)
			settle_places(places, n_places);
	}
}

static void random_push(struct check *c)
{
	push(c, 1 + check_below(c, FILL_WIDTH), 0);
}

static void spoilt_push(struct check *c)
{
	push(c, 1 + check_below(c, FILL_WIDTH), 1);
}

static void random_push_picture(struct check *c)
{
	push_picture(c, 1 + check_below(c, FILL_WIDTH), (int)check_below(c, 2));
}

static void bench_push(struct check *c)
{
	push_picture(c, FILL_WIDTH, 0);
}

static void far(struct check *c, uint32_t n)
{
	const float *z = random_row(c, n, 0, 0, 0, 1).z, *own[3];
	const float scale = check_below(c, 2) ? 0x1p-8f : 0, offset = check_below(c, 2) ? 0x1p-6f : 0;
	uint16_t *out = check_out(c, n, sizeof *out);

	for (int k = 0; k < 3; k++)
		own[k] = random_row(c, n, 1, 0, 0, 1).z;
	check_units(c, n);
	while (check_next(c)) {
		const uint32_t n_far = c->simd->fill_far(out, z, own, n, scale, offset);

		check_result(c, n_far);
		if (!c->is_bench)
			memset(out + n_far, 0, (n - n_far) * sizeof *out);
	}
}

static void random_far(struct check *c)
{
	far(c, 1 + check_below(c, 2 * FILL_WIDTH));
}

static void bench_far(struct check *c)
{
	far(c, 2 * FILL_WIDTH);
}

/* A square of depths, and a pixel in the middle: as from the perspective or orthographic views of fill_near.c. */
struct square {
	struct fill_from from;
	const float *own;
	ptrdiff_t stride;
	int reach;
};

static struct square random_square(struct check *c)
{
	const uint32_t stride = 2 * FILL_SQUARE + 2 + check_below(c, 8), n = stride * (2 * FILL_SQUARE + 1);
	float *own = check_in(c, n, sizeof *own);
	const float z = 1 + (float)check_below(c, 256) / 64;
	const int is_perspective = (int)check_below(c, 2);

	for (uint32_t i = 0; i < n; i++) {
		const uint32_t kind = check_below(c, 8);

		own[i] = kind == 0 ? NAN : kind == 1 ? INFINITY : z + ((float)check_below(c, 65) - 32) / 256;
	}
	return (struct square){
		{ (float)check_below(c, 1024) - 511.5f, (float)check_below(c, 1024) - 511.5f, z, is_perspective ? 1 / z : 0,
		  is_perspective ? 1000 / z : 1000 },
		own + FILL_SQUARE * stride + FILL_SQUARE, (ptrdiff_t)stride, 1 + (int)check_below(c, FILL_SQUARE),
	};
}

static void beside(struct check *c)
{
	const struct square s = random_square(c);
	struct fill_beside *out = check_out(c, 1, sizeof *out);

	while (check_next(c))
		*out = c->simd->fill_beside(&s.from, s.own, s.stride, s.reach);
}

static void pick(struct check *c)
{
	const struct square s = random_square(c);
	struct fill_place *out = check_out(c, 1, sizeof *out);

	while (check_next(c)) {
		const struct fill_beside beside = c->simd->fill_beside(&s.from, s.own, s.stride, s.reach);

		*out = (struct fill_place){ 0, 0 };
		if (beside.n)
			*out = c->simd->fill_pick(&s.from, s.own, s.stride, s.reach, beside.along);
	}
}

static void bench_beside(struct check *c)
{
	check_units(c, 1);
	beside(c);
}

static void own(struct check *c, uint32_t n)
{
	const uint64_t *word = check_in(c, n, sizeof *word);
	const uint16_t *weight = random_row(c, n, 0, 0, 0, 0).weight;
	float *out = check_out(c, n, sizeof *out);

	check_units(c, n);
	while (check_next(c))
		c->simd->fill_own(out, word, weight, n);
}

static void random_own(struct check *c)
{
	own(c, 1 + check_below(c, 2 * FILL_WIDTH));
}

static void bench_own(struct check *c)
{
	own(c, 2 * FILL_WIDTH);
}

static void depths(struct check *c, uint32_t n)
{
	uint64_t *word = check_in(c, n, sizeof *word);
	float *z = check_out(c, n, sizeof *z);
	check_units(c, n);
	while (check_next(c))
		c->simd->fill_depths(z, word, n);
}

static void random_depths(struct check *c)
{
	depths(c, 1 + check_below(c, 2 * FILL_WIDTH));
}

static void bench_depths(struct check *c)
{
	depths(c, 2 * FILL_WIDTH);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "fill_pull_weights: random cells", random_pull_weights, 2000, NULL },
		{ "fill_pull_weights: infinite, huge, denormal and no numbers", spoilt_pull_weights, 2000, NULL },
		{ "fill_pull_colors: random cells", random_pull_colors, 2000, NULL },
		{ "fill_push: random cells", random_push, 2000, NULL },
		{ "fill_push: infinite, huge, denormal and no numbers", spoilt_push, 2000, NULL },
		{ "fill_push_picture: random and spoilt pixels", random_push_picture, 2000, NULL },
		{ "fill_far: depths, infinite ones and no numbers", random_far, 500, NULL },
		{ "fill_beside: depths, infinite ones and no numbers", beside, 2000, NULL },
		{ "fill_pick: of pixels as near along the axis, the nearest aside", pick, 2000, NULL },
		{ "fill_own: any words and weights", random_own, 500, NULL },
		{ "fill_depths: any words", random_depths, 500, NULL },
		{ "fill_pull_weights", bench_pull_weights, 0, "cell" },
		{ "fill_pull_colors, from the picture", bench_pull_colors, 0, "cell" },
		{ "fill_push_picture", bench_push, 0, "cell" },
		{ "fill_far", bench_far, 0, "pixel" },
		{ "fill_beside", bench_beside, 0, "pixel" },
		{ "fill_own", bench_own, 0, "pixel" },
		{ "fill_depths", bench_depths, 0, "pixel" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
