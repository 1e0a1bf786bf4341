#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "base/vec.h"
#include "model/blocks.h"
#include "psr/build.h"
#include "base/direction.h"
#include "ray/ray.h"
#include "meshes.h"

static const double zero[3];

static struct psr_model *build(const struct psr_mesh *mesh, uint32_t resolution, int n_threads)
{
	struct psr_build_options options;
	struct psr_model *model = NULL;
	struct psr_error err = { .text = "" };

	psr_build_options_default(&options);
	options.resolution = resolution;
	options.n_threads = n_threads;
	if (psr_model_build(&model, mesh, &options, NULL, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return model;
}

/* A sphere with dents, so that it is not convex. */
static struct psr_mesh *dented_sphere(void)
{
	struct psr_mesh *mesh = meshes_sphere(80, zero, 1);

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		double *p = mesh->position[i], x = p[0] - 0.6, y = p[1] - 0.6, r = 1 - 0.2 * exp(-8 * (x * x + y * y));

		v3d_scale(p, p, r + 0.02 * p[0] * p[1]);
		v3f_set(mesh->normal[i], 0, 0, 0);
	}
	return mesh;
}

static void sample_at(const struct psr_blocks *b, uint32_t block, unsigned s, float position[3])
{
	const struct psr_projection *p = &b->projection[b->block_projection[block]];
	struct psr_place place;
	psr_blocks_place(b, block, &place);
	unsigned level = psr_blocks_level(b, block);
	int row = ((int)place.row >> level) + (int)s / 8, col = ((int)place.col >> level) + (int)s % 8;
	double spacing = (double)p->spacing * (double)(1u << psr_blocks_level(b, block));
	double x = (col + (row & 1) / 2.0) * spacing, y = row * (sqrt(3.0) / 2) * spacing;
	uint64_t below = b->mask[block] & (((uint64_t)1 << s) - 1);
	uint32_t at = psr_blocks_attr_first(b, block) + (uint32_t)__builtin_popcountll(below);
	double z = (double)psr_place_depth(&place, b->depth[at]);

	for (int k = 0; k < 3; k++)
		position[k] = (float)(x * (double)p->axis[0][k] + y * (double)p->axis[1][k] + z * (double)p->axis[2][k]);
}

static void threads_do_not_change_a_byte(void **state)
{
	struct psr_mesh *mesh = dented_sphere();
	struct psr_model *one = build(mesh, 96, 1), *three = build(mesh, 96, 3);
	uint8_t a[16], b[16];

	(void)state;
	psr_model_content_id(one, a);
	psr_model_content_id(three, b);
	assert_memory_equal(a, b, sizeof a);
	psr_model_unref(one);
	psr_model_unref(three);
	meshes_free(mesh);
}

/* Positions are quantised to half a depth step, which is far below a 16-bit share of the whole object, and a triangle
 * of this mesh bulges from its sphere by (pi / 160)^2 / 2 < 2e-4. */
static void samples_lie_on_the_surface(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(160, zero, 3);
	struct psr_model *model = build(mesh, 128, 2);
	const struct psr_blocks *b = psr_model_blocks(model);
	const float (*normal)[3] = psr_direction_table();

	(void)state;
	assert_float_equal(psr_model_info(model)->scale, 3, 1e-5);
	assert_float_equal(psr_model_info(model)->spacing, 2.0 / 128 * 3, 1e-6);
	for (uint32_t i = 0; i < b->n_blocks; i++) {
		const uint64_t *attr = b->attr + psr_blocks_attr_first(b, i);

		for (uint64_t left = b->mask[i]; left != 0; left &= left - 1, attr++) {
			float p[3];

			sample_at(b, i, (unsigned)__builtin_ctzll(left), p);
			assert_float_equal(v3f_length(p), 1, 3e-4);
			/* Facets are up to 1.6 degrees off the sphere but normals are interpolated; codes are 1.27 degrees off, and
			 * what is bent to face its projection 1.8 more. */
			assert_true(v3f_dot(p, normal[PSR_ATTR_NORMAL(*attr)]) > 0.998f);
		}
	}
	psr_model_unref(model);
	meshes_free(mesh);
}

/* The middle of the box of a block's samples, along the axes of its projection, and from there to the furthest of them. */
static void block_box(const struct psr_blocks *b, uint32_t block, double middle[3], double *reach)
{
	const float (*axis)[3] = b->projection[b->block_projection[block]].axis;
	double min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };

