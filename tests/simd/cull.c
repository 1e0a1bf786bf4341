/* cull, cull_cones: batches of 1 to CULL_BATCH blocks or cubes, before the eye and behind it, within the picture and
 * outside of it. */
#include <math.h>
#include <string.h>
#include "tests/simd/lib/blocks.h"

static void random_view(struct check *c, struct cull_view *view, const struct psr_blocks *blocks, int is_spoilt)
{
	view->blocks = blocks;
	view->cubes = NULL;
	view->points = NULL;
	view->scale = check_plain_or_any(c, is_spoilt, 0, 1);
	view->spacing = check_plain_or_any(c, is_spoilt, 0, 0.01);
	view->perspective = (int)check_below(c, 2);
	view->focal = check_plain_or_any(c, is_spoilt, 1, 3000);
	view->near_z = fabsf(check_plain_or_any(c, is_spoilt, 0x1p-14, 0.1));
	for (int a = 0; a < 3; a++) {
		for (int k = 0; k < 4; k++)
			view->center_m[a][k] = check_plain_or_any(c, is_spoilt, -1, 1) * (is_spoilt || k == 3 ? 1 : view->scale);
		view->eye[a] = check_plain_or_any(c, is_spoilt, -3, 3);
	}
	view->width = (float)(1 + check_below(c, check_one_in(c, 2) ? PSR_MAX_SIDE : 700));
	view->height = (float)(1 + check_below(c, check_one_in(c, 2) ? PSR_MAX_SIDE : 700));
	view->center_x = check_plain_or_any(c, is_spoilt, 0, 700);
	view->center_y = check_plain_or_any(c, is_spoilt, 0, 700);
	view->with_cones = !check_one_in(c, 4);
	view->with_splats = check_one_in(c, 4);
	for (int a = 0; a < 2; a++) {
		view->region_from[a] = check_plain_or_any(c, is_spoilt, -700, 700);
		view->region_scale[a] = check_plain_or_any(c, is_spoilt, 0, 0.1);
	}
}

/* What is said of blocks that are not left, and what is left of the batch, has no meaning. */
static void settle(struct cull_batch *out, uint32_t n)
{
	for (uint32_t i = 0; i < CULL_BATCH; i++) {
		if (i < n && out->is_left[i])
			continue;
		if (i >= n)
			out->is_left[i] = 0;
		out->is_mixed[i] = out->level[i] = 0;
		out->x0[i] = out->x1[i] = out->y0[i] = out->y1[i] = out->range[i] = 0;
		out->tile_x0[i] = out->tile_x1[i] = out->tile_y0[i] = out->tile_y1[i] = 0;
		out->near[i] = out->apart[i] = out->depth_error[i] = 0;
	}
	check_settle(out->near, CULL_BATCH);
	check_settle(out->apart, CULL_BATCH);
	check_settle(out->depth_error, CULL_BATCH);
}

/* All of one level. */
static struct psr_cubes *random_cubes(struct check *c, uint32_t n, int is_spoilt)
{
	struct psr_cubes *cubes = check_in(c, 1, sizeof *cubes);
	struct psr_cube *cube = check_in(c, n, sizeof *cube);
	uint8_t *flags = check_in(c, n, 1);
	const uint32_t level = check_below(c, 2);
	struct octree *tree = check_in(c, 1, sizeof *tree);

	memset(cubes, 0, sizeof *cubes);
	memset(tree, 0, sizeof *tree);
	tree->levels = 2 + (int)check_below(c, 18);
	tree->edge = 2;
	for (int a = 0; a < 3; a++)
		tree->low[a] = (double)check_plain_or_any(c, is_spoilt, -1.1, -0.9);
	cubes->level[level] = (struct psr_cube_level){ .tree = tree, .n = n, .edge = ldexp(2, -tree->levels) };
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t most = 1u << (tree->levels - 2);
		const uint64_t place = check_below(c, most) | (uint64_t)check_below(c, most) << CUBES_PLACE_BITS
		                       | (uint64_t)check_below(c, most) << 2 * CUBES_PLACE_BITS
		                       | (uint64_t)level << 3 * CUBES_PLACE_BITS;

		cube[i].place[0] = (uint32_t)place;
		cube[i].place[1] = (uint32_t)(place >> 32);
		flags[i] = (uint8_t)(level + check_below(c, 3)) | (check_one_in(c, 4) ? PSR_BLOCK_TWO_SIDED : 0);
	}
	cubes->cube = cube;
	cubes->groups = (struct psr_blocks){
		.n_blocks = n, .flags = flags, .cone_x = check_in(c, n, 1), .cone_y = check_in(c, n, 1),
		.cone_z = check_in(c, n, 1), .cone_sine = check_in(c, n, 1),
	};
	return cubes;
}

