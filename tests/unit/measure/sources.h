/* Pictures of the source for tests, of single places and of whole meshes. */
#ifndef TESTS_MEASURE_SOURCES_H
#define TESTS_MEASURE_SOURCES_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "measure/measure.h"
#include "tests/unit/sample/meshes.h"

#define PI 3.14159265358979323846
#define FLOATS 1e-5 /* relative: planes are floats, and so is the light that comes back */

static inline struct psr_scene scene_of(double ambient, const struct psr_light *light, uint32_t n_lights)
{
	struct psr_scene scene = { .ambient = { ambient, ambient, ambient }, .light = light, .n_lights = n_lights };

	scene.camera = (struct psr_camera){ .eye = { 0, 0, 3 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                                .ortho_height = 2 };
	return scene;
}

static inline void draw(const struct psr_mesh *mesh, const struct psr_scene *scene, uint32_t width, uint32_t height,
                        uint32_t side, const struct psr_source_planes *to)
{
	struct psr_source *source = NULL;

	assert_int_equal(psr_source_create(&source, mesh, NULL), PSR_OK);
	const struct psr_source_shot shot = { source, scene, width, height, side, 2 };
	assert_int_equal(psr_source_draw(&shot, to, NULL), PSR_OK);
	psr_source_destroy(source);
}

/* The light at one place of the square -1..1, seen from +z or from `eye` (NULL: +z). */
static inline void light_at(const struct psr_mesh *mesh, const struct psr_scene *scene, double x, double y,
                            const double *eye, float light[3])
{
	struct psr_scene there = *scene;

	there.camera.ortho_height = 1e-6;
	v3d_set(there.camera.target, x, y, 0);
	v3d_set(there.camera.eye, x + (eye ? eye[0] : 0), y + (eye ? eye[1] : 0), eye ? eye[2] : 3);
	draw(mesh, &there, 1, 1, 1, &(struct psr_source_planes){ .light = (float(*)[3])light });
}

static inline struct psr_light sun(double x, double y, double z)
{
	return (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { x, y, z }, .color = { 1, 1, 1 } };
}

static inline void assert_near(double got, double expected, double tolerance)
{
	if (!(fabs(got - expected) <= tolerance))
		fail_msg("%.9g is not within %g of %.9g", got, tolerance, expected);
}

#endif
