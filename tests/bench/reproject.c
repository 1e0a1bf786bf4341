/* reproject PSR-MODEL MODELS CACHE [NAME...]: what warping received pictures costs, and how near it comes to the truth.
 * MODELS takes models that are built once; CACHE has the real meshes. NAME: rows of the tables, all without any.
 *
 * The truth is a frame that psr_render() draws for the new camera; lights stand still. PSNR is over the pixels where
 * the truth shows a surface. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "base/srgb.h"
#include "base/stats.h"
#include "base/vec.h"
#include "client/lib/reproject.h"
#include "measure/measure.h"
#include "ours.h"
#include "proto/proto.h"
#include "psnr.h"
#include "report.h"
#include "scene.h"

#define WIDTH 1920
#define HEIGHT 1080
#define RESOLUTION 1024
#define ROUNDS 15
#define TARGET_MS 12
#define TARGET_DB 6
#define TARGET_DEGREES 3 /* 100 ms at 30 degrees a second */

static const uint8_t background[3] = { 20, 24, 28 };

struct subject {
	const char *name;
	struct scene_film film;
	struct psr_instance instance[16];
	uint32_t n_instances;
	struct psr_camera camera;
};

struct bench {
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct psr_reproject *reproject;
	const char *picture_folder; /* PSR_BENCH_PICTURES: where pictures are kept; NULL: nowhere */
};

/* ---- cameras ---- */

enum motion { ORBIT, RISE, PAN, ZOOM, DOLLY, ROLL };

struct move {
	const char *name;
	enum motion motion;
	double by; /* degrees; share of the picture's height; times; share of the way to the target */
};

static const struct move moves[] = {
	{ "orbit 0.5 degrees", ORBIT, 0.5 }, { "orbit 1 degree", ORBIT, 1 }, { "orbit 2 degrees", ORBIT, 2 },
	{ "orbit 3 degrees", ORBIT, 3 }, { "orbit 6 degrees", ORBIT, 6 }, { "orbit 12 degrees", ORBIT, 12 },
	{ "rise 3 degrees", RISE, 3 }, { "roll 3 degrees", ROLL, 3 }, { "pan 2 %", PAN, 0.02 }, { "pan 10 %", PAN, 0.1 },
	{ "zoom 10 %", ZOOM, 1.1 }, { "dolly 10 %", DOLLY, 0.1 },
};

/* Turns v about a unit axis. */
static void turn(double v[3], const double axis[3], double degrees)
{
	const double a = degrees * 3.14159265358979323846 / 180, along = v3d_dot(v, axis);
	double side[3], across[3];

	v3d_cross(side, axis, v);
	v3d_add_scaled(across, v, -along, axis);
	for (int k = 0; k < 3; k++)
		v[k] = along * axis[k] + cos(a) * across[k] + sin(a) * side[k];
}

static void move_camera(struct psr_camera *camera, const struct move *move)
{
	double away[3], right[3], up[3], forward[3];

	v3d_sub(away, camera->eye, camera->target);
	v3d_scale(forward, away, -1);
	v3d_normalize(forward, forward);
	v3d_normalize(up, camera->up);
	v3d_cross(right, forward, up);
	v3d_normalize(right, right);
	switch (move->motion) {
	case ORBIT:
		turn(away, up, move->by);
		break;
	case RISE:
		turn(away, right, -move->by);
		break;
	case ROLL:
		turn(camera->up, forward, move->by);
		break;
	case PAN:
		v3d_add_scaled(camera->target, camera->target, move->by * 2 * tan(camera->fov_y / 2) * v3d_length(away), right);
		break;
	case ZOOM:
		camera->fov_y = 2 * atan(tan(camera->fov_y / 2) / move->by);
		break;
	case DOLLY:
		v3d_scale(away, away, 1 - move->by);
		break;
	}
	v3d_add(camera->eye, camera->target, away);
}

