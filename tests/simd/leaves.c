/* warp_leaves, and as EWA splats ewa_words and ewa_sums: cubes of 1 to 64 leaves at several levels, with and without
 * normals and offsets, in tiles of pictures of all sizes. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "tests/simd/lib/picture.h"

#define MAX_LEVELS 3
#define UNEVEN 17 /* leaves of a cube in the mean: of benchmarks whose cubes have any number, and may face away */

enum numbers { PLAIN, SPOILT };
enum kernel { LEAVES, RUNS, WORDS, SUMS };

static uint8_t random_code(struct check *c, int is_few)
{
	return is_few && !check_one_in(c, 8) ? (uint8_t)(1u << check_below(c, 8)) : (uint8_t)(1 + check_below(c, 255));
}

/* A tree of which the codes of n cubes are there alone: each cube's, then its children's. n_leaves of each; 0 and
 * UNEVEN: any. */
static void random_tree(struct check *c, struct octree *tree, struct psr_cube_run *run, struct psr_cube *cube,
                        const uint32_t n[2])
{
	const int is_any = n[1] == 0 || n[1] == UNEVEN;
	const int is_few = n[1] == 0 && check_one_in(c, 3); /* sparse: most nodes have one child */
	uint8_t some[64 * 9];
	uint32_t n_codes = 0, n_leaves = 0;

	for (uint32_t i = 0; i < n[0]; i++) {
		const uint32_t at = n_codes;

		if (i % CUBES_RUN == 0)
			run[i / CUBES_RUN] = (struct psr_cube_run){ n_codes, n_leaves };
		cube[i].code = (uint16_t)(n_codes - run[i / CUBES_RUN].code);
		cube[i].leaf = (uint16_t)(n_leaves - run[i / CUBES_RUN].leaf);
		some[at] = is_any ? random_code(c, is_few) : n[1] == 64 ? 255 : n[1] == 2 ? 0x41 : 0x69;
		n_codes++;
		for (int j = 0; j < __builtin_popcount(some[at]); j++) {
			some[n_codes] = is_any ? random_code(c, is_few) : n[1] == 64 ? 255 : n[1] == 2 ? 0x10 : 0x4d;
			n_leaves += (uint32_t)__builtin_popcount(some[n_codes++]);
		}
	}
	uint8_t *codes = check_in(c, n_codes, 1);
	memcpy(codes, some, n_codes);
	*tree = (struct octree){ .levels = 4 + (int)check_below(c, 17), .low = { -1, -1, -1 }, .edge = 2, .code = codes,
		                     .n_codes = n_codes, .n_leaves = n_leaves };
	if (check_one_in(c, 2))
		tree->color = check_in(c, n_leaves, sizeof *tree->color);
	if (check_one_in(c, 4) && n[1] != UNEVEN)
		return;
	tree->normal = check_in(c, n_leaves, sizeof *tree->normal);
	for (uint32_t i = 0; i < n_leaves; i++)
		tree->normal[i] &= 0x7fff;
	if (check_one_in(c, 4))
		return;
	tree->offset = check_in(c, n_leaves, 1);
	for (uint32_t i = 0; i < n_leaves; i++)
		tree->offset[i] %= OCTREE_OFFSETS;
}

/* n_cubes of each level, 64 at most; n_leaves of each, 64, 16, 2, UNEVEN, or 0 for any. */
static struct psr_cubes *random_cubes(struct check *c, uint32_t n_cubes, uint32_t n_leaves, struct octree *tree)
{
	struct psr_cubes *cubes = check_in(c, 1, sizeof *cubes);
	const uint32_t n_levels = n_leaves > 0 ? 1 : 1 + check_below(c, MAX_LEVELS), n = n_levels * n_cubes;
	struct psr_cube *cube = check_in(c, n, sizeof *cube);
	uint8_t *flags = check_in(c, n, 1);

