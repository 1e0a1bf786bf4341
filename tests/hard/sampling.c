/* Surfaces that are hard to sample: broken, thin and repeated faces, no normals, the least and widest textures, places
 * in them that do not move; and the code of normals everywhere. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/random.h"
#include "base/vec.h"
#include "lib/blocks.h"
#include "psr/build.h"
#include "tests/unit/sample/meshes.h"

#define RESOLUTION 64

static struct psr_model *built(const struct psr_mesh *mesh)
{
	struct psr_build_options options;
	struct psr_model *model = NULL;
	struct psr_error err = { .text = "" };

	psr_build_options_default(&options);
	options.resolution = RESOLUTION;
	options.n_threads = 1;
	if (psr_model_build(&model, mesh, &options, NULL, &err))
		fail_msg("%s", err.text);
	return model;
}

/* Appends faces to a mesh of one material. */
static void add_faces(struct psr_mesh *mesh, const uint32_t (*face)[3], uint32_t n)
{
	mesh->triangle = realloc(mesh->triangle, (mesh->n_triangles + n) * sizeof *mesh->triangle);
	mesh->triangle_material = realloc(mesh->triangle_material, (mesh->n_triangles + n) * sizeof(uint32_t));
	for (uint32_t i = 0; i < n; i++) {
		memcpy(mesh->triangle[mesh->n_triangles], face[i], sizeof face[i]);
		mesh->triangle_material[mesh->n_triangles++] = 0;
	}
}

/* The surface is what counts, not its faces: points, lines and copies add nothing to it. A box with them is the model
 * of the box, where the importer leaves them out, and has its places where the mesh comes with them. */
static void degenerate_and_repeated_faces_add_nothing(void **state)
{
	const uint32_t more[5][3] = { { 0, 0, 0 }, { 1, 1, 2 }, { 0, 2, 0 }, { 0, 1, 2 }, { 1, 2, 0 } };
	struct psr_mesh *mesh = meshes_box(0.5, 0), *clean[2];
	struct psr_error err;
	uint8_t id[2][16];

	(void)state;
	for (int turn = 0; turn < 2; turn++) {
		struct psr_model *model;

		if (turn)
			add_faces(mesh, more, 5);
		assert_int_equal(psr_mesh_create(&clean[turn], (const double(*)[3])mesh->position, mesh->n_vertices,
		                                 (const uint32_t(*)[3])mesh->triangle, mesh->n_triangles, &err), PSR_OK);
		assert_int_equal(clean[turn]->n_dropped_triangles, turn ? 5 : 0);
		model = built(clean[turn]);
		psr_model_content_id(model, id[turn]);
		psr_model_unref(model);
		psr_mesh_destroy(clean[turn]);
	}
	assert_memory_equal(id[0], id[1], 16);

	/* Unrepaired: the modeller's own door. Every sample is in the plane of a side of the box, within half a step of
	 * depth, at most a 4000th of a pixel, and rays in single precision. It stands for a place on the side, which is 1 /
	 * sqrt(3) steps of the lattice from it at most, and may lie so far beyond the side's edge. */
	struct psr_model *model = built(mesh);
	const struct psr_blocks *b = psr_model_blocks(model);
	const struct psr_model_info *info = psr_model_info(model);
	for (uint32_t block = 0; block < b->n_blocks; block++)
		for (uint64_t left = b->mask[block]; left; left &= left - 1) {
			const double off = info->scale * (2.0 / RESOLUTION * (1u << psr_blocks_level(b, block)) / 4000 + 0x1p-20);
			const double step = info->scale * 2.0 / RESOLUTION * (1u << psr_blocks_level(b, block));
			double at[3], side = 1, most = 0;

			hard_position(at, b, block, (uint32_t)__builtin_ctzll(left));
			for (int k = 0; k < 3; k++) {
				const double p = fabs(info->scale * at[k] + info->origin[k]);

				side = fmin(side, fabs(p - 0.5));
				most = fmax(most, p);
			}
			assert_true(side <= off && most <= 0.5 + 0.578 * step);
		}
	assert_true(info->n_missing <= info->n_trials / 10000);
	psr_model_unref(model);
	meshes_free(mesh);
}

/* Faces a million times as long as wide, across a square: below any pixel. They lie in the square's plane, or stand on
 * it by their own width. The square keeps its places. */