	for (uint64_t left = b->mask[block]; left != 0; left &= left - 1) {
		float p[3];

		sample_at(b, block, (unsigned)__builtin_ctzll(left), p);
		for (int k = 0; k < 3; k++) {
			min[k] = fmin(min[k], (double)v3f_dot(p, axis[k]));
			max[k] = fmax(max[k], (double)v3f_dot(p, axis[k]));
		}
	}
	for (int k = 0; k < 3; k++) {
		middle[k] = 0;
		for (int a = 0; a < 3; a++)
			middle[k] += (min[a] + max[a]) / 2 * (double)axis[a][k];
	}
	*reach = 0;
	for (uint64_t left = b->mask[block]; left != 0; left &= left - 1) {
		double d = 0;
		float p[3];

		sample_at(b, block, (unsigned)__builtin_ctzll(left), p);
		for (int k = 0; k < 3; k++)
			d += ((double)p[k] - middle[k]) * ((double)p[k] - middle[k]);
		*reach = fmax(*reach, sqrt(d));
	}
}

/* Of all blocks of a model: what they hold, in what they are held, and how much wider than need be they are: by the rounding
 * of the centre, half a unit of 2^-14 along each axis, that of the radius, a unit of 2^-15, and some 2^-20 for the
 * rounding of positions here and there. */
static void check_spheres(const struct psr_blocks *b)
{
	/* From the limit between two windows centers are moved along x and y. */
	const double moved = 0.87 * 0x1p-14 + 0x1p-20;
	const double roundings = sqrt(3.0) * 0x1p-15 + 0x1p-15 + 0x1p-20 + sqrt(2.0) * moved;

	for (uint32_t c = 0; c < b->n_clusters; c++) {
		const struct psr_cluster *cluster = &b->cluster[c];

		assert_in_range(cluster->n_blocks, 1, cluster->level == 0 ? 1024 : 16384);
		for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
			double middle[3], reach, half_step = (double)b->projection[0].spacing * (double)(1 << psr_blocks_level(b, i)) / 2;
			float center[3], radius, d[3];

			psr_blocks_sphere(b, i, center, &radius);
			v3f_sub(d, center, cluster->center);
			assert_true(v3f_length(d) + radius <= cluster->radius * (1 + 0x1p-20f));
			block_box(b, i, middle, &reach);
			assert_true((double)radius <= reach + half_step + roundings);
			for (int k = 0; k < 3; k++)
				assert_float_equal(center[k], middle[k], 0x1p-15 + 0x1p-20 + sqrt(2.0) * moved);
			for (uint64_t left = b->mask[i]; left != 0; left &= left - 1) {
				float p[3];

				sample_at(b, i, (unsigned)__builtin_ctzll(left), p);
				v3f_sub(d, p, center);
				assert_true(v3f_length(d) + (float)half_step <= radius * (1 + 0x1p-20f));
			}
		}
	}
}

/* Resolution 8 has the widest blocks that there are. */
static void spheres_hold_their_samples_and_little_more(void **state)
{
	static const uint32_t resolution[3] = { 8, 64, 96 };
	struct psr_mesh *mesh = dented_sphere();

	(void)state;
	for (int i = 0; i < 3; i++) {
		struct psr_model *model = build(mesh, resolution[i], 2);

		check_spheres(psr_model_blocks(model));
		psr_model_unref(model);
	}
	meshes_free(mesh);
}

/* Pixels of an orthographic view at the target resolution whose 3x3 neighbourhood meets the object and into which no
 * sample falls that is turned to the viewer. */