	memset(cubes, 0, sizeof *cubes);
	for (uint32_t l = 0; l < n_levels; l++) {
		struct psr_cube_run *run = check_in(c, 1, sizeof *run);
		struct psr_cube_level *level = &cubes->level[l];

		random_tree(c, &tree[l], run, cube + l * n_cubes, (const uint32_t[2]){ n_cubes, n_leaves });
		*level = (struct psr_cube_level){ &tree[l], l * n_cubes, n_cubes, ldexp(2, -tree[l].levels), run, NULL };
		for (uint32_t i = l * n_cubes; i < (l + 1) * n_cubes; i++) {
			const uint32_t most = 1u << (tree[l].levels - 2);

			const uint64_t place = check_below(c, most) | (uint64_t)check_below(c, most) << CUBES_PLACE_BITS
			                       | (uint64_t)check_below(c, most) << 2 * CUBES_PLACE_BITS
			                       | (uint64_t)l << 3 * CUBES_PLACE_BITS;

			cube[i].place[0] = (uint32_t)place;
			cube[i].place[1] = (uint32_t)(place >> 32);
			flags[i] = (uint8_t)(l | (tree[l].normal == NULL || check_one_in(c, 2) ? PSR_BLOCK_TWO_SIDED : 0));
		}
	}
	cubes->groups = (struct psr_blocks){ .n_blocks = n, .n_levels = n_levels, .flags = flags };
	cubes->cube = cube;
	return cubes;
}

static double plain_or_spoilt(struct check *c, enum numbers numbers, double low, double high)
{
	return numbers == SPOILT && check_one_in(c, 6) ? (double)check_float(c) * (check_one_in(c, 8) ? 0x1p1000 : 1)
	                                               : check_real(c, low, high);
}

/* The model's cube is about as large as the tile, and before the eye or on both sides of it. */
static void random_placing(struct check *c, struct warp_cubes *to, const struct psr_cubes *cubes,
                           const struct warp_target *t, enum numbers numbers)
{
	const double z = check_real(c, check_one_in(c, 4) ? -0.1 : 0.3, 1), scale = t->perspective ? z : 1;
	const double reach = (t->x1 - t->x0 + t->y1 - t->y0) * 0.3 + 4;

	to->model = cubes;
	to->origin[0] = scale * plain_or_spoilt(c, numbers, t->x0, t->x1);
	to->origin[1] = scale * plain_or_spoilt(c, numbers, t->y0, t->y1);
	to->origin[2] = plain_or_spoilt(c, numbers, z, z + 0.01);
	for (int a = 0; a < 3; a++)
		for (int k = 0; k < 3; k++)
			to->axis[a][k] = a < 2 ? plain_or_spoilt(c, numbers, -reach, reach) : plain_or_spoilt(c, numbers, -0.2, 0.2);
	for (uint32_t l = 0; l < cubes->groups.n_levels; l++)
		for (int a = 0; a < 3; a++) {
			struct warp_octants *octants = &to->level[l];
			const double edge = cubes->level[l].edge * (a < 2 ? reach : 0.1);

			for (int i = 0; i < 8; i++) {
				octants->row[a][i] = plain_or_spoilt(c, numbers, -edge, edge);
				octants->col[a][i] = (float)plain_or_spoilt(c, numbers, -edge / 2, edge / 2);
			}
			for (int k = 0; k < 3; k++)
				octants->along[a][k] = (float)(plain_or_spoilt(c, numbers, -edge, edge) / 1000);
		}
}

/* The axes of a picture as plan_warp.c has them for splats, and sums of a tile. */
static void splats(struct check *c, struct picture *p, struct warp_instance *in, struct warp_cubes *to)
{
	struct warp_target *t = &p->target;

	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			const double *a = to->axis[i], *b = to->axis[k];

			in->turn[i][k] = (float)check_real(c, -1, 1);
			to->ewa.axis[i][k] = (float)a[k];
			to->ewa.square[i][k] = (float)(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
			to->ewa.dual[i][k] = (float)check_real(c, -1, 1);
		}
	to->ewa.depth = (float)check_real(c, 0.01, 0.2);
	t->sum_stride = (uint32_t)(t->x1 - t->x0) + check_below(c, 3);
	const size_t n = (size_t)t->sum_stride * (size_t)(t->y1 - t->y0);
	t->sum = check_out(c, n, sizeof *t->sum);
	memset(t->sum, 0, n * sizeof *t->sum);
}