static void slivers_of_1e6_to_1_are_taken(void **state)
{
	(void)state;
	for (int upright = 0; upright < 2; upright++) {
		struct psr_mesh *mesh = meshes_square(4);
		const uint32_t n = 3 * 8, first = mesh->n_vertices;

		free(mesh->uv[0]);
		mesh->uv[0] = NULL;
		mesh->n_vertices += n;
		mesh->position = realloc(mesh->position, mesh->n_vertices * sizeof *mesh->position);
		mesh->normal = realloc(mesh->normal, mesh->n_vertices * sizeof *mesh->normal);
		for (uint32_t i = 0; i < 8; i++) {
			const double y = 0.2 * i - 0.7, wide = 2e-6;
			const double corner[3][3] = { { -1, y, 0 }, { 1, y, 0 }, { 0, y + !upright * wide, upright * wide } };
			const uint32_t face[1][3] = { { first + 3 * i, first + 3 * i + 1, first + 3 * i + 2 } };

			for (int c = 0; c < 3; c++) {
				memcpy(mesh->position[face[0][c]], corner[c], sizeof corner[c]);
				memset(mesh->normal[face[0][c]], 0, sizeof *mesh->normal);
			}
			add_faces(mesh, face, 1);
		}
		struct psr_model *model = built(mesh);
		const struct psr_blocks *b = psr_model_blocks(model);
		const struct psr_model_info *info = psr_model_info(model);
		for (uint32_t block = 0; block < b->n_blocks; block++)
			for (uint64_t left = b->mask[block]; left; left &= left - 1) {
				const double pixel = 2.0 / RESOLUTION * (1u << psr_blocks_level(b, block));
				double at[3];

				hard_position(at, b, block, (uint32_t)__builtin_ctzll(left));
				for (int k = 0; k < 3; k++)
					at[k] = info->scale * at[k] + info->origin[k];
				/* Widths of up to half a pixel are given to thin things (decision 0014). */
				assert_true(fabs(at[2]) <= info->scale * (pixel / 2 + 0x1p-20));
				assert_true(fabs(at[0]) <= 1 + info->scale * pixel && fabs(at[1]) <= 1 + info->scale * pixel);
			}
		assert_true(info->n_missing <= info->n_trials / 1000);
		psr_model_unref(model);
		meshes_free(mesh);
	}
}

/* A quad of two colours at one place: each sample has one of them, none has another; and every pixel of the square
 * shows one. */
static void coplanar_faces_have_the_color_of_one_of_them(void **state)
{
	struct psr_mesh *mesh = meshes_square(2);
	const uint32_t n = mesh->n_triangles;
	unsigned seen = 0;

	(void)state;
	add_faces(mesh, (const uint32_t(*)[3])mesh->triangle, 0);
	uint32_t (*copy)[3] = malloc(n * sizeof *copy);
	memcpy(copy, mesh->triangle, n * sizeof *copy);
	add_faces(mesh, (const uint32_t(*)[3])copy, n);
	free(copy);
	mesh->n_materials = 2;
	mesh->material = realloc(mesh->material, 2 * sizeof *mesh->material);
	for (int m = 0; m < 2; m++) {
		psr_material_default(&mesh->material[m]);
		mesh->material[m].unlit = 1;
		mesh->material[m].base_color[m] = 0; /* cyan, magenta */
	}
	for (uint32_t i = n; i < 2 * n; i++)
		mesh->triangle_material[i] = 1;
	struct psr_model *model = built(mesh);
	const struct psr_blocks *b = psr_model_blocks(model);
	for (uint64_t i = 0; i < b->n_samples; i++) {
		const uint32_t color = (uint32_t)(b->attr[i] >> 16 & 0xffffff);

		assert_true(color == 0xffff00 || color == 0xff00ff);
		seen |= color == 0xffff00 ? 1 : 2;
	}
	assert_true(seen != 0);
	assert_true(psr_model_info(model)->n_missing <= psr_model_info(model)->n_trials / 10000);
	psr_model_unref(model);
	meshes_free(mesh);
}

