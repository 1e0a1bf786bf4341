#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/srgb.h"
#include "measure/measure.h"
#include "tests/unit/sample/meshes.h"

#define W 48
#define H 32
#define SHOT(width, height, n_threads) ((struct psr_truth_shot){ truth, &camera, width, height, n_threads })

static const double zero[3];

static struct psr_camera camera_from(double x, double y, double z)
{
	return (struct psr_camera){ .eye = { x, y, z }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 0.8 };
}

static struct psr_truth *open_truth(const struct psr_mesh *mesh)
{
	struct psr_truth *truth = NULL;

	assert_int_equal(psr_truth_create(&truth, mesh, NULL), PSR_OK);
	return truth;
}

/* The light of a rough dielectric of base colour `base`, seen at cosine v: surface/lobe.h with roughness 1 and
 * reflectance 0.04. */
static uint8_t rough_in_ambient_light(double base, double v)
{
	const double mirrored = 1 / (1 + (0.42 + 1.05 * v - 1.87 * v * v) + (-0.45 + 1.83 * v + 1.17 * v * v));

	return psr_linear_to_srgb((float)(base * 0.96 + 0.04 * mirrored));
}

/* Depth is along the axis and not along the ray: the same all over a square that faces the eye. */
static void a_facing_square_has_one_depth(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_truth *truth;
	struct psr_camera camera = camera_from(0, 0, 3);
	float depth[W * H], normal[W * H][3];
	uint8_t color[W * H][4];
	double focal = H / 2.0 / tan(0.4);
	float half = psr_srgb_to_linear[psr_linear_to_srgb(0.5f)];

	(void)state;
	mesh->material->base_color[0] = 0.5f;
	truth = open_truth(mesh);
	assert_int_equal(psr_truth_draw(&SHOT(W, H, 2), 1, depth, normal, color, NULL), PSR_OK);
	for (int y = 0; y < H; y++) {
		for (int x = 0; x < W; x++) {
			int i = y * W + x;
			double to_x = (x + 0.5 - W / 2) / focal, to_y = (y + 0.5 - H / 2) / focal;
			double v = 1 / sqrt(to_x * to_x + to_y * to_y + 1);
			int is_met = fabs(to_x * 3) < 1 && fabs(to_y * 3) < 1;

			if (!is_met) {
				assert_true(isinf(depth[i]));
				continue;
			}
			assert_true(fabsf(depth[i] - 3) <= 0x1p-22f);
			assert_true(normal[i][0] == 0 && normal[i][1] == 0 && normal[i][2] == 1);
			/* The word keeps the base colour's code. */
			assert_int_equal(color[i][0], rough_in_ambient_light((double)half, v));
			assert_int_equal(color[i][1], rough_in_ambient_light(1, v));
			assert_int_equal(color[i][3], abs(rough_in_ambient_light(1, cos(acos(v) + M_PI / 18)) - color[i][1]));
		}
	}
	psr_truth_destroy(truth);
	meshes_free(mesh);
}

/* Seen from +z, +x is right and +y is up. */
static void pictures_are_not_mirrored(void **state)
{
	struct psr_mesh *mesh = meshes_square(2);
	struct psr_truth *truth;
	struct psr_camera camera = camera_from(0, 0, 3);
	float depth[W * H];

	(void)state;
	camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	camera.ortho_height = 2.5;
	/* Keep the quarter with x > 0, y > 0. */
	memmove(mesh->triangle, mesh->triangle + 6, 2 * sizeof *mesh->triangle);
	mesh->n_triangles = 2;
	truth = open_truth(mesh);
	assert_int_equal(psr_truth_draw(&SHOT(W, H, 1), 1, depth, NULL, NULL, NULL), PSR_OK);
	for (int i = 0; i < W * H; i++) {
		double x = (i % W + 0.5 - W / 2) * 2.5 / H, y = -(i / W + 0.5 - H / 2) * 2.5 / H;

		assert_int_equal(isfinite(depth[i]) != 0, x > 0 && x < 1 && y > 0 && y < 1);
	}
	psr_truth_destroy(truth);
	meshes_free(mesh);
}

/* A finely divided sphere of radius 1 differs from the exact one by (pi / 400)^2 / 2 = 3e-5, times 1 / cos at
 * 60 degrees from the middle. */
static void spheres_have_their_depths_and_normals(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(400, zero, 1);
	struct psr_truth *truth = open_truth(mesh);
	struct psr_camera camera = camera_from(2, 1, 4);
	float depth[4 * W * H], normal[4 * W * H][3];
	double distance = sqrt(21), near_z = distance - 1;

	(void)state;
	assert_int_equal(psr_truth_draw(&SHOT(W, H, 2), 2, depth, normal, NULL, NULL), PSR_OK);
	for (int i = 0; i < 4 * W * H; i++) {
		double x = (i % (2 * W) + 0.5 - W) / W, y = (i / (2 * W) + 0.5 - H) / H;
		double px = x * tan(0.4) * W / H, py = y * tan(0.4), squared = px * px + py * py + 1;
		double inside = distance * distance - squared * (distance * distance - 1), z;

		if (inside < 0.25 * squared) /* not within 60 degrees */
			continue;
		z = (distance - sqrt(inside)) / squared;
		assert_true(z >= near_z - 1e-9);
		assert_true(fabs((double)depth[i] - z) < 1e-4);
		assert_true((double)normal[i][0] * 2 + (double)normal[i][1] + (double)normal[i][2] * 4 > 0);
	}
	psr_truth_destroy(truth);
	meshes_free(mesh);
}

static void bad_pictures_are_refused(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_truth *truth = open_truth(mesh);
	struct psr_camera camera = camera_from(0, 0, 3);
	float depth[W * H];

	(void)state;
	assert_int_equal(psr_truth_draw(&SHOT(0, H, 1), 1, depth, NULL, NULL, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_truth_draw(&SHOT(1 << 20, 1 << 20, 1), 1, depth, NULL, NULL, NULL), PSR_ERR_LIMIT);
	assert_int_equal(psr_truth_draw(&SHOT(W, H, 1), 0, depth, NULL, NULL, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_truth_draw(&SHOT(W, H, -1), 1, depth, NULL, NULL, NULL), PSR_ERR_ARG);
	camera.eye[2] = NAN;
	assert_int_equal(psr_truth_draw(&SHOT(W, H, 1), 1, depth, NULL, NULL, NULL), PSR_ERR_ARG);
	psr_truth_destroy(truth);
	psr_truth_destroy(NULL);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_facing_square_has_one_depth),
		cmocka_unit_test(pictures_are_not_mirrored),
		cmocka_unit_test(spheres_have_their_depths_and_normals),
		cmocka_unit_test(bad_pictures_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
