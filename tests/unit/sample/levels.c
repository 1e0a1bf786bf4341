#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "base/srgb.h"
#include "base/direction.h"
#include "model.h"

#define RESOLUTION 256 /* levels of 256, 128 and 64 */
#define N_LEVELS 3

static const double zero[3];

static double pixel(unsigned level)
{
	return 2.0 / RESOLUTION * (1u << level);
}

/* A square of half side sqrt(1/2), which the unit sphere just holds. */
static struct psr_mesh *square(void)
{
	struct psr_mesh *mesh = meshes_square(1);

	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		v3d_scale(mesh->position[i], mesh->position[i], sqrt(0.5));
	return mesh;
}

/* And some more: what is added where projections and groups meet falls to a half, not to a quarter. It is a tenth at
 * most: x = 0.1 gives (0.9 + 0.2) / (0.9 + 0.1) of a quarter, and twice that share at the next level 0.29. */
static void each_level_has_a_quarter_of_the_samples(void **state)
{
	struct model_built built;
	double n[N_LEVELS] = { 0 };

	(void)state;
	model_open(&built, meshes_sphere(60, zero, 1), RESOLUTION, N_LEVELS);
	for (uint64_t i = 0; i < built.blocks->n_samples; i++)
		n[built.sample[i].level]++;
	for (int level = 1; level < N_LEVELS; level++) {
		printf("# level %d: %.3f of the finer one\n", level, n[level] / n[level - 1]);
		assert_true(n[level] / n[level - 1] > 0.24 && n[level] / n[level - 1] < 0.30);
	}
	model_close(&built, meshes_free);
}

/* Squares of a pixel of level 0. Level 2 has pixels of 16 of them, and its samples blend what is around them within
 * one, 50 squares with falling weights. Codes of half light are off by up to 0.5 / 255 of the curve's slope there,
 * 0.0022 each. */
static void a_checkerboard_becomes_its_linear_mean(void **state)
{
	static uint8_t texel[181][181][4];
	struct psr_mesh *mesh = square();
	double sum[N_LEVELS] = { 0 }, most[N_LEVELS] = { 0 };
	int n[N_LEVELS] = { 0 };
	struct model_built built;

	(void)state;
	for (int y = 0; y < 181; y++)
		for (int x = 0; x < 181; x++)
			memcpy(texel[y][x], (x + y) % 2 == 0 ? "\0\0\0\377" : "\377\377\377\377", 4);
	meshes_texture(mesh, 181, 181, &texel[0][0][0]);
	mesh->material->base_texture.is_nearest = 1;
	model_open(&built, mesh, RESOLUTION, N_LEVELS);
	for (uint64_t i = 0; i < built.blocks->n_samples; i++) {
		const struct model_sample *s = &built.sample[i];
		double value = (double)psr_srgb_to_linear[PSR_ATTR_BASE(s->attr) & 255];

		if (fabsf(s->p[0]) > 0.65f || fabsf(s->p[1]) > 0.65f)
			continue;
		sum[s->level] += value;
		most[s->level] = fmax(most[s->level], fabs(value - 0.5));
		n[s->level]++;
	}
	for (int level = 0; level < N_LEVELS; level++) {
		printf("# level %d: mean %.4f, at most %.3f away from a half\n", level, sum[level] / n[level], most[level]);
		assert_true(fabs(sum[level] / n[level] - 0.5) < 0.005);
	}
	/* A pixel's own circle holds one square and some of the next. */
	assert_true(most[0] > 0.15 && most[0] < 0.4);
	assert_true(most[2] < 0.05);
	model_close(&built, meshes_free);
}

/* The middle of the square is cut out. What is in it can only have been moved there, by half a pixel; and around it
 * samples reach as far as anywhere (0.96 pixels: dice.c). */
static void cut_outs_are_cut_out_of_all_levels(void **state)
{
	const double half = sqrt(0.5) / 2;
	uint8_t texel[8][8][4];
	struct psr_mesh *mesh = square();
	struct model_built built;

	(void)state;
	for (int y = 0; y < 8; y++)
		for (int x = 0; x < 8; x++)
			memcpy(texel[y][x], x >= 2 && x < 6 && y >= 2 && y < 6 ? "\377\377\377\0" : "\377\377\377\377", 4);
	meshes_texture(mesh, 8, 8, &texel[0][0][0]);
	mesh->material->base_texture.is_nearest = 1;
	mesh->material->alpha = PSR_ALPHA_MASK;
	mesh->material->alpha_cutoff = 0.5f;
	mesh->material->two_sided = 1;
	model_open(&built, mesh, RESOLUTION, N_LEVELS);
	for (uint64_t i = 0; i < built.blocks->n_samples; i++) {
		const struct model_sample *s = &built.sample[i];
		double inside = half - 0.6 * pixel(s->level);

		assert_false(fabs((double)s->p[0]) < inside && fabs((double)s->p[1]) < inside);
	}
	for (unsigned level = 0; level < N_LEVELS; level++) {
		struct kept map;

		model_map(&map, built.sample, built.blocks->n_samples, level, pixel(level));
		for (int i = -100; i <= 100; i++) {
			for (int edge = 0; edge < 4; edge++) {
				float at = (float)(i * half / 100), out = (float)(half + 0.001) * (edge < 2 ? 1 : -1);
				float p[3] = { edge & 1 ? at : out, edge & 1 ? out : at, 0 };

				assert_true((double)model_nearest(&map, p, UINT32_MAX) < 0.97 * pixel(level));
			}
		}
		kept_fini(&map);
	}
	model_close(&built, meshes_free);
}