/* Without normals a face's own counts: a flat face's samples have its normal, coded. */
static void normals_of_0_are_those_of_the_face(void **state)
{
	struct psr_mesh *mesh = meshes_box(0.5, 0);
	struct psr_model *model;

	(void)state;
	memset(mesh->normal, 0, mesh->n_vertices * sizeof *mesh->normal);
	model = built(mesh);
	const struct psr_blocks *b = psr_model_blocks(model);
	const struct psr_model_info *info = psr_model_info(model);
	for (uint32_t block = 0; block < b->n_blocks; block++) {
		uint32_t k = psr_blocks_attr_first(b, block);

		for (uint64_t left = b->mask[block]; left; left &= left - 1, k++) {
			double at[3];
			unsigned n_sides = 0, is_one = 0;

			hard_position(at, b, block, (uint32_t)__builtin_ctzll(left));
			for (int a = 0; a < 3; a++) { /* at an edge two sides' normals are right */
				const double p = info->scale * at[a] + info->origin[a];
				float n[3] = { 0, 0, 0 };

				n[a] = p > 0 ? 1 : -1;
				if (fabs(fabs(p) - 0.5) > 0.001)
					continue;
				n_sides++;
				is_one |= psr_direction_encode(n) == PSR_ATTR_NORMAL(b->attr[k]);
			}
			assert_true(n_sides == 0 || is_one);
		}
	}
	psr_model_unref(model);
	meshes_free(mesh);
}

/* All texels have one colour: each sample has it, as its code survives linear light and means of equals (base/srgb.h:
 * codes round-trip). Of one texel, and of 16,384 a side; placed once over the square, 1e6 times, at one point, along a
 * line, and by coordinates that are no places. */
static void one_color_is_that_color_by_any_texture_and_place(void **state)
{
	static const uint32_t size[][2] = { { 1, 1 }, { 16384, 1 }, { 1, 16384 }, { 16384, 128 }, { 3, 5 } };
	static const float transform[][4] = { /* u and v by x, y of the square in 0..1: a factor each, and a shift each */
		{ 1, 1, 0, 0 }, { 1e6f, 1e6f, 0, 0 }, { 0, 0, 0.5f, 0.5f }, { 1, 0, 0, 0 }, { 1e30f, -1e30f, 0, 0 },
		{ 0, 0, 1e38f, -1e38f }, { 1e-38f, 1e-42f, 0, 0 },
	};
	const uint8_t texel[4] = { 200, 31, 7, 255 };

	(void)state;
	for (size_t s = 0; s < sizeof size / sizeof size[0]; s++)
		for (size_t t = 0; t < sizeof transform / sizeof transform[0]; t++) {
			struct psr_mesh *mesh = meshes_square(2);
			const size_t n = (size_t)size[s][0] * size[s][1];
			uint8_t *rgba = malloc(4 * n);

			for (size_t i = 0; i < n; i++)
				memcpy(rgba + 4 * i, texel, 4);
			meshes_texture(mesh, size[s][0], size[s][1], rgba);
			free(rgba);
			mesh->material->unlit = 1;
			mesh->material->base_texture.transform[0] = mesh->material->base_texture.transform[4] = 1;
			for (uint32_t i = 0; i < mesh->n_vertices; i++)
				for (int k = 0; k < 2; k++)
					mesh->uv[0][i][k] = mesh->uv[0][i][k] * transform[t][k] + transform[t][2 + k];
			struct psr_model *model = built(mesh);
			const struct psr_blocks *b = psr_model_blocks(model);
			for (uint64_t i = 0; i < b->n_samples; i++)
				if ((b->attr[i] >> 16 & 0xffffff) != (200 | 31 << 8 | 7 << 16))
					fail_msg("texture %ux%u, places %zu: colour %06x", size[s][0], size[s][1], t,
					         (unsigned)(b->attr[i] >> 16 & 0xffffff));
			psr_model_unref(model);
			meshes_free(mesh);
		}
}

/* A normal map over coordinates that do not move has no tangents; the face's normal is all that is left, or is turned
 * about by a finite one: every sample is within the map's tilt of the face's normal. The map says 60 degrees at most.
 * */
