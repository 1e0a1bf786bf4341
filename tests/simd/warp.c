/* warp, discs, veil, warp_clear, warp_cells and warp_far: tiles of pictures of all sizes, blocks of 1 to 64 samples, every
 * level of the depth buffer. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "tests/simd/lib/blocks.h"
#include "tests/simd/lib/picture.h"

#define MAX_INSTANCES 3
#define MAX_PROJECTIONS 4

enum numbers { PLAIN, SPOILT, EDGES };

static void complete_lattice(struct warp_lattice *lattice, const struct psr_projection *projection)
{
	psr_placing_make(&lattice->placing, projection);
	for (int a = 0; a < 3; a++)
		for (int i = 0; i < 8; i++) {
			lattice->row[a][i] = i * lattice->down[a] + (i & 1) * 0.5 * lattice->step[a];
			lattice->col[a][i] = (float)(i * lattice->step[a]);
		}
}

/* A sample's step is `step` pixels, and the lattice lies in the tile or near it, before the eye or on both sides of
 * it. */
static void random_lattice(struct check *c, struct warp_lattice *lattice, const struct psr_projection *projection,
                           const struct warp_target *t, double step)
{
	const double u = check_real(c, t->x0 - 20, t->x1 + 20), v = check_real(c, t->y0 - 20, t->y1 + 20);
	const double z = check_real(c, check_one_in(c, 4) ? -0.1 : 0.3, 1), scale = t->perspective ? z : 1;
	const double turn = check_real(c, 0, 6.28), across = cos(turn) * step * scale, down = sin(turn) * step * scale;

	*lattice = (struct warp_lattice){
		.origin = { u * scale, v * scale, z }, .step = { across, down, check_real(c, -0.01, 0.01) },
		.down = { -down, across, check_real(c, -0.01, 0.01) },
		.along = { check_real(c, -30, 30), check_real(c, -30, 30), check_real(c, -0.3, 0.3) },
	};
	complete_lattice(lattice, projection);
}

/* Numbers that no lattice should have, here and there. */
static void spoil_lattice(struct check *c, struct warp_lattice *lattice)
{
	for (int a = 0; a < 3; a++) {
		double *one[] = { &lattice->origin[a], &lattice->step[a], &lattice->down[a], &lattice->along[a] };
		for (int i = 0; i < 4; i++)
			if (check_one_in(c, 6))
				*one[i] = (double)check_float(c) * (check_one_in(c, 8) ? 0x1p1000 : 1);
		for (int i = 0; i < 8; i++) {
			if (check_one_in(c, 12))
				lattice->row[a][i] = (double)check_float(c) * (check_one_in(c, 8) ? 0x1p-1000 : 1);
			if (check_one_in(c, 12))
				lattice->col[a][i] = check_float(c);
		}
	}
}

/* Samples on the very edges: of pixels, cells and tiles, and at near_z itself. */
static void edge_lattice(struct check *c, struct warp_lattice *lattice, const struct psr_projection *projection,
                         const struct warp_target *t)
{
	const double x = check_one_in(c, 2) ? t->x0 : t->x1, y = check_one_in(c, 2) ? t->y0 : t->y1;
	const double z = check_one_in(c, 2) ? (double)t->near_z : exp2(check_below(c, 3));
	const double step = exp2((double)check_below(c, 4) - 2);
	const double scale = t->perspective ? z : 1;
	*lattice = (struct warp_lattice){
		.origin = { (x - 4 * step) * scale, (y - 4 * step) * scale, z },
		.step = { step * scale, 0, 0 }, .down = { 0, step * scale, 0 },
	};
	complete_lattice(lattice, projection);
}

