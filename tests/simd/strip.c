/* strip_list, strip_find, strip_read and strip_resolve: rows of 1 to STRIP pixels, one instance or some. */
#include <stddef.h>
#include <string.h>
#include "base/maths.h"
#include "base/direction.h"
#include "tests/simd/lib/blocks.h"

#define MAX_INSTANCES 3
#define MAX_PROJECTIONS 4

static void settle(struct strip *strip)
{
	check_settle(strip->px, (offsetof(struct strip, r) - offsetof(struct strip, px)) / sizeof(float));
}

/* ---- list ---- */

static void list_pixels(struct check *c, uint32_t n, int is_weighted, uint32_t empty_one_in)
{
	struct strip_pixels *p = check_out(c, 1, sizeof *p);
	uint64_t *word = check_in(c, n, sizeof *word);
	uint16_t *weight = is_weighted ? check_in(c, n, sizeof *weight) : NULL;
	const unsigned place_bits = check_one_in(c, 2) ? PSR_PLACE_BITS : 0;

	for (uint32_t i = 0; i < n; i++) {
		word[i] = (word[i] & UINT64_C(0x7fffffffffffffff)) % PSR_WORD_EMPTY;
		if (check_one_in(c, empty_one_in))
			word[i] = PSR_WORD_EMPTY;
		if (weight)
			weight[i] = (uint16_t)(check_one_in(c, 3) ? 0 : check_below(c, 257));
	}
	check_units(c, n);
	while (check_next(c)) {
		c->simd->strip_list(p, word, weight, n, place_bits);
		if (c->is_bench)
			continue;
		memset(p->x + p->n, 0, sizeof p->x - p->n * sizeof *p->x);
		memset(p->id + p->n, 0, sizeof p->id - p->n * sizeof *p->id);
	}
}

static void random_lists(struct check *c)
{
	list_pixels(c, 1 + check_below(c, STRIP), (int)check_below(c, 2), 1 + check_below(c, 6));
}

static void bench_list(struct check *c)
{
	list_pixels(c, STRIP, 1, 5);
}

/* ---- resolve ---- */

static uint32_t valid_sample(struct check *c, uint64_t mask)
{
	uint32_t sample = check_below(c, 64);
	while (!(mask >> sample & 1))
		sample = (sample + 1) % 64;
	return sample;
}

static void random_instance(struct check *c, struct warp_instance *in, const struct psr_blocks *blocks, int is_spoilt)
{
	struct warp_lattice *lattice = check_in(c, MAX_PROJECTIONS, sizeof *lattice);
	for (int p = 0; p < MAX_PROJECTIONS; p++) {
		psr_placing_make(&lattice[p].placing, &blocks->projection[p]);
		for (int a = 0; a < 3; a++) {
			lattice[p].origin[a] = (double)check_plain_or_any(c, is_spoilt, -1, 1);
			lattice[p].step[a] = (double)check_plain_or_any(c, is_spoilt, -0.01, 0.01);
			lattice[p].down[a] = (double)check_plain_or_any(c, is_spoilt, -0.01, 0.01);
			lattice[p].along[a] = (double)check_plain_or_any(c, is_spoilt, -1, 1);
			for (int i = 0; i < 8; i++) {
				lattice[p].row[a][i] = i * lattice[p].down[a] + (i & 1) * 0.5 * lattice[p].step[a];
				lattice[p].col[a][i] = (float)(i * lattice[p].step[a]);
			}
		}
	}
	in->blocks = blocks;
	in->cubes = NULL;
	in->points = NULL;
	in->lattice = lattice;
	for (int k = 0; k < 9; k++)
		in->turn[k / 3][k % 3] = check_plain_or_any(c, is_spoilt, -1, 1);
}