/* The same view with so many times the width and height, and as much more of the world. */
static void widen(struct psr_camera *camera, double times)
{
	camera->fov_y = 2 * atan(tan(camera->fov_y / 2) * times);
}

/* ---- pictures ---- */

static void render(const struct bench *bench, const struct subject *s, const struct psr_camera *camera,
                   struct psr_frame *frame)
{
	struct psr_scene scene;
	struct psr_settings settings;
	struct psr_error err;

	scene_film_frame(&scene, &s->film, 0);
	scene.instance = s->instance;
	scene.n_instances = s->n_instances;
	scene.camera = *camera;
	for (int c = 0; c < 3; c++)
		scene.background[c] = psr_srgb_to_linear[background[c]];
	psr_settings_default(&settings, frame->width, frame->height);
	if (psr_render(bench->renderer, &scene, &settings, bench->pool, frame, &err) != PSR_OK)
		report_die(s->name, err.text);
}

static void new_frame(struct psr_frame *frame, uint32_t width, uint32_t height)
{
	if (psr_frame_alloc(frame, width, height, 1 << PSR_PLANE_COLOR | 1 << PSR_PLANE_DEPTH, NULL) != PSR_OK)
		report_die("frame", "no memory");
}

static double coverage_of(const struct psr_frame *frame)
{
	double n = 0;

	for (size_t i = 0; i < (size_t)frame->width * frame->height; i++)
		n += frame->depth[i] < INFINITY;
	return n / ((double)frame->width * frame->height);
}

static void keep(const struct bench *bench, const struct subject *s, const char *what, const struct move *move,
                 const struct psr_frame *frame)
{
	char path[4096];

	if (bench->picture_folder == NULL)
		return;
	snprintf(path, sizeof path, "%s/%s %s %s.png", bench->picture_folder, s->name, move->name, what);
	for (char *c = path; *c; c++)
		*c = *c == ' ' || *c == '%' ? '-' : *c;
	psr_image_write(frame, path, NULL);
}

/* ---- how the server sends it ---- */

/* Depth as u16 (step 1), or of the nearest of 2x2 pixels (step 2), as the client gets it. */
static void send_depth(struct psr_frame *frame, double near, double far, uint32_t step)
{
	const struct psr_depth_range range = { .min = near, .max = far };

	for (uint32_t y = 0; y < frame->height; y++)
		for (uint32_t x = 0; x < frame->width; x++) {
			const uint32_t at_x = x / step * step, at_y = y / step * step;
			float *z = frame->depth + (size_t)y * frame->width + x;
			const float *from = frame->depth + (size_t)at_y * frame->width + at_x;
			uint16_t q;

			if (at_x == x && at_y == y)
				for (uint32_t k = 1; k < step * step; k++) {
					const uint32_t px = x + k % step, py = y + k / step;

					if (px < frame->width && py < frame->height && frame->depth[(size_t)py * frame->width + px] < *z)
						*z = frame->depth[(size_t)py * frame->width + px];
				}
			psr_depth_quantise(&q, from, 1, &range);
			psr_depth_restore(z, &q, 1, &range);
		}
}

static void find_range(double *near, double *far, const struct psr_frame *frame)
{
	*near = INFINITY;
	*far = 0;
	for (size_t i = 0; i < (size_t)frame->width * frame->height; i++) {
		*near = frame->depth[i] < *near ? frame->depth[i] : *near;
		*far = frame->depth[i] < INFINITY && frame->depth[i] > *far ? frame->depth[i] : *far;
	}
}

/* ---- tables ---- */

static void take(const struct bench *bench, const struct psr_frame *picture, const struct psr_camera *camera)
{
	struct psr_error err;

	if (psr_reproject_take(bench->reproject, picture, camera, background, bench->pool, &err) != PSR_OK)
		report_die("take", err.text);
}

static struct psr_reproject_stats warp(const struct bench *bench, const struct psr_camera *camera, struct psr_frame *to)
{
	struct psr_reproject_stats stats;
	struct psr_error err;

