/* What the samples of thin things hang before a tile's pixels. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "simd/simd.h"

#define WIDTH 16
#define HEIGHT 12
#define STRIDE 20
#define X0 64
#define Y0 32
#define BITS 1000.0f
#define MOST_SAMPLES 40

/* A tile, and samples that each are a block of one and an instance of their own. */
struct tile {
	struct psr_blocks blocks;
	struct psr_run run;
	struct psr_projection projection;
	struct warp_lattice lattice[MOST_SAMPLES];
	struct warp_instance instance[MOST_SAMPLES];
	struct veil_entry entry[MOST_SAMPLES];
	uint32_t n;
	uint64_t attr[1], mask[1], word[STRIDE * HEIGHT];
	uint32_t veil[STRIDE * HEIGHT];
	uint16_t depth[1 + 64], attr_offset[1], sphere_r[1];
	int16_t sphere[1];
	uint8_t zero[1], opacity[1];
	float before[STRIDE * HEIGHT], bits[PSR_OPAQUE + 1];
};

static void begin(struct tile *t)
{
	memset(t, 0, sizeof *t);
	t->mask[0] = 1;
	t->opacity[0] = 7;
	t->bits[7] = BITS;
	t->projection = (struct psr_projection){ { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, 1 };
	t->blocks = (struct psr_blocks){
		.n_blocks = 1, .n_projections = 1, .n_samples = 1, .projection = &t->projection, .run = &t->run,
		.sphere_x = t->sphere, .sphere_y = t->sphere, .sphere_z = t->sphere, .sphere_r = t->sphere_r,
		.block_projection = t->zero, .flags = t->zero, .mask = t->mask, .attr_offset = t->attr_offset,
		.depth = t->depth, .attr = t->attr, .opacity = t->opacity,
	};
	for (int i = 0; i < STRIDE * HEIGHT; i++) {
		t->word[i] = PSR_WORD_EMPTY;
		t->before[i] = INFINITY;
	}
}

/* At (x, y) from the tile's corner, so that a lattice of steps of 0 has all of its samples there. */
static void add(struct tile *t, float x, float y, float z, int side)
{
	struct warp_lattice *lattice = &t->lattice[t->n];

	*lattice = (struct warp_lattice){ .origin = { (double)(x + X0), (double)(y + Y0), (double)z } };
	psr_placing_make(&lattice->placing, &t->projection);
	t->instance[t->n] = (struct warp_instance){ .blocks = &t->blocks, .lattice = lattice, .first_slot = t->n };
	t->entry[t->n] = (struct veil_entry){ .slot = t->n, .instance = (uint16_t)t->n, .side = (uint16_t)side, .area = 1 };
	t->n++;
}

static void draw(struct tile *t, const struct simd *simd)
{
	const struct warp_target target = {
		.instance = t->instance, .near_z = 0x1p-14f, .stride = STRIDE,
		.x0 = X0, .y0 = Y0, .x1 = X0 + WIDTH, .y1 = Y0 + HEIGHT,
	};
	const struct veil_layer layer = { t->before, t->word, t->veil, t->bits };

	simd->veil(&target, &layer, t->entry, t->n);
}

/* All pixels of x0 .. x1 - 1 and y0 .. y1 - 1 have one veil, and no others have any. */
static void assert_square(const struct tile *t, int x0, int y0, int x1, int y1)
{
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < STRIDE; x++) {
			const int is_in = x >= x0 && x < x1 && y >= y0 && y < y1;

			assert_int_equal(t->veil[y * STRIDE + x], is_in ? (uint32_t)BITS : 0);
			assert_int_equal(t->word[y * STRIDE + x] != PSR_WORD_EMPTY, is_in);
		}
}

/* Of all squares of pixels, the one whose middle is nearest to the sample. */
static void a_square_is_about_its_sample(void **state)
{
	static struct tile t;

	(void)state;
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		const struct simd *simd = simd_of((enum psr_isa)isa);

		for (int side = 1; side <= 5 && simd != NULL; side++)
			for (int step = 0; step < 8; step++) {
				const float x = 6 + (float)step / 8, y = 5 + (float)(step * 3 % 8) / 8;
				const int left = (int)lround((double)x - side * 0.5 + 0x1p-10);
				const int top = (int)lround((double)y - side * 0.5 + 0x1p-10);

				begin(&t);
				add(&t, x, y, 2, side);
				draw(&t, simd);
				assert_square(&t, left, top, left + side, top + side);
			}
	}
}

