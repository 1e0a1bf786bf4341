/* Pictures of an analytic world, squares and spheres whose colour varies smoothly, and what warps them. */
#ifndef TESTS_UNIT_CLIENT_REPROJECT_WORLD_H
#define TESTS_UNIT_CLIENT_REPROJECT_WORLD_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "base/vec.h"
#include "client/lib/reproject.h"
#include "proto/proto.h"

#define COLOR (1u << PSR_PLANE_COLOR)
#define BOTH (1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH)
#define SIDE 160

static const uint8_t background[3] = { 255, 0, 255 }; /* no surface has it */

/* ---- the world ---- */

struct thing {
	double middle[3], radius;      /* of a sphere; radius 0: a square z = middle[2] */
	double half;                   /* its half side */
};

static const struct thing near_square_and_wall[] = { { { 0, 0, 0.5 }, 0, 0.5 }, { { 0, 0, -1 }, 0, 50 } };
static const struct thing ball[] = { { { 0, 0, 0 }, 1, 0 } };
static const struct thing wall[] = { { { 0, 0, 0 }, 0, 50 } };
static const struct thing two_squares[] = { { { -0.6, 0, 0 }, 0, 0.4 }, { { 0.6, 0, 0 }, 0, 0.4 } };

struct axes {
	double right[3], down[3], forward[3], unit; /* unit: world units a pixel, at distance 1 in perspective */
};

static inline struct axes axes_of(const struct psr_camera *camera, uint32_t height)
{
	struct axes a;

	v3d_sub(a.forward, camera->target, camera->eye);
	v3d_normalize(a.forward, a.forward);
	v3d_cross(a.right, a.forward, camera->up);
	v3d_normalize(a.right, a.right);
	v3d_cross(a.down, a.forward, a.right);
	a.unit = (camera->kind == PSR_CAMERA_PERSPECTIVE ? 2 * tan(camera->fov_y / 2) : camera->ortho_height) / height;
	return a;
}

/* The distance along the ray to the thing, INFINITY if it misses; the cosine between ray and normal. */
static inline double meet(const struct thing *t, const double from[3], const double ray[3], double *cosine)
{
	const double length = v3d_length(ray);
	double m[3], at[3], k;

	if (t->radius > 0) {
		v3d_sub(m, from, t->middle);
		const double a = v3d_dot(ray, ray), b = v3d_dot(m, ray);
		const double d = b * b - a * (v3d_dot(m, m) - t->radius * t->radius);

		if (d < 0)
			return INFINITY;
		k = (-b - sqrt(d)) / a;
		v3d_add_scaled(at, m, k, ray);
		*cosine = -v3d_dot(at, ray) / t->radius / length;
		return k > 0 ? k : INFINITY;
	}
	k = (t->middle[2] - from[2]) / ray[2];
	*cosine = fabs(ray[2]) / length;
	v3d_add_scaled(at, from, k, ray);
	return k > 0 && fabs(at[0] - t->middle[0]) <= t->half && fabs(at[1] - t->middle[1]) <= t->half ? k : INFINITY;
}

/* What a pixel shows. */
struct seen {
	double depth, cosine, place[3]; /* depth INFINITY: nothing */
	uint8_t color[3];
};

/* u, v: pixels from the middle of the picture. */
static inline struct seen look(const struct thing *things, size_t n, const struct psr_camera *camera,
                               const struct axes *a, double u, double v)
{
	struct seen seen = { .depth = INFINITY, .color = { background[0], background[1], background[2] } };
	const int is_perspective = camera->kind == PSR_CAMERA_PERSPECTIVE;
	double from[3], ray[3];

	memcpy(from, camera->eye, sizeof from);
	memcpy(ray, a->forward, sizeof ray);
	v3d_add_scaled(is_perspective ? ray : from, is_perspective ? ray : from, u * a->unit, a->right);
	v3d_add_scaled(is_perspective ? ray : from, is_perspective ? ray : from, v * a->unit, a->down);
	for (size_t i = 0; i < n; i++) {
		double cosine = 0, k = meet(&things[i], from, ray, &cosine);

		if (k < seen.depth) {
			seen.depth = k;
			seen.cosine = cosine;
			v3d_add_scaled(seen.place, from, k, ray);
			for (int c = 0; c < 3; c++) /* 100 codes a world unit at most; green is far from the background's */
				seen.color[c] = (uint8_t)lrint(128 + 50 * sin(2 * seen.place[c] + 3 * (double)i));
		}
	}
	return seen;
}

struct scene {
	const struct thing *things;
	size_t n;
};
#define SCENE(things) ((struct scene){ things, sizeof(things) / sizeof(things)[0] })

static inline struct psr_frame picture(struct scene scene, const struct psr_camera *camera, uint32_t width,
                                       uint32_t height)
{
	const struct axes a = axes_of(camera, height);
	struct psr_frame frame;

	assert_int_equal(psr_frame_alloc(&frame, width, height, BOTH, NULL), PSR_OK);
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++) {
			const struct seen seen =
				look(scene.things, scene.n, camera, &a, x + 0.5 - 0.5 * width, y + 0.5 - 0.5 * height);

			memcpy(frame.rgb + 3 * ((size_t)y * width + x), seen.color, 3);
			frame.depth[(size_t)y * width + x] = (float)seen.depth;
		}
	return frame;
}

static const struct psr_camera straight = { .eye = { 0, 0, 4 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_PERSPECTIVE,
	                                        .fov_y = 0.6, .ortho_height = 2.5 };

static inline struct psr_camera orbit(struct psr_camera camera, double degrees)
{
	const double a = degrees * 3.14159265358979323846 / 180, r = 4;

	camera.eye[0] = r * sin(a);
	camera.eye[2] = r * cos(a);
	return camera;
}

/* ---- what is tested ---- */

static struct psr_reproject *reproject;

static inline int set_up(void **state)
{
	(void)state;
	return psr_reproject_create(&reproject, NULL);
}

static inline int tear_down(void **state)
{
	(void)state;
	psr_reproject_destroy(reproject);
	return 0;
}

static inline void take(const struct psr_frame *frame, const struct psr_camera *camera)
{
	assert_int_equal(psr_reproject_take(reproject, frame, camera, background, NULL, NULL), PSR_OK);
}

static inline struct psr_frame draw_with(const struct psr_camera *camera, uint32_t width, uint32_t height,
                                         struct psr_pool *pool, struct psr_reproject_stats *stats)
{
	struct psr_frame frame;
	struct psr_error err = { 0 };

	assert_int_equal(psr_frame_alloc(&frame, width, height, COLOR, NULL), PSR_OK);
	if (psr_reproject_draw(reproject, camera, &frame, pool, stats, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return frame;
}

static inline struct psr_frame draw(const struct psr_camera *camera, uint32_t width, uint32_t height)
{
	return draw_with(camera, width, height, NULL, NULL);
}

static inline int is_background(const struct psr_frame *frame, uint32_t x, uint32_t y)
{
	return memcmp(frame->rgb + 3 * ((size_t)y * frame->width + x), background, 3) == 0;
}

static inline uint64_t n_background(const struct psr_frame *frame)
{
	uint64_t n = 0;

	for (uint32_t y = 0; y < frame->height; y++)
		for (uint32_t x = 0; x < frame->width; x++)
			n += is_background(frame, x, y);
	return n;
}

static inline int differ_by(const struct psr_frame *a, const uint8_t color[3], size_t pixel)
{
	int most = 0;

	for (int c = 0; c < 3; c++) {
		const int by = abs(a->rgb[3 * pixel + (size_t)c] - color[c]);

		most = by > most ? by : most;
	}
	return most;
}

#endif