/* The covered pixels of a row, runs of a few instances. */
static void random_pixels(struct check *c, struct strip_pixels *p, const struct strip_view *view, uint32_t n)
{
	uint64_t *word = check_in(c, STRIP, sizeof *word);
	for (uint32_t i = 0; i < STRIP; i++)
		word[i] = (uint64_t)psr_bits_from_float(check_plain_or_any(c, 1, 0.1, 1)) << 32;
	p->word = word;
	uint32_t x = 0, in = 0;
	p->n = 0;
	p->x0 = STRIP * check_below(c, PSR_MAX_SIDE / STRIP);
	p->y = check_below(c, PSR_MAX_SIDE);
	for (; x < STRIP && p->n < n; x += 1 + (n < STRIP && check_one_in(c, 5))) {
		if (check_one_in(c, 20))
			in = check_below(c, view->n_instances);
		const struct psr_blocks *b = view->instance[in].blocks;
		const uint32_t block = check_below(c, b->n_blocks);
		p->x[p->n] = (uint16_t)x;
		p->id[p->n++] = (view->instance[in].first_slot + block) * PSR_BLOCK_SAMPLES + valid_sample(c, b->mask[block]);
	}
}

static void resolve(struct check *c, uint32_t n, unsigned needs, int is_spoilt)
{
	const uint32_t n_instances = 1 + check_below(c, MAX_INSTANCES);
	struct warp_instance *instance = check_in(c, n_instances, sizeof *instance);
	struct strip_view *view = check_in(c, 1, sizeof *view);
	struct strip_pixels *pixels = check_out(c, 1, sizeof *pixels);
	struct strip *strip = check_out(c, 1, sizeof *strip);
	float *ambient = check_in(c, 3, sizeof *ambient);
	struct psr_blocks blocks;

	check_blocks(c, &blocks, 1 + check_below(c, check_one_in(c, 60) ? 2 * PSR_RUN_BLOCKS : 40), MAX_PROJECTIONS, 0);
	if (check_one_in(c, 2)) /* no highlights */
		for (uint64_t i = 0; i < blocks.n_samples; i++)
			((uint64_t *)blocks.attr)[i] &= ~(UINT64_C(0xffff) << 40);
	if (check_one_in(c, 3)) /* one colour */
		for (uint64_t i = 0; i < blocks.n_samples; i++)
			((uint64_t *)blocks.attr)[i] = (blocks.attr[i] & 0xffff) | UINT64_C(0x500ccf8090a00000);
	uint32_t slot = check_one_in(c, 3) ? (1u << 26) - 1 - n_instances * blocks.n_blocks : 0;
	for (uint32_t i = 0; i < n_instances; i++, slot += blocks.n_blocks) {
		random_instance(c, &instance[i], &blocks, is_spoilt);
		instance[i].first_slot = slot;
	}
	*view = (struct strip_view){
		.instance = instance, .n_instances = n_instances, .direction_word = psr_direction_words(), .needs = needs,
		.half_width = (float)check_below(c, PSR_MAX_SIDE) / 2, .half_height = (float)check_below(c, PSR_MAX_SIDE) / 2,
		.focal = check_plain_or_any(c, is_spoilt, 1, 1000), .perspective = (int)check_below(c, 2),
		.lit = check_one_in(c, 4) && !c->is_bench ? check_in(c, PSR_DIRECTIONS, sizeof *view->lit) : NULL,
	};
	for (int k = 0; k < 3; k++)
		ambient[k] = check_plain_or_any(c, is_spoilt, 0, 1);
	random_pixels(c, pixels, view, n);
	strip->pixels = pixels;
	check_units(c, pixels->n);
	while (check_next(c)) {
		c->simd->strip_find(pixels, view);
		c->simd->strip_read(strip, view);
		c->simd->strip_resolve(strip, view, ambient);
		if (!c->is_bench)
			settle(strip);
	}
}

static void random_resolve(struct check *c)
{
	resolve(c, 1 + check_below(c, STRIP), check_below(c, 32), 0);
}

static void spoilt_resolve(struct check *c)
{
	resolve(c, 1 + check_below(c, STRIP), check_below(c, 32), 1);
}

static void bench_resolve(struct check *c)
{
	resolve(c, STRIP, 0, 0);
}

static void bench_positions(struct check *c)
{
	resolve(c, STRIP, STRIP_POSITION, 0);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "strip_list: random rows", random_lists, 2000, NULL },
		{ "strip_find, strip_read, strip_resolve: random samples", random_resolve, 1000, NULL },
		{ "strip_find, strip_read, strip_resolve: any numbers", spoilt_resolve, 1000, NULL },
		{ "strip_list", bench_list, 0, "pixel" },
		{ "strip_find, strip_read, strip_resolve", bench_resolve, 0, "sample" },
		{ "the same, with positions", bench_positions, 0, "sample" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