/* Entries of random cubes become entries of their runs, which end with their level; for benchmarks whole ones. */
static const uint64_t *random_runs(struct check *c, const struct psr_cubes *cubes, uint32_t first_slot,
                                   struct bin_entry *entry, uint32_t n_entries, int are_whole)
{
	uint64_t *mask = check_in(c, n_entries, sizeof *mask);

	for (uint32_t e = 0; e < n_entries; e++) {
		const struct psr_cube_level *level = psr_cubes_level(cubes, entry[e].slot - first_slot);

		if (are_whole || check_one_in(c, 2)) /* chunks of a cull may begin within a run */
			entry[e].slot = first_slot + level->first;
		const uint64_t all = UINT64_MAX >> (CUBES_RUN - (level->first + level->n - (entry[e].slot - first_slot)));
		const uint64_t some = are_whole || check_one_in(c, 4) ? all : check_u64(c) & check_u64(c) & all;

		entry[e].hit = n_entries - 1 - e;
		mask[entry[e].hit] = some ? some : 1;
	}
	return mask;
}

static warp_fn *kernel_of(const struct simd *simd, enum kernel kernel)
{
	return kernel == WORDS ? simd->ewa_words : kernel == SUMS ? simd->ewa_sums : simd->warp_leaves;
}

static void draw_cubes(struct check *c, struct picture *p, enum kernel kernel, uint32_t n_entries, uint32_t n_leaves,
                       enum numbers numbers)
{
	struct warp_target *t = &p->target;
	struct octree tree[MAX_LEVELS];
	struct psr_cubes *cubes = random_cubes(c, n_leaves > 0 ? 64 : 1 + check_below(c, kernel == RUNS ? 64 : 20), n_leaves,
	                                       tree);
	struct warp_instance *in = check_in(c, 1, sizeof *in);
	struct warp_cubes *to = check_in(c, 1, sizeof *to);
	struct bin_entry *entry = check_in(c, n_entries, sizeof *entry);

	t->instance = in;
	t->perspective = check_one_in(c, 4) ? 0 : 1;
	t->near_z = 0x1p-14f;
	random_placing(c, to, cubes, t, numbers);
	in->blocks = &cubes->groups;
	in->cubes = to;
	in->first_slot = check_below(c, (1u << 26) - 1 - cubes->groups.n_blocks);
	picture_sight(c, in, t, numbers == SPOILT);
	t->cubes = NULL;
	if (kernel == WORDS || kernel == SUMS)
		splats(c, p, in, to);
	for (uint32_t e = 0; e < n_entries; e++) {
		const uint32_t cube = check_below(c, cubes->groups.n_blocks);
		int level = (int)check_below(c, PSR_MAX_DEPTH_LEVEL + 1);

		while (level && !(p->levels >> level & 1))
			level--;
		entry[e] = (struct bin_entry){ .slot = in->first_slot + cube, .level = (uint8_t)level,
			                           .is_wide = (uint8_t)(n_leaves == 0 ? check_below(c, 2) : p->levels != 0) };
		entry[e].is_mixed = n_leaves == UNEVEN || (n_leaves == 0 && !(cubes->groups.flags[cube] & PSR_BLOCK_TWO_SIDED));
	}
	if (kernel == RUNS)
		t->cubes = random_runs(c, cubes, in->first_slot, entry, n_entries, n_leaves > 0);
	check_units(c, n_entries * (kernel == RUNS ? tree[0].n_leaves : n_leaves));
	while (check_next(c))
		check_result(c, kernel_of(c->simd, kernel)(t, entry, n_entries));
}

static void leaves(struct check *c, struct picture *p, uint32_t n_entries, uint32_t n_leaves, enum numbers numbers)
{
	draw_cubes(c, p, LEAVES, n_entries, n_leaves, numbers);
}