static const struct bin_entry *make_entries(struct check *c, struct picture *p, uint32_t n_entries, uint32_t n_samples,
                                            double step, enum numbers numbers)
{
	struct warp_target *t = &p->target;
	const uint32_t n_instances = 1 + check_below(c, MAX_INSTANCES);
	struct warp_instance *instance = check_in(c, n_instances, sizeof *instance);
	struct bin_entry *entry = check_in(c, n_entries, sizeof *entry);
	static struct psr_blocks blocks;

	t->instance = instance;
	t->perspective = check_one_in(c, 4) ? 0 : 1;
	t->near_z = numbers == SPOILT && check_one_in(c, 3) ? fabsf(check_float(c)) : 0x1p-14f;
	t->near_z = t->near_z > 0 ? t->near_z : 0x1p-149f;
	check_blocks(c, &blocks, 1 + check_below(c, check_one_in(c, 60) ? 2 * PSR_RUN_BLOCKS : 40), MAX_PROJECTIONS,
	             n_samples);
	const uint32_t last_slot = (1u << 26) - 1 - n_instances * blocks.n_blocks;
	const uint32_t first_slot = check_one_in(c, 3) ? last_slot : check_below(c, last_slot);
	for (uint32_t i = 0; i < n_instances; i++) {
		struct warp_lattice *lattice = check_in(c, MAX_PROJECTIONS, sizeof *lattice);
		for (int k = 0; k < MAX_PROJECTIONS; k++) {
			if (numbers == EDGES)
				edge_lattice(c, &lattice[k], &blocks.projection[k], t);
			else
				random_lattice(c, &lattice[k], &blocks.projection[k], t, step);
			if (numbers == SPOILT)
				spoil_lattice(c, &lattice[k]);
		}
		instance[i].blocks = &blocks;
		instance[i].lattice = lattice;
		instance[i].first_slot = first_slot + i * blocks.n_blocks;
		picture_sight(c, &instance[i], t, numbers == SPOILT);
	}
	for (uint32_t e = 0; e < n_entries; e++) {
		const uint32_t i = check_below(c, n_instances);
		int level = (int)check_below(c, PSR_MAX_DEPTH_LEVEL + 1);
		while (level && !(p->levels >> level & 1))
			level--;
		entry[e] = (struct bin_entry){ .slot = instance[i].first_slot + check_below(c, blocks.n_blocks),
			                           .instance = (uint16_t)i,
			                           .level = (uint8_t)level,
			                           .is_mixed = (uint8_t)check_below(c, 2) };
	}
	check_units(c, (uint64_t)n_entries * n_samples);
	return entry;
}

static void warp_blocks(struct check *c, struct picture *p, uint32_t n_entries, uint32_t n_samples, double step,
                        enum numbers numbers)
{
	const struct bin_entry *entry = make_entries(c, p, n_entries, n_samples, step, numbers);

	p->target.place_bits = check_one_in(c, 2) ? PSR_PLACE_BITS : 0;
	while (check_next(c))
		check_result(c, c->simd->warp(&p->target, entry, n_entries));
}

/* The blocks as discs, some shrunk, and of some blocks but a part. */
static void disc_blocks(struct check *c, struct picture *p, uint32_t n_entries, uint32_t n_samples, double step,
                        enum numbers numbers)
{
	const struct bin_entry *entry = make_entries(c, p, n_entries, n_samples, step, numbers);
	const float most = check_one_in(c, 3) ? 3 : 130, rim = (float)check_real(c, 0, 0.01);
	const uint64_t some = check_one_in(c, 3) ? check_u64(c) : UINT64_MAX;

	while (check_next(c)) {
		uint64_t n_discs = 0;

		for (uint32_t e = 0; e < n_entries; e++) {
			struct discs discs;

			c->simd->discs_of_block(&discs, &p->target, &entry[e]);
			discs.most = most;
			discs.rim = rim;
			c->simd->discs_place(&discs, &p->target);
			c->simd->discs_draw(&p->target, &discs, discs.mask & some);
			n_discs += (uint64_t)__builtin_popcountll(discs.mask);
		}
		check_result(c, n_discs);
	}
}

