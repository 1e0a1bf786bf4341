/* The geometric bound of frames, against rays. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/vec.h"
#include "measure/measure.h"
#include "psr/build.h"
#include "psr/frame.h"
#include "psr/render.h"
#include "tests/unit/sample/meshes.h"

#define SIDE 96
#define RESOLUTION 64
#define N_VIEWS 12

/* Crests: faces that meet at sharp edges, where samples lie beside the surface. Each triangle of a sphere becomes a
 * spike; each spike has another height. */
static struct psr_mesh *make_crests(uint32_t n)
{
	const double center[3] = { 0, 0, 0 };
	struct psr_mesh *sphere = meshes_sphere(n, center, 0.5);
	struct psr_mesh *mesh = meshes_new(9 * sphere->n_triangles, 3 * sphere->n_triangles);
	uint64_t random = 1;

	for (uint32_t t = 0; t < sphere->n_triangles; t++) {
		const double height = 1 + meshes_random(&random);
		double tip[3] = { 0, 0, 0 };

		for (int k = 0; k < 9; k++)
			tip[k % 3] += sphere->position[sphere->triangle[t][k / 3]][k % 3] / 3 * height;
		for (uint32_t f = 0; f < 3; f++)
			for (uint32_t c = 0; c < 3; c++) {
				const uint32_t at = 9 * t + 3 * f + c;
				const double *from = c == 2 ? tip : sphere->position[sphere->triangle[t][(f + c) % 3]];

				for (int k = 0; k < 3; k++)
					mesh->position[at][k] = from[k];
				mesh->triangle[3 * t + f][c] = at;
			}
	}
	meshes_free(sphere);
	return mesh;
}

struct fixture {
	struct psr_mesh *mesh;
	struct psr_model *model;
	struct psr_truth *truth;
	struct psr_renderer *renderer;
};

static int open_fixture(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	struct psr_build_options options;

	f->mesh = make_crests(6);
	psr_build_options_default(&options);
	options.resolution = RESOLUTION;
	*state = f;
	return psr_model_build(&f->model, f->mesh, &options, NULL, NULL) || psr_truth_create(&f->truth, f->mesh, NULL)
	       || psr_renderer_create(&f->renderer, NULL);
}

static int close_fixture(void **state)
{
	struct fixture *f = *state;

	psr_renderer_destroy(f->renderer);
	psr_truth_destroy(f->truth);
	psr_model_unref(f->model);
	meshes_free(f->mesh);
	free(f);
	return 0;
}

struct drawn {
	float depth[SIDE * SIDE];
	uint16_t plane[SIDE * SIDE]; /* of bounds */
	double bound;                /* of the frame */
	float without[SIDE * SIDE];  /* the depths without those of filled pixels, */
	unsigned n_filled;
	double unfilled, most;       /* how far one of these is off, and the greatest of their bounds */
};

/* Filled pixels have the bound of the frame, rounded up; others less, as a fill adds more than it rounds. */
static void leave_unfilled(struct drawn *drawn)
{
	const double filled = ceil(drawn->bound * PSR_BOUND_ONE * (1 + 0x1p-20));

	drawn->n_filled = 0;
	drawn->most = 0;
	for (int i = 0; i < SIDE * SIDE; i++) {
		const int is_filled = isfinite(drawn->depth[i]) && drawn->plane[i] == filled;

		assert_true(drawn->plane[i] <= filled);
		assert_true(drawn->plane[i] > 0 || !isfinite(drawn->depth[i]));
		drawn->without[i] = is_filled ? INFINITY : drawn->depth[i];
		drawn->n_filled += is_filled;
		if (!is_filled && isfinite(drawn->depth[i]))
			drawn->most = fmax(drawn->most, drawn->plane[i] / (double)PSR_BOUND_ONE);
	}
}

/* Draws a view by parallel rays, of pixels as wide as the distance of samples by `magnification`. Returns the distance
 * of the depth that is furthest off, in pixels, and the bound. */
static double draw(struct drawn *drawn, const struct fixture *f, double magnification, uint64_t *random)
{
	float *depth = drawn->depth;
	const double pixel = psr_model_info(f->model)->spacing / magnification;
	const struct psr_instance instance = { .model = f->model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .depth = depth, .bound = drawn->plane };
	struct psr_settings settings;
	struct psr_accuracy accuracy;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = SIDE * pixel };
	for (int k = 0; k < 3; k++) {
		scene.camera.eye[k] = 2 * meshes_random(random) - 1;
		scene.camera.up[k] = 2 * meshes_random(random) - 1;
	}
	v3d_normalize(scene.camera.eye, scene.camera.eye);
	v3d_scale(scene.camera.eye, scene.camera.eye, 4);
	psr_settings_default(&settings, SIDE, SIDE);
	assert_int_equal(psr_render(f->renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
	const struct psr_truth_shot shot = { f->truth, &scene.camera, SIDE, SIDE, 1 };
	assert_int_equal(psr_accuracy_measure(&accuracy, &shot, depth, pixel, NULL), PSR_OK);
	assert_true(accuracy.n_compared > SIDE);
	drawn->bound = frame.report.error_px;
	const double most = accuracy.distance_max;
	leave_unfilled(drawn);
	if (drawn->n_filled > 0)
		assert_int_equal(psr_accuracy_measure(&accuracy, &shot, drawn->without, pixel, NULL), PSR_OK);
	drawn->unfilled = accuracy.n_compared > 0 ? accuracy.distance_max : 0;
	return most;
}

/* From samples half a pixel apart, where no pixel needs another one, to four pixels, where most are filled. */
static void no_pixel_is_further_from_the_surface_than_the_bound(void **state)
{
	uint64_t random = 5;

	for (double magnification = 0.5; magnification <= 4; magnification *= 1.4142135623730951)
		for (int v = 0; v < N_VIEWS; v++) {
			struct drawn drawn;
			const double most = draw(&drawn, *state, magnification, &random);

			if (!(most <= drawn.bound))
				fail_msg("magnification %.2f, view %d: %.3f pixels off, the bound is %.3f", magnification, v, most,
				         drawn.bound);
			if (!(drawn.unfilled <= drawn.most))
				fail_msg("magnification %.2f, view %d: without filled pixels %.3f pixels off, the plane says %.3f",
				         magnification, v, drawn.unfilled, drawn.most);
		}
}

/* Half a pixel along both axes is 0.71; a sample is at most 0.55 spacings off the surface, and at these magnifications
 * spacings of the level that is drawn are at most a pixel; steps of depth are smaller than a thousandth. */
static void without_filled_pixels_the_bound_is_below_1_27_pixels(void **state)
{
	uint64_t random = 5; /* some of these views fill no pixel */
	int n_tight = 0;

	for (int v = 0; v < N_VIEWS; v++) {
		struct drawn drawn;

		draw(&drawn, *state, 0.5, &random);
		assert_true(drawn.bound > 0.7071);
		n_tight += drawn.bound < 1.27;
		assert_true(drawn.most < 1.27 || (drawn.n_filled == 0 && drawn.bound < 1.27));
	}
	assert_true(n_tight > 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_pixel_is_further_from_the_surface_than_the_bound),
		cmocka_unit_test(without_filled_pixels_the_bound_is_below_1_27_pixels),
	};

	return cmocka_run_group_tests(tests, open_fixture, close_fixture);
}