static void a_square_ends_at_the_tile(void **state)
{
	static const struct {
		float x, y;
		int x0, y0, x1, y1;
	} corner[] = {
		{ -1.5f, -1.5f, 0, 0, 1, 1 },
		{ WIDTH + 1.5f, HEIGHT + 1.5f, WIDTH - 1, HEIGHT - 1, WIDTH, HEIGHT },
		{ WIDTH + 1.5f, 4.5f, WIDTH - 1, 2, WIDTH, 7 },
		{ -2.5f, 4.5f, 0, 0, 0, 0 },
		{ 4.5f, HEIGHT + 2.5f, 0, 0, 0, 0 },
	};
	static struct tile t;

	(void)state;
	for (int isa = 0; isa < PSR_N_ISAS; isa++)
		for (size_t i = 0; i < sizeof corner / sizeof corner[0] && simd_of((enum psr_isa)isa) != NULL; i++) {
			begin(&t);
			add(&t, corner[i].x, corner[i].y, 2, 5);
			draw(&t, simd_of((enum psr_isa)isa));
			assert_square(&t, corner[i].x0, corner[i].y0, corner[i].x1, corner[i].y1);
		}
}

static void veils_add_up_in_any_order_and_the_nearest_shows(void **state)
{
	static struct tile t;

	(void)state;
	for (int turn = 0; turn < 2; turn++) {
		begin(&t);
		add(&t, 4.5f, 4.5f, turn ? 2 : 3, 3);
		add(&t, 4.5f, 4.5f, turn ? 3 : 2, 1);
		draw(&t, simd_get());
		assert_int_equal(t.veil[4 * STRIDE + 4], 2 * (uint32_t)BITS);
		assert_int_equal(t.veil[4 * STRIDE + 5], (uint32_t)BITS);
		assert_int_equal((uint32_t)t.word[4 * STRIDE + 4], turn ? 0 : PSR_BLOCK_SAMPLES);
	}
}

static void nothing_hangs_behind_an_opaque_surface(void **state)
{
	static struct tile t;

	(void)state;
	begin(&t);
	t.before[4 * STRIDE + 4] = 2; /* as near as the sample */
	for (int i = 0; i < STRIDE * HEIGHT; i += STRIDE)
		t.before[i + 5] = 1;
	add(&t, 4.5f, 4.5f, 2, 3);
	draw(&t, simd_get());
	for (int y = 3; y < 6; y++) {
		assert_int_equal(t.veil[y * STRIDE + 3], (uint32_t)BITS);
		assert_int_equal(t.veil[y * STRIDE + 4], y == 4 ? 0 : (uint32_t)BITS);
		assert_int_equal(t.veil[y * STRIDE + 5], 0);
		assert_true(t.word[y * STRIDE + 5] == PSR_WORD_EMPTY);
	}
}

static void a_veil_has_a_greatest(void **state)
{
	static struct tile t;

	(void)state;
	begin(&t);
	t.bits[7] = 0x1p20f; /* 40 of them are more than VEIL_MOST, and 1 is less */
	for (int i = 0; i < MOST_SAMPLES; i++)
		add(&t, 4.5f, 4.5f, 2, 2);
	draw(&t, simd_get());
	assert_int_equal(t.veil[4 * STRIDE + 4], VEIL_MOST);
	assert_int_equal(t.veil[5 * STRIDE + 5], VEIL_MOST);
	assert_int_equal(t.veil[6 * STRIDE + 6], 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_square_is_about_its_sample),
		cmocka_unit_test(a_square_ends_at_the_tile),
		cmocka_unit_test(veils_add_up_in_any_order_and_the_nearest_shows),
		cmocka_unit_test(nothing_hangs_behind_an_opaque_surface),
		cmocka_unit_test(a_veil_has_a_greatest),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