static void singular_places_of_a_normal_map_are_finite(void **state)
{
	const uint8_t texel[4] = { 128 + 110, 128, 128 + 63, 255 }; /* 60 degrees towards u */
	uint64_t seed = 3;

	(void)state;
	for (int kind = 0; kind < 4; kind++) {
		struct psr_mesh *mesh = meshes_square(3);
		struct psr_model *model;

		meshes_texture(mesh, 1, 1, texel);
		mesh->material->base_texture.image = -1;
		mesh->material->normal_texture = (struct psr_texture){ .image = 0, .transform = { 1, 0, 0, 0, 1, 0 } };
		mesh->material->normal_scale = 1;
		for (uint32_t i = 0; i < mesh->n_vertices; i++)
			for (int k = 0; k < 2; k++) {
				float *uv = &mesh->uv[0][i][k];

				*uv = kind == 0 ? 0.5f : kind == 1 ? mesh->uv[0][i][0] : kind == 2 ? *uv * 1e-42f
				      : (float)random_in(&seed, -1e30, 1e30);
			}
		model = built(mesh);
		const struct psr_blocks *b = psr_model_blocks(model);
		assert_true(b->n_samples > 0);
		for (uint64_t i = 0; i < b->n_samples; i++) {
			const float *n = psr_direction_table()[PSR_ATTR_NORMAL(b->attr[i])];

			/* 60.2 degrees by the map's codes, and 2 of the code of normals and its own mean. */
			assert_true(n[2] >= 0.46f);
		}
		psr_model_unref(model);
		meshes_free(mesh);
	}
}

/* The code of a normal is the triangle that holds it, of 32,768; its centre stands for it. The furthest point of a
 * spherical triangle from its centre is a corner, so the greatest such angle is the bound: over all triangles, 1.26
 * degrees. Next to a side a vector may get the triangle beside, for which 2^-20 has room. At the poles, the axes, all
 * eight triangles of a corner meet, and zeros of either sign count as positive; lengths do not matter, down to denormal
 * ones. */
static void a_normals_code_is_within_its_triangle(void **state)
{
	const float (*table)[3] = psr_direction_table();
	double bound = 0;
	uint64_t seed = 4;

	(void)state;
	for (unsigned i = 0; i < PSR_DIRECTIONS; i++) {
		double corner[3][3], center[3];

		psr_direction_corners(6, i, corner);
		psr_direction_center(6, i, center);
		for (int c = 0; c < 3; c++) {
			double d[3];

			v3d_sub(d, corner[c], center);
			bound = fmax(bound, 2 * asin(v3d_length(d) / 2));
		}
	}
	assert_true(bound < 1.27 * 3.14159265358979 / 180);
	for (uint32_t i = 0; i < HARD_CASES(1000000u); i++) {
		double v[3], n[3], d[3];
		float f[3];

		hard_direction(v, &seed);
		if (i % 4 == 1) { /* near a pole, and exactly at it in two axes */
			const int axis = (int)random_below(&seed, 3);
			for (int k = 0; k < 3; k++)
				v[k] = k == axis ? copysign(1, v[k]) : v[k] * exp2(random_in(&seed, -160, 0)) * random_below(&seed, 2);
		} else if (i % 4 == 2) { /* at a corner or the middle of a side */
			double corner[3][3];
			psr_direction_corners((int)random_below(&seed, 7), random_below(&seed, 8), corner);
			v3d_add_scaled(v, corner[0], random_below(&seed, 3) / 2.0, corner[1]);
		}
		const double scale = ldexp(1, (int)random_below(&seed, 200) - 100);
		for (int k = 0; k < 3; k++)
			f[k] = (float)(v[k] * scale);
		v3d_set(n, (double)f[0], (double)f[1], (double)f[2]);
		v3d_normalize(n, n);
		const float *code = table[psr_direction_encode(f)];
		v3d_sub(d, n, (const double[]){ (double)code[0], (double)code[1], (double)code[2] });
		if (2 * asin(v3d_length(d) / 2) > bound + 0x1p-20)
			fail_msg("%g,%g,%g is coded %g,%g,%g", n[0], n[1], n[2], (double)code[0], (double)code[1], (double)code[2]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(degenerate_and_repeated_faces_add_nothing),
		cmocka_unit_test(slivers_of_1e6_to_1_are_taken),
		cmocka_unit_test(coplanar_faces_have_the_color_of_one_of_them),
		cmocka_unit_test(normals_of_0_are_those_of_the_face),
		cmocka_unit_test(one_color_is_that_color_by_any_texture_and_place),
		cmocka_unit_test(singular_places_of_a_normal_map_are_finite),
		cmocka_unit_test(a_normals_code_is_within_its_triangle),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
