/* Objects of all sizes and places, down to a point and to nothing, through the modeller and in a picture. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "lib/blocks.h"
#include "psr/build.h"
#include "tests/unit/sample/meshes.h"

#define PI 3.14159265358979323846
#define FINENESS 48 /* of spheres: rows of faces from pole to pole */

static int build(struct psr_model **model, const struct psr_mesh *mesh, uint32_t resolution, struct psr_error *err)
{
	struct psr_build_options options;

	psr_build_options_default(&options);
	options.resolution = resolution;
	options.n_threads = 1;
	return psr_model_build(model, mesh, &options, NULL, err);
}

static struct psr_model *built(const struct psr_mesh *mesh, uint32_t resolution)
{
	struct psr_model *model = NULL;
	struct psr_error err = { .text = "" };

	if (build(&model, mesh, resolution, &err))
		fail_msg("%s", err.text);
	return model;
}

static void scale_mesh(struct psr_mesh *mesh, double scale)
{
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		v3d_scale(mesh->position[i], mesh->position[i], scale);
}

#define same(a, b, member, n) assert_memory_equal((a)->member, (b)->member, (n) * sizeof *(a)->member)

static void same_blocks(const struct psr_blocks *a, const struct psr_blocks *b)
{
	assert_int_equal(a->n_blocks, b->n_blocks);
	assert_int_equal(a->n_samples, b->n_samples);
	same(a, b, sphere_x, a->n_blocks);
	same(a, b, sphere_y, a->n_blocks);
	same(a, b, sphere_z, a->n_blocks);
	same(a, b, sphere_r, a->n_blocks);
	same(a, b, mask, a->n_blocks);
	same(a, b, flags, a->n_blocks);
	same(a, b, depth, a->n_samples);
	same(a, b, attr, a->n_samples);
}

/* A draws the model from +z, so that its unit sphere fills the picture. */
static void draw(struct psr_frame *frame, const struct psr_model *model, uint32_t side)
{
	const struct psr_model_info *info = psr_model_info(model);
	struct psr_instance instance = hard_place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };

	scene.camera = (struct psr_camera){ .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                                .ortho_height = 2 * info->scale };
	memcpy(scene.camera.target, info->origin, sizeof info->origin);
	memcpy(scene.camera.eye, info->origin, sizeof info->origin);
	scene.camera.eye[2] += 4 * info->scale;
	hard_draw(frame, &scene, side, side);
}

/* Extents of 2^-23, which is 1.2e-7, and 2^30, 1.1e9, and further: everything is relative to the unit sphere, so all of
 * the model but its scale is the same bits, and so is the picture. */
static void an_object_scaled_by_a_power_of_two_is_the_same_model(void **state)
{
	static const int by[] = { -60, -23, 30, 60 };
	struct psr_mesh *mesh = meshes_sphere(FINENESS, (const double[3]){ 0.3, 0.1, -0.2 }, 0.5);
	struct psr_model *plain = built(mesh, 64), *scaled;
	struct psr_frame frame[2];

	(void)state;
	draw(&frame[0], plain, 64);
	for (size_t i = 0; i < sizeof by / sizeof by[0]; i++) {
		scale_mesh(mesh, ldexp(1, by[i]));
		scaled = built(mesh, 64);
		same_blocks(psr_model_blocks(plain), psr_model_blocks(scaled));
		assert_true(psr_model_info(scaled)->scale == ldexp(psr_model_info(plain)->scale, by[i]));
		draw(&frame[1], scaled, 64);
		hard_same_planes(&frame[0], &frame[1], 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_WEIGHT);
		psr_frame_free(&frame[1]);
		psr_model_unref(scaled);
		scale_mesh(mesh, ldexp(1, -by[i]));
	}
	psr_frame_free(&frame[0]);
	psr_model_unref(plain);
	meshes_free(mesh);
}

/* Every sample lies on the faces of a sphere: between the sphere and the innermost point of its faces, which are quads
 * of PI / FINENESS a side, at radius cos(PI / (2 FINENESS))^2. Off by half a step of depth, at most a 4000th of a pixel
 * (decision 0027), by rays in single precision (2^-20 of the unit sphere, far above their 2^-23), and by the rounding
 * of the source's own coordinates. */
static void check_sphere(const struct psr_model *model, const double center[3], double radius, double rounding)
{
	const struct psr_blocks *b = psr_model_blocks(model);
	const struct psr_model_info *info = psr_model_info(model);
	const double inner = radius * cos(PI / 2 / FINENESS) * cos(PI / 2 / FINENESS);

	for (uint32_t block = 0; block < b->n_blocks; block++)
		for (uint64_t left = b->mask[block]; left; left &= left - 1) {
			const double pixel = 2.0 / info->resolution * (1u << psr_blocks_level(b, block));
			const double off = info->scale * (pixel / 4000 + 0x1p-20) + rounding;
			double at[3];

			hard_position(at, b, block, (uint32_t)__builtin_ctzll(left));
			/* The differences of centres are exact. */
			for (int k = 0; k < 3; k++)
				at[k] = info->scale * at[k] + (info->origin[k] - center[k]);
			const double r = v3d_length(at);
			if (r > radius + off || r < inner - off)
				fail_msg("a sample is %g from the centre; the sphere has %g, and it may be off by %g", r, radius, off);
		}
}