static void random_leaves(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	leaves(c, &p, check_below(c, 40), 0, PLAIN);
}

static void random_masks(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	draw_cubes(c, &p, RUNS, check_below(c, 8), 0, PLAIN);
}

static void spoilt_masks(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	draw_cubes(c, &p, RUNS, 1 + check_below(c, 3), 0, SPOILT);
}

static void spoilt_numbers(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	leaves(c, &p, 1 + check_below(c, 12), 0, SPOILT);
}

static void narrow_tiles(struct check *c)
{
	struct picture p;
	const uint32_t w = check_one_in(c, 2) ? 1 + check_below(c, 17) : TILE_WIDTH + 1 + check_below(c, 17);

	picture_make(c, &p, w, check_one_in(c, 2) ? 1 : TILE_HEIGHT + 1, check_u32(c));
	leaves(c, &p, 1 + check_below(c, 12), 0, PLAIN);
}

static void random_splat_words(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	draw_cubes(c, &p, WORDS, check_below(c, 20), 0, PLAIN);
}

static void random_splat_sums(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	draw_cubes(c, &p, SUMS, check_below(c, 20), 0, PLAIN);
}

static void spoilt_splats(struct check *c)
{
	struct picture p;

	picture_random(c, &p);
	draw_cubes(c, &p, check_one_in(c, 2) ? WORDS : SUMS, 1 + check_below(c, 4), 0, SPOILT);
}

static void bench_splat_words(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	draw_cubes(c, &p, WORDS, 400, 16, PLAIN);
}

static void bench_splat_sums(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	draw_cubes(c, &p, SUMS, 400, 16, PLAIN);
}

static void bench_full(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	leaves(c, &p, 400, 64, PLAIN);
}

static void bench_fourths(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	leaves(c, &p, 1600, 16, PLAIN);
}

static void bench_offsets(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 1 << 1);
	leaves(c, &p, 1600, 16, PLAIN);
}

static void bench_runs(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	draw_cubes(c, &p, RUNS, 25, 16, PLAIN);
}

static void bench_sparse_runs(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	draw_cubes(c, &p, RUNS, 200, 2, PLAIN);
}

static void bench_uneven_runs(struct check *c)
{
	struct picture p;

	picture_make(c, &p, TILE_WIDTH, TILE_HEIGHT, 0);
	draw_cubes(c, &p, RUNS, 25, UNEVEN, PLAIN);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "warp_leaves: random cubes, tiles and levels", random_leaves, 2000, NULL },
		{ "warp_leaves: infinite, huge, denormal and no numbers", spoilt_numbers, 2000, NULL },
		{ "warp_leaves: tiles narrower than a vector", narrow_tiles, 500, NULL },
		{ "warp_leaves: any cubes of runs", random_masks, 1000, NULL },
		{ "warp_leaves: any cubes of runs, infinite, huge, denormal and no numbers", spoilt_masks, 1000, NULL },
		{ "ewa_words: random cubes and tiles", random_splat_words, 12, NULL },
		{ "ewa_sums: random cubes and tiles", random_splat_sums, 12, NULL },
		{ "ewa_words and ewa_sums: infinite, huge, denormal and no numbers", spoilt_splats, 60, NULL },
		{ "ewa_words, cubes a fourth full", bench_splat_words, 0, "leaf" },
		{ "ewa_sums, these", bench_splat_sums, 0, "leaf" },
		{ "warp_leaves, full cubes", bench_full, 0, "leaf" },
		{ "warp_leaves, cubes a fourth full", bench_fourths, 0, "leaf" },
		{ "warp_leaves, these with offsets and depth level 1", bench_offsets, 0, "leaf" },
		{ "warp_leaves, cubes a fourth full in runs", bench_runs, 0, "leaf" },
		{ "warp_leaves, cubes of two leaves in runs", bench_sparse_runs, 0, "leaf" },
		{ "warp_leaves, uneven cubes in runs that may face away", bench_uneven_runs, 0, "leaf" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