static void count_missing(const struct psr_mesh *mesh, const struct psr_model *model, const double direction[3],
                          uint64_t *n_inside, uint64_t *n_missing)
{
	const struct psr_model_info *info = psr_model_info(model);
	const struct psr_blocks *b = psr_model_blocks(model);
	const float (*normal)[3] = psr_direction_table();
	int side = (int)info->resolution;
	double frame[3][3], ds = 2.0 / side;
	struct ray_scene *scene = NULL;
	uint8_t *is_met = calloc((size_t)side * side, 1), *is_drawn = calloc((size_t)side * side, 1);

	psr_direction_basis(direction, frame);
	assert_int_equal(ray_scene_create(&scene, mesh, info->origin, info->scale, NULL), PSR_OK);
	for (int i = 0; i < side * side; i++) {
		double x = (i % side + 0.5) * ds - 1, y = (i / side + 0.5) * ds - 1;
		struct ray ray;
		struct ray_hit hit;

		for (int k = 0; k < 3; k++) {
			ray.origin[k] = x * frame[0][k] + y * frame[1][k] + 2 * frame[2][k];
			ray.direction[k] = -frame[2][k];
		}
		ray_scene_trace(scene, &ray, 1, 0, &hit);
		is_met[i] = hit.prim != RAY_NONE;
	}
	for (uint32_t i = 0; i < b->n_blocks; i++) {
		const uint64_t *attr = b->attr + psr_blocks_attr_first(b, i);

		for (uint64_t left = b->mask[i]; left != 0; left &= left - 1, attr++) {
			const float *n = normal[PSR_ATTR_NORMAL(*attr)];
			double u = 0, v = 0, facing = 0;
			float p[3];

			sample_at(b, i, (unsigned)__builtin_ctzll(left), p);
			for (int k = 0; k < 3; k++) {
				u += (double)p[k] * frame[0][k];
				v += (double)p[k] * frame[1][k];
				facing += (double)n[k] * frame[2][k];
			}
			if (facing > 0 || (b->flags[i] & PSR_BLOCK_TWO_SIDED) != 0)
				is_drawn[(int)((v + 1) / ds) * side + (int)((u + 1) / ds)] = 1;
		}
	}
	for (int y = 1; y < side - 1; y++) {
		for (int x = 1; x < side - 1; x++) {
			int inside = 1;

			for (int k = 0; k < 9; k++)
				inside &= is_met[(y + k / 3 - 1) * side + x + k % 3 - 1];
			*n_inside += (uint64_t)inside;
			*n_missing += (uint64_t)(inside && !is_drawn[y * side + x]);
		}
	}
	ray_scene_destroy(scene);
	free(is_met);
	free(is_drawn);
}

static void random_views_have_no_holes(void **state)
{
	struct psr_mesh *mesh = dented_sphere();
	struct psr_model *model = build(mesh, 192, 2);
	uint64_t seed = 5, n_inside = 0, n_missing = 0;

	(void)state;
	for (int i = 0; i < 12; i++) {
		double direction[3];

		do {
			for (int k = 0; k < 3; k++)
				direction[k] = 2 * meshes_random(&seed) - 1;
		} while (v3d_dot(direction, direction) > 1 || v3d_normalize(direction, direction) < 0.1);
		count_missing(mesh, model, direction, &n_inside, &n_missing);
	}
	printf("# %llu of %llu pixels missing\n", (unsigned long long)n_missing, (unsigned long long)n_inside);
	assert_true(n_inside > 200000);
	assert_true((double)n_missing < 1e-4 * (double)n_inside);
	psr_model_unref(model);
	meshes_free(mesh);
}

static uint32_t count_two_sided(const struct psr_model *model)
{
	const struct psr_blocks *b = psr_model_blocks(model);
	uint32_t n = 0;

	for (uint32_t i = 0; i < b->n_blocks; i++)
		n += (b->flags[i] & PSR_BLOCK_TWO_SIDED) != 0;
	return n;
}