/* The blocks as points, or as squares of up to `most_side` pixels. */
static void veil_blocks(struct check *c, struct picture *p, const struct bin_entry *bin, uint32_t n, uint32_t most_side)
{
	struct warp_target *t = &p->target;
	const size_t n_pixels = (size_t)t->stride * (size_t)(t->y1 - t->y0);
	struct veil_entry *entry = check_in(c, n, sizeof *entry);
	float *before = check_in(c, n_pixels, sizeof *before), *bits = check_in(c, PSR_OPAQUE + 1, sizeof *bits);
	uint32_t *veil = check_out(c, n_pixels, sizeof *veil);
	uint64_t *word = check_out(c, n_pixels, sizeof *word);
	const struct veil_layer layer = { before, word, veil, bits };

	for (uint32_t e = 0; e < n; e++)
		entry[e] = (struct veil_entry){ .slot = bin[e].slot, .instance = bin[e].instance,
			                            .side = (uint16_t)(1 + (check_one_in(c, 2) ? check_below(c, most_side) : 0)),
			                            .area = (float)check_real(c, 0, 4) };
	for (int i = 0; i <= PSR_OPAQUE; i++)
		bits[i] = check_one_in(c, 20) ? 0x1p28f : (float)check_real(c, 0, VEIL_MOST / 8);
	for (size_t i = 0; i < n_pixels; i++) {
		before[i] = picture_depth(c);
		word[i] = check_one_in(c, 2) ? PSR_WORD_EMPTY : (uint64_t)psr_bits_from_float(picture_depth(c)) << 32;
		veil[i] = check_one_in(c, 3) ? VEIL_MOST - check_below(c, 9999) : check_below(c, VEIL_MOST + 1);
	}
	while (check_next(c))
		c->simd->veil(t, &layer, entry, n);
}

static void random_veils(struct check *c)
{
	static const enum numbers kinds[] = { PLAIN, PLAIN, SPOILT, EDGES };
	const enum numbers numbers = kinds[check_below(c, sizeof kinds / sizeof kinds[0])];
	const uint32_t n = check_below(c, 30);
	struct picture p;

	picture_random(c, &p);
	const struct bin_entry *entry = make_entries(c, &p, n, 0, exp2(check_real(c, -8, 6)), numbers);
	veil_blocks(c, &p, entry, n, check_one_in(c, 4) ? VEIL_MOST_SIDE : 5);
}

static void random_blocks(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	warp_blocks(c, &p, check_below(c, 30), 0, exp2(check_real(c, -8, 6)), PLAIN);
}

static void blocks_of_each_count(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	warp_blocks(c, &p, 1, 1 + (uint32_t)c->trial / 2 % 64, exp2(check_real(c, -3, 2)), PLAIN);
}

static void spoilt_numbers(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	warp_blocks(c, &p, 1 + check_below(c, 12), 0, exp2(check_real(c, -8, 6)), SPOILT);
}

static void edges(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	warp_blocks(c, &p, 1 + check_below(c, 12), 0, 1, EDGES);
}

/* One-row and one-column tiles: a variant has less room there than it has lanes. */
static void narrow_tiles(struct check *c)
{
	struct picture p;
	const uint32_t w = check_one_in(c, 2) ? 1 + check_below(c, 17) : TILE_WIDTH + 1 + check_below(c, 17);
	picture_make(c, &p, w, check_one_in(c, 2) ? 1 : TILE_HEIGHT + 1, check_u32(c));
	warp_blocks(c, &p, 1 + check_below(c, 12), 0, exp2(check_real(c, -3, 3)), PLAIN);
}

static void random_discs(struct check *c)
{
	static const enum numbers kinds[] = { PLAIN, PLAIN, SPOILT, EDGES };
	const enum numbers numbers = kinds[check_below(c, sizeof kinds / sizeof kinds[0])];
	struct picture p;

	picture_random(c, &p);
	disc_blocks(c, &p, check_below(c, 20), 0, exp2(check_real(c, -4, 5)), numbers);
}

static void discs_in_narrow_tiles(struct check *c)
{
	const uint32_t w = check_one_in(c, 2) ? 1 + check_below(c, 17) : TILE_WIDTH + 1 + check_below(c, 17);
	struct picture p;

	picture_make(c, &p, w, check_one_in(c, 2) ? 1 : TILE_HEIGHT + 1, check_u32(c));
	disc_blocks(c, &p, 1 + check_below(c, 12), 0, exp2(check_real(c, -1, 4)), PLAIN);
}