	if (psr_reproject_draw(bench->reproject, camera, to, bench->pool, &stats, &err) != PSR_OK)
		report_die("draw", err.text);
	return stats;
}

static void time_warps(struct bench *bench, const struct subject *s)
{
	static const struct move move = { "", ORBIT, 3 };
	struct psr_frame received, drawn;
	struct psr_camera camera = s->camera;
	double take_ms[ROUNDS], ms[2][ROUNDS];

	new_frame(&received, WIDTH, HEIGHT);
	new_frame(&drawn, WIDTH, HEIGHT);
	render(bench, s, &s->camera, &received);
	move_camera(&camera, &move);
	struct psr_reproject_stats stats = { 0 };
	for (int threads = 1; threads <= 2; threads++) {
		struct psr_pool *pool = bench->pool;

		if (psr_pool_create(&bench->pool, threads, NULL) != PSR_OK)
			report_die("pool", "cannot be started");
		for (int i = -2; i < ROUNDS; i++) {
			const double start = report_ms();

			take(bench, &received, &s->camera);
			const double end = report_ms();
			stats = warp(bench, &camera, &drawn);
			if (i >= 0) {
				take_ms[i] = end - start;
				ms[threads - 1][i] = stats.ms;
			}
		}
		if (threads == 1)
			printf("%-14s %5.1f %8u %8.1f", s->name, 100 * coverage_of(&received), stats.n_cells,
			       stats_median(take_ms, ROUNDS));
		else
			printf(" %8.1f %8.1f %8.1f\n", stats_median(take_ms, ROUNDS), stats_median(ms[0], ROUNDS),
			       stats_median(ms[1], ROUNDS));
		psr_pool_destroy(bench->pool);
		bench->pool = pool;
	}
	report_target(s->name, stats_median(ms[1], ROUNDS), "ms, a warp by 3 degrees, 2 threads", REPORT_AT_MOST,
	              TARGET_MS);
	psr_frame_free(&received);
	psr_frame_free(&drawn);
}

static void compare(const struct bench *bench, const struct subject *s)
{
	struct psr_frame received, sent, wide, truth, drawn;
	struct psr_camera wider = s->camera;
	double near, far;

	new_frame(&received, WIDTH, HEIGHT);
	new_frame(&sent, WIDTH, HEIGHT);
	new_frame(&wide, WIDTH * 6 / 5, HEIGHT * 6 / 5);
	new_frame(&truth, WIDTH, HEIGHT);
	new_frame(&drawn, WIDTH, HEIGHT);
	widen(&wider, 1.2);
	render(bench, s, &s->camera, &received);
	render(bench, s, &wider, &wide);
	find_range(&near, &far, &received);
	printf("\n%s\n%-20s %8s %8s %6s %6s %8s %8s %8s\n", s->name, "", "unwarped", "warped", "more", "filled", "u16",
	       "u16 half", "overscan");
	for (size_t m = 0; m < sizeof moves / sizeof moves[0]; m++) {
		const struct move *move = &moves[m];
		struct psr_camera camera = s->camera;

		move_camera(&camera, move);
		render(bench, s, &camera, &truth);
		take(bench, &received, &s->camera);
		const struct psr_reproject_stats stats = warp(bench, &camera, &drawn);
		const double before = psnr(&truth, received.rgb), after = psnr(&truth, drawn.rgb);

		keep(bench, s, "truth", move, &truth);
		keep(bench, s, "warped", move, &drawn);
		printf("%-20s %8.1f %8.1f %6.1f %5.1f%%", move->name, before, after, after - before, 100 * stats.filled);
		for (uint32_t step = 1; step <= 2; step++) {
			memcpy(sent.rgb, received.rgb, (size_t)3 * WIDTH * HEIGHT);
			memcpy(sent.depth, received.depth, (size_t)4 * WIDTH * HEIGHT);
			send_depth(&sent, near, far, step);
			take(bench, &sent, &s->camera);
			warp(bench, &camera, &drawn);
			printf(" %8.1f", psnr(&truth, drawn.rgb));
		}
		take(bench, &wide, &wider);
		warp(bench, &camera, &drawn);
		printf(" %8.1f\n", psnr(&truth, drawn.rgb));
		keep(bench, s, "overscan", move, &drawn);
		if (move->motion == ORBIT && move->by == TARGET_DEGREES)
			report_target(s->name, after - before, "dB more than the unwarped frame at 3 degrees", REPORT_AT_LEAST,
			              TARGET_DB);
	}
	psr_frame_free(&received);
	psr_frame_free(&sent);
	psr_frame_free(&wide);
	psr_frame_free(&truth);
	psr_frame_free(&drawn);
}