static void sheets_are_two_sided_and_closed_things_are_not(void **state)
{
	struct psr_mesh *sheet = meshes_square(4), *ball = meshes_sphere(30, zero, 1), *flat = meshes_square(4);
	struct psr_model *sheet_model, *ball_model, *flat_model;

	(void)state;
	sheet->material->two_sided = ball->material->two_sided = 1;
	sheet_model = build(sheet, 64, 2);
	ball_model = build(ball, 64, 2);
	flat_model = build(flat, 64, 2);
	assert_int_equal(count_two_sided(sheet_model), psr_model_blocks(sheet_model)->n_blocks);
	assert_int_equal(count_two_sided(ball_model), 0);
	assert_int_equal(count_two_sided(flat_model), 0);
	psr_model_unref(sheet_model);
	psr_model_unref(ball_model);
	psr_model_unref(flat_model);
	meshes_free(sheet);
	meshes_free(ball);
	meshes_free(flat);
}

/* Where a projection samples a face well, others add blocks along its border only. The lattice of one that looks
 * straight at it has cells of ds^2 cos^2 25 sqrt(3) / 2 = 0.711 ds^2. */
static void flat_faces_are_not_sampled_twice(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_model *model = build(mesh, 256, 2);
	double half_side = 128 / sqrt(2.0), once = 4 * half_side * half_side / 0.711;

	(void)state;
	printf("# %.2f samples a lattice point\n", (double)psr_model_blocks(model)->n_samples / once);
	assert_true((double)psr_model_blocks(model)->n_samples < 2 * once);
	psr_model_unref(model);
	meshes_free(mesh);
}

static void far_coordinates_give_the_same_samples(void **state)
{
	const double far[3] = { 5e6, -4e5, 120 };
	struct psr_mesh *near_mesh = meshes_sphere(30, zero, 1), *far_mesh = meshes_sphere(30, far, 1);
	struct psr_model *near_model = build(near_mesh, 64, 2), *far_model = build(far_mesh, 64, 2);
	const struct psr_model_info *info = psr_model_info(far_model);

	(void)state;
	/* Vertices are rounded to 1e-9, which moves a sample at the outline now and then. */
	assert_in_range(psr_model_blocks(far_model)->n_blocks, psr_model_blocks(near_model)->n_blocks * 99 / 100,
	                psr_model_blocks(near_model)->n_blocks * 101 / 100);
	for (int k = 0; k < 3; k++) {
		assert_true(fabs(info->origin[k] - far[k]) < 1e-8);
		assert_true(info->box_min[k] > far[k] - 1.001 && info->box_max[k] < far[k] + 1.001);
	}
	psr_model_unref(near_model);
	psr_model_unref(far_model);
	meshes_free(near_mesh);
	meshes_free(far_mesh);
}

static void bad_requests_are_refused_with_a_sentence(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_build_options options;
	struct psr_model *model = NULL;
	struct psr_error err;

	(void)state;
	psr_build_options_default(&options);
	options.resolution = 7;
	assert_int_equal(psr_model_build(&model, mesh, &options, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "resolution 7"));
	options.resolution = 8193;
	assert_int_equal(psr_model_build(&model, mesh, &options, NULL, &err), PSR_ERR_ARG);
	options.resolution = 16;
	options.tolerance = NAN;
	assert_int_equal(psr_model_build(&model, mesh, &options, NULL, &err), PSR_ERR_ARG);
	options.tolerance = 0.4;
	options.n_threads = 0;
	assert_int_equal(psr_model_build(&model, mesh, &options, NULL, &err), PSR_ERR_ARG);
	options.n_threads = 1;
	mesh->material->alpha = PSR_ALPHA_BLEND;
	mesh->material->base_color[3] = 0;
	assert_int_equal(psr_model_build(&model, mesh, &options, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "transparent"));
	assert_null(model);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(threads_do_not_change_a_byte),
		cmocka_unit_test(samples_lie_on_the_surface),
		cmocka_unit_test(spheres_hold_their_samples_and_little_more),
		cmocka_unit_test(random_views_have_no_holes),
		cmocka_unit_test(sheets_are_two_sided_and_closed_things_are_not),
		cmocka_unit_test(flat_faces_are_not_sampled_twice),
		cmocka_unit_test(far_coordinates_give_the_same_samples),
		cmocka_unit_test(bad_requests_are_refused_with_a_sentence),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