static void random_clear(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	p.target.clean = check_u32(c) & ALL_PARTS;
	while (check_next(c))
		c->simd->warp_clear(&p.target, p.levels);
}

static void random_cells(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	p.target.bare = check_u32(c) & ALL_PARTS;
	while (check_next(c))
		for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
			if (p.levels >> k & 1)
				c->simd->warp_cells(&p.target, k);
}

static void random_far(struct check *c)
{
	struct picture p;
	picture_random(c, &p);
	const uint32_t rows = (uint32_t)(p.target.y1 - p.target.y0 + FAR_SIDE - 1) / FAR_SIDE;
	uint32_t *far = check_out(c, rows * (TILE_WIDTH / FAR_SIDE), sizeof *far);
	while (check_next(c))
		c->simd->warp_far(&p.target, far);
}

static void bench_full_blocks(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	warp_blocks(c, &p, 400, 64, 0.7, PLAIN);
}

static void bench_small_discs(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	disc_blocks(c, &p, 400, 40, 2, PLAIN);
}

static void bench_discs(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	disc_blocks(c, &p, 400, 40, 8, PLAIN);
}

static void bench_thirds(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	warp_blocks(c, &p, 1200, 21, 0.7, PLAIN);
}

static void bench_veils(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	veil_blocks(c, &p, make_entries(c, &p, 1200, 21, 0.7, PLAIN), 1200, 1);
}

static void bench_levels(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 1 << 1 | 1 << 2);
	warp_blocks(c, &p, 400, 64, 2, PLAIN);
}

static void bench_far(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	uint32_t *far = check_out(c, TILE_HEIGHT / FAR_SIDE * (TILE_WIDTH / FAR_SIDE), sizeof *far);
	check_units(c, TILE_WIDTH * TILE_HEIGHT);
	while (check_next(c))
		c->simd->warp_far(&p.target, far);
}

static void bench_cells(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 1 << 1);
	check_units(c, TILE_WIDTH * TILE_HEIGHT);
	while (check_next(c))
		c->simd->warp_cells(&p.target, 1);
}

static void bench_clear(struct check *c)
{
	struct picture p;
	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 1 << 1);
	check_units(c, TILE_WIDTH * TILE_HEIGHT);
	while (check_next(c))
		c->simd->warp_clear(&p.target, p.levels);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "warp: random blocks, tiles and levels", random_blocks, 1500, NULL },
		{ "warp: blocks of 1 to 64 samples", blocks_of_each_count, 512, NULL },
		{ "warp: infinite, huge, denormal and no numbers", spoilt_numbers, 1500, NULL },
		{ "warp: samples on the edges of pixels and tiles, and at near_z", edges, 500, NULL },
		{ "warp: tiles narrower than a vector", narrow_tiles, 500, NULL },
		{ "discs: random blocks and tiles", random_discs, 1500, NULL },
		{ "discs: tiles narrower than a vector", discs_in_narrow_tiles, 500, NULL },
		{ "veil: points and squares in random tiles", random_veils, 1500, NULL },
		{ "warp_clear: random tiles, clean parts and levels", random_clear, 400, NULL },
		{ "warp_cells: random tiles, bare parts and levels", random_cells, 400, NULL },
		{ "warp_far: random tiles", random_far, 400, NULL },
		{ "warp, full blocks", bench_full_blocks, 0, "sample" },
		{ "warp, blocks a third full", bench_thirds, 0, "sample" },
		{ "discs, 2 pixels between samples", bench_small_discs, 0, "sample" },
		{ "discs, 8 pixels between samples", bench_discs, 0, "sample" },
		{ "veil, points of blocks a third full", bench_veils, 0, "sample" },
		{ "warp, full blocks, depth levels 1 and 2", bench_levels, 0, "sample" },
		{ "warp_clear, a tile", bench_clear, 0, "pixel" },
		{ "warp_cells, a tile", bench_cells, 0, "pixel" },
		{ "warp_far, a tile", bench_far, 0, "pixel" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