static void samples_are_on_the_surface_at_any_size_and_place(void **state)
{
	static const double radius[] = { 1e-7, 1, 1e9 }, offset[] = { 0, 1e3, 1e7 }; /* in extents */

	(void)state;
	for (size_t r = 0; r < 3; r++)
		for (size_t o = 0; o < 3; o++) {
			const double far = radius[r] * offset[o], center[3] = { far, -far, far };
			struct psr_mesh *mesh = meshes_sphere(FINENESS, center, radius[r]);
			struct psr_model *model = built(mesh, 64);
			struct psr_frame frame;
			unsigned n_covered = 0;

			/* Coordinates of the mesh are rounded to 2^-53 of theirs, in three axes. */
			check_sphere(model, center, radius[r], 3 * 0x1p-53 * (far + radius[r]));
			assert_true(psr_model_info(model)->n_missing <= psr_model_info(model)->n_trials / 1000);
			/* The sphere fills a circle of 96 pixels, but for its border. */
			draw(&frame, model, 96);
			for (int p = 0; p < 96 * 96; p++)
				n_covered += frame.depth[p] < INFINITY;
			assert_in_range(n_covered, (unsigned)(PI * 46 * 46), (unsigned)(PI * 50 * 50));
			psr_frame_free(&frame);
			psr_model_unref(model);
			meshes_free(mesh);
		}
}

/* A square, and a triangle alone: pixels whose whole area is a pixel inside of it have a sample, those a pixel outside
 * have none. At the resolution of the model, so no depth buffer widens anything. */
static void flat_things_are_there_and_nothing_else(void **state)
{
	(void)state;
	for (int is_triangle = 0; is_triangle < 2; is_triangle++)
		for (int scale = -1; scale <= 1; scale++) {
			struct psr_mesh *mesh = meshes_square(1);

			mesh->n_triangles = is_triangle ? 1 : 2; /* the first: (-1,-1), (1,-1), (1,1), of the square -1..1 */
			scale_mesh(mesh, pow(1e8, scale));
			struct psr_model *model = built(mesh, 128);
			const struct psr_model_info *info = psr_model_info(model);
			struct psr_frame frame;

			draw(&frame, model, 128);
			for (int p = 0; p < 128 * 128; p++) {
				const double unit = pow(1e8, scale), pixel = info->scale / 64;
				const double x = (p % 128 - 63.5) * pixel + info->origin[0];
				const double y = (63.5 - p / 128) * pixel + info->origin[1];
				double inside = unit - fmax(fabs(x), fabs(y));

				if (is_triangle) /* its long side is x = y */
					inside = fmin(inside, (x - y) / sqrt(2));
				if (inside > 2 * pixel)
					assert_true(frame.words[p] != PSR_WORD_EMPTY);
				if (inside < -2 * pixel)
					assert_true(frame.words[p] == PSR_WORD_EMPTY && isinf(frame.depth[p]));
			}
			psr_frame_free(&frame);
			psr_model_unref(model);
			meshes_free(mesh);
		}
}

/* One point of a cloud, a disc, from the least radius to 1e9 at 1e7 radii; and no face at all, or none with an area. */
static void one_point_is_a_model_and_none_is_an_error(void **state)
{
	static const double radius[] = { 1e-7, 1, 1e9 };
	struct psr_error err = { .text = "" };
	struct psr_model *model;

	(void)state;
	for (size_t r = 0; r < 3; r++) {
		struct psr_mesh *mesh = meshes_new(0, 0);
		double at[1][3] = { { 1e7 * radius[r], 0, 0 } };
		float normal[1][3] = { { 0, 0, 1 } }, size[1] = { (float)radius[r] };
		uint32_t material[1] = { 0 };
		struct psr_frame frame;

		mesh->n_points = 1;
		mesh->point = at;
		mesh->point_normal = normal;
		mesh->point_radius = size;
		mesh->point_material = material;
		mesh->up[1] = 1;
		model = built(mesh, 32);
		assert_true(psr_model_blocks(model)->n_samples > 0 && psr_model_info(model)->scale > 0);
		draw(&frame, model, 32);
		assert_true(frame.words[16 * 32 + 16] != PSR_WORD_EMPTY);
		psr_frame_free(&frame);
		psr_model_unref(model);
		meshes_free(mesh);
	}
	struct psr_mesh *none = meshes_square(1);
	none->n_triangles = 0;
	assert_int_equal(build(&model, none, 32, &err), PSR_ERR_ARG);
	assert_true(err.text[0] != 0);
	meshes_free(none);
	const double line[3][3] = { { 0, 0, 0 }, { 1, 1, 1 }, { 2, 2, 2 } };
	const uint32_t face[1][3] = { { 0, 1, 2 } };
	assert_int_equal(psr_mesh_create(&none, line, 3, face, 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "area"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_object_scaled_by_a_power_of_two_is_the_same_model),
		cmocka_unit_test(samples_are_on_the_surface_at_any_size_and_place),
		cmocka_unit_test(flat_things_are_there_and_nothing_else),
		cmocka_unit_test(one_point_is_a_model_and_none_is_an_error),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