/* cull_cones says nothing else. */
static void settle_sum(struct cull_sum *sum, int cones_alone)
{
	if (cones_alone || sum->left == 0)
		*sum = (struct cull_sum){ .left = sum->left, .mixed = sum->mixed };
	check_settle(&sum->near, 1);
	check_settle(&sum->apart, 1);
	check_settle(&sum->depth_error, 1);
}

static void cubes(struct check *c, uint32_t n_cubes, uint32_t n, int cones_alone, int is_spoilt)
{
	struct cull_view *view = check_in(c, 1, sizeof *view);
	struct cull_batch *out = check_out(c, 1, sizeof *out);
	struct psr_cubes *of = random_cubes(c, n_cubes, is_spoilt);

	random_view(c, view, &of->groups, is_spoilt);
	view->cubes = of;
	view->both_sides = check_one_in(c, 8);
	view->with_cones |= cones_alone;
	if (!cones_alone && check_one_in(c, 4))
		of->groups.cone_x = of->groups.cone_y = of->groups.cone_z = NULL, of->groups.cone_sine = NULL;
	const uint32_t first = check_below(c, n_cubes - n + 1);
	check_units(c, n);
	while (check_next(c)) {
		(cones_alone ? c->simd->cull_cones : c->simd->cull)(out, view, first, n);
		if (c->is_bench)
			continue;
		settle_sum(&out->sum, cones_alone);
		if (!cones_alone) {
			settle(out, n);
			continue;
		}
		for (uint32_t i = 0; i < CULL_BATCH; i++)
			out->is_left[i] &= -(i < n), out->is_mixed[i] &= -(i < n && out->is_left[i]);
	}
}

static void random_cubes_of(struct check *c, int is_spoilt)
{
	const uint32_t n = 1 + check_below(c, 2 * CULL_BATCH), most = n < CULL_BATCH ? n : CULL_BATCH;

	cubes(c, n, 1 + check_below(c, most), check_one_in(c, 2), is_spoilt);
}

static void many_cubes(struct check *c)
{
	random_cubes_of(c, 0);
}

static void spoilt_cubes(struct check *c)
{
	random_cubes_of(c, 1);
}

static void bench_cubes(struct check *c)
{
	cubes(c, CULL_BATCH, CULL_BATCH, 0, 0);
}

static void bench_cubes_cones(struct check *c)
{
	cubes(c, CULL_BATCH, CULL_BATCH, 1, 0);
}

static void batch(struct check *c, uint32_t n_blocks, uint32_t n, int has_cones, int is_spoilt)
{
	struct cull_view *view = check_in(c, 1, sizeof *view);
	struct cull_batch *out = check_out(c, 1, sizeof *out);
	struct psr_blocks blocks;

	check_blocks(c, &blocks, n_blocks, 1, 1);
	if (!has_cones)
		blocks.cone_x = blocks.cone_y = blocks.cone_z = NULL, blocks.cone_sine = blocks.traits = NULL;
	random_view(c, view, &blocks, is_spoilt);
	const uint32_t first = check_below(c, n_blocks - n + 1);
	check_units(c, n);
	while (check_next(c)) {
		c->simd->cull(out, view, first, n);
		if (!c->is_bench)
			settle(out, n);
	}
}

static void random_batch(struct check *c, int is_spoilt)
{
	const uint32_t n_blocks = 1 + check_below(c, 2 * CULL_BATCH), most = n_blocks < CULL_BATCH ? n_blocks : CULL_BATCH;
	batch(c, n_blocks, 1 + check_below(c, most), check_below(c, 4) != 0, is_spoilt);
}

static void random_blocks(struct check *c)
{
	random_batch(c, 0);
}

static void spoilt_numbers(struct check *c)
{
	random_batch(c, 1);
}

static void bench_cones(struct check *c)
{
	batch(c, CULL_BATCH, CULL_BATCH, 1, 0);
}

static void bench_frustum(struct check *c)
{
	batch(c, CULL_BATCH, CULL_BATCH, 0, 0);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "cull: random blocks and views", random_blocks, 3000, NULL },
		{ "cull: infinite, huge, denormal and no numbers", spoilt_numbers, 3000, NULL },
		{ "cull and cull_cones: random cubes and views", many_cubes, 3000, NULL },
		{ "cull and cull_cones: cubes, and infinite, huge, denormal and no numbers", spoilt_cubes, 3000, NULL },
		{ "cull, frustum", bench_frustum, 0, "block" },
		{ "cull, frustum and cones", bench_cones, 0, "block" },
		{ "cull, cubes", bench_cubes, 0, "cube" },
		{ "cull_cones", bench_cubes_cones, 0, "cube" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