/* ---- subjects ---- */

static void subject_init(struct subject *s, const char *name, struct psr_model *model, double coverage)
{
	static const double straight[3];
	const struct scene_picture picture = { "", WIDTH, HEIGHT, coverage };
	struct psr_scene scene;

	memset(s, 0, sizeof *s);
	s->name = name;
	scene_film_init(&s->film, &picture, model, straight);
	s->instance[0] = s->film.instance;
	s->n_instances = 1;
	scene_film_frame(&scene, &s->film, 0);
	s->camera = scene.camera;
}

static int is_asked(const char *name, char **names, int n_names)
{
	for (int i = 0; i < n_names; i++)
		if (strcmp(name, names[i]) == 0)
			return 1;
	return n_names == 0;
}

int main(int argc, char **argv)
{
	static const struct {
		const char *name, *file;
		double coverage;
		uint32_t n_instances;
	} rows[] = {
		{ "dragon-80", "dragon.ply", 0.8, 1 }, { "dragon", "dragon.ply", 0, 1 }, { "bunny", "bunny.obj", 0, 1 },
		{ "crowd", "bunny.obj", 0, 12 },
	};
	struct bench bench = { .picture_folder = getenv("PSR_BENCH_PICTURES") };
	static struct subject subject[sizeof rows / sizeof rows[0]];
	size_t n = 0;

	if (argc < 4)
		report_die("usage", "reproject PSR-MODEL MODELS CACHE [NAME...]");
	mkdir(argv[2], 0777);
	if (psr_renderer_create(&bench.renderer, NULL) != PSR_OK || psr_reproject_create(&bench.reproject, NULL) != PSR_OK)
		report_die("psr", "cannot be started");
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		char path[4096], name[64];

		if (!is_asked(rows[i].name, argv + 4, argc - 4))
			continue;
		snprintf(path, sizeof path, "%s/%s", argv[3], rows[i].file);
		snprintf(name, sizeof name, "%.*s", (int)strcspn(rows[i].file, "."), rows[i].file);
		subject_init(&subject[n], rows[i].name, scene_model(argv[1], argv[2], name, path, RESOLUTION),
		             rows[i].coverage);
		if (rows[i].n_instances > 1) {
			scene_spread(subject[n].instance, &subject[n].film, subject[n].film.model, rows[i].n_instances);
			subject[n].n_instances = rows[i].n_instances;
		}
		n++;
	}
	if (psr_pool_create(&bench.pool, 0, NULL) != PSR_OK)
		report_die("pool", "cannot be started");
	printf("Milliseconds, 1920x1080, medians. take: once a received picture; draw: a frame, 3 degrees of orbit.\n");
	printf("%-14s %5s %8s %8s %8s %8s %8s\n", "", "% on", "cells", "take 1T", "take 2T", "draw 1T", "draw 2T");
	for (size_t i = 0; i < n; i++)
		time_warps(&bench, &subject[i]);
	printf("\nPSNR in dB where the truth shows a surface; filled: of the picture; u16: depth sent; overscan: 1.2.\n");
	for (size_t i = 0; i < n; i++)
		compare(&bench, &subject[i]);
	printf("\n");
	report_print_targets();
	psr_pool_destroy(bench.pool);
	psr_renderer_destroy(bench.renderer);
	psr_reproject_destroy(bench.reproject);
	return 0;
}