static void sheets_have_two_sides_at_all_levels(void **state)
{
	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = square();
		struct model_built built;
		int n[N_LEVELS] = { 0 }, n_backs = 0;

		mesh->material->two_sided = two_sided;
		model_open(&built, mesh, RESOLUTION, N_LEVELS);
		for (uint64_t i = 0; i < built.blocks->n_samples; i++) {
			const struct model_sample *s = &built.sample[i];

			assert_int_equal(s->two_sided, two_sided);
			n_backs += psr_direction_table()[PSR_ATTR_NORMAL(s->attr)][2] < 0;
			n[s->level]++;
		}
		/* A view of the back that misses something adds a sample there. */
		printf("# %d of %d samples on the back; %d %d %d\n", n_backs, n[0] + n[1] + n[2], n[0], n[1], n[2]);
		assert_true(100 * n_backs <= two_sided * (n[0] + n[1] + n[2]));
		/* Once, not once a side: a pixel's lattice has at most 1 / (0.866 cos^2 25) = 1.41 points, and its border
		 * more. */
		for (unsigned level = 0; level < N_LEVELS; level++)
			assert_true(n[level] * pixel(level) * pixel(level) < 1.6 * 2 + 4 * sqrt(2) * 4 * pixel(level));
		model_close(&built, meshes_free);
	}
}

/* Wires of a fifth of a pixel, which are a twentieth of one at level 2. As in dice.c: 0.75 pixels. */
static void wires_have_no_gaps_at_any_level(void **state)
{
	const uint32_t n = 20;
	struct psr_mesh *mesh = meshes_new(4 * n, 2 * n);
	double along[20][3], frame[3][3], direction[3];
	const struct psr_model_info *info;
	struct model_built built;
	uint64_t seed = 3;

	(void)state;
	for (uint32_t i = 0; i < n; i++) {
		do
			for (int k = 0; k < 3; k++)
				direction[k] = 2 * meshes_random(&seed) - 1;
		while (v3d_dot(direction, direction) > 1 || v3d_normalize(direction, direction) < 0.1);
		psr_direction_basis(direction, frame);
		v3d_scale(along[i], frame[0], 1);
		for (uint32_t c = 0; c < 4; c++) {
			v3d_scale(mesh->position[4 * i + c], along[i], c == 1 || c == 2 ? 1 : 0.2);
			v3d_add_scaled(mesh->position[4 * i + c], mesh->position[4 * i + c], (c >= 2 ? 0.1 : -0.1) * pixel(0),
			               frame[1]);
		}
		for (uint32_t t = 0; t < 2; t++) {
			mesh->triangle[2 * i + t][0] = 4 * i;
			mesh->triangle[2 * i + t][1] = 4 * i + 1 + t;
			mesh->triangle[2 * i + t][2] = 4 * i + 2 + t;
		}
	}
	mesh->material->two_sided = 1;
	model_open(&built, mesh, RESOLUTION, N_LEVELS);
	info = psr_model_info(built.model);
	for (unsigned level = 0; level < N_LEVELS; level++) {
		struct kept map;

		model_map(&map, built.sample, built.blocks->n_samples, level, pixel(level));
		for (uint32_t i = 0; i < n; i++) {
			for (int step = 20; step <= 100; step++) {
				float p[3];

				for (int k = 0; k < 3; k++)
					p[k] = (float)((step / 100.0 * along[i][k] - info->origin[k]) / info->scale);
				assert_true((double)model_nearest(&map, p, UINT32_MAX) < 0.75 * pixel(level));
			}
		}
		kept_fini(&map);
	}
	model_close(&built, meshes_free);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_level_has_a_quarter_of_the_samples),
		cmocka_unit_test(a_checkerboard_becomes_its_linear_mean),
		cmocka_unit_test(cut_outs_are_cut_out_of_all_levels),
		cmocka_unit_test(sheets_have_two_sides_at_all_levels),
		cmocka_unit_test(wires_have_no_gaps_at_any_level),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
