/* latency ADDRESS MODELS HANDS [MOVEMENT...]: what a viewer shows along movements of a hand, through the psrd at
 * ADDRESS, which serves the folder MODELS: bunny.psr, dragon.psr, engine.psr and doorway.psr, while hands move that
 * were recorded in the folder HANDS. Prints a row a movement. It drives what psr-view stands on (hand, link, show), without a window.
 *
 * The truth of a moment is what psr_render() draws for its camera, smooth, as the picture at rest is. PSNR is over the
 * pixels where the truth shows a surface, of every tenth frame; "unwarped" is the last received picture as it is. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/srgb.h"
#include "base/stats.h"
#include "base/vec.h"
#include "client/view/hand.h"
#include "client/view/path.h"
#include "client/view/show.h"
#include "measure/measure.h"
#include "proto/proto.h"
#include "psr/render.h"
#include "psnr.h"
#include "report.h"

#define WIDTH 1280
#define HEIGHT 720
#define FPS 60
#define OVERSCAN 1.2
#define FOV 35
#define SETTLE_S 4           /* how long the sharp picture is waited for */
#define MOST_FRAMES 1024
#define MOST_WISHES 4096
#define SAMPLE_EVERY 10
#define MS 1e-6

/* ---- movements, recorded by docs/hands.sh ---- */

static const struct movement {
	const char *name, *model;
} movements[] = {
	{ "pan", "bunny" }, { "orbit", "bunny" }, { "dragon", "dragon" }, { "engine", "engine" }, { "flick", "bunny" },
	{ "zoom", "bunny" }, { "doorway", "doorway" },
};

/* ---- what is shown ---- */

struct sample {
	struct psr_camera camera;
	uint8_t *warped, *unwarped; /* WIDTH x HEIGHT */
};

struct run {
	const struct movement *movement;
	struct path path;
	struct link *link;
	struct view_show *show;
	struct psr_pool *pool;
	struct hand hand;
	struct link_instance instance;
	struct link_wish wish;
	uint64_t wished_ns[MOST_WISHES], first_wish; /* when each was wished */
	double age_ms[MOST_FRAMES], warp_ms[MOST_FRAMES], filled[MOST_FRAMES];
	int n_frames, n_samples, n_pictures;
	struct sample sample[MOST_FRAMES / SAMPLE_EVERY + 1];
};

static void say_wish(struct run *run)
{
	run->wish.camera = run->hand.camera;
	const uint64_t number = link_wish(run->link, &run->wish);

	if (number == 0)
		report_die("link", "the wish is refused");
	if (run->first_wish == 0)
		run->first_wish = number;
	if (number - run->first_wish < MOST_WISHES && run->wished_ns[number - run->first_wish] == 0)
		run->wished_ns[number - run->first_wish] = clock_ns();
}

/* Takes the newest picture, if there is one. Returns whether it is the sharp one of the last wish. */
static int hear(struct run *run, uint64_t wish)
{
	struct psr_error err;
	struct link_state state;
	struct link_picture *picture;

	link_heard(run->link);
	picture = link_take(run->link);
	if (picture == NULL) {
		link_state(run->link, &state);
		if (state.phase == LINK_REFUSED || state.phase == LINK_LOST)
			report_die("link", state.error.text);
		return 0;
	}
	run->n_pictures++;
	const int is_sharp = picture->is_sharp && picture->wish == wish;

	if (view_show_take(run->show, picture, NULL, &err) != PSR_OK)
		report_die("picture", err.text);
	return is_sharp;
}

static void sleep_until(uint64_t then_ns)
{
	const uint64_t now_ns = clock_ns();

	if (then_ns > now_ns)
		usleep((useconds_t)((then_ns - now_ns) / 1000));
}

/* The received picture as it is: its middle, pixel by pixel. */
static void keep_unwarped(uint8_t *to, const struct link_picture *picture)
{
	const struct psr_frame *frame = &picture->frame;

	for (int64_t y = 0; y < HEIGHT; y++)
		for (int64_t x = 0; x < WIDTH; x++) {
			const int64_t sx = x + ((int64_t)frame->width - WIDTH) / 2, sy = y + ((int64_t)frame->height - HEIGHT) / 2;

			memcpy(to + 3 * (y * WIDTH + x), frame->rgb + 3 * (sy * frame->width + sx), 3);
		}
}

static void keep_sample(struct run *run, const struct psr_frame *shown)
{
	struct sample *sample = &run->sample[run->n_samples++];

	sample->camera = run->hand.camera;
	sample->warped = report_alloc(3, WIDTH * HEIGHT);
	sample->unwarped = report_alloc(3, WIDTH * HEIGHT);
	memcpy(sample->warped, shown->rgb, (size_t)3 * WIDTH * HEIGHT);
	keep_unwarped(sample->unwarped, view_show_picture(run->show));
}

static void show_frame(struct run *run)
{
	struct view_shown shown;
	struct psr_error err;
	const struct psr_frame *frame =
		view_show_draw(run->show, &run->hand.camera, WIDTH, HEIGHT, &shown, &err);
	const uint64_t of = view_show_picture(run->show)->wish;

	if (frame == NULL)
		report_die("show", err.text);
	if (run->n_frames == MOST_FRAMES)
		return;
	run->warp_ms[run->n_frames] = shown.warp.ms;
	run->filled[run->n_frames] = 100 * shown.warp.filled;
	run->age_ms[run->n_frames] = of >= run->first_wish && of - run->first_wish < MOST_WISHES
	                             ? (double)(clock_ns() - run->wished_ns[of - run->first_wish]) * MS : 0;
	if (run->n_frames++ % SAMPLE_EVERY == SAMPLE_EVERY - 1)
		keep_sample(run, frame);
}

/* ---- a run ---- */

static void wait_sharp(struct run *run, double most_s, const char *what)
{
	const uint64_t start_ns = clock_ns();
	const uint64_t number = link_wish(run->link, &run->wish);

	while (!hear(run, number)) {
		if ((double)(clock_ns() - start_ns) * 1e-9 > most_s)
			report_die(what, "no sharp picture came");
		usleep(1000);
	}
}

static void begin(struct run *run, const struct movement *movement, const char *address, struct psr_model *model)
{
	const struct psr_model_info *info = psr_model_info(model);
	static const double up[3] = { 0, 1, 0 };
	static const struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0.55, -0.6, -0.85 },
		                                    .color = { 1, 1, 1 } };
	struct psr_error err;

	run->movement = movement;
	snprintf(run->instance.model, sizeof run->instance.model, "%s", movement->model);
	run->instance.rotation[3] = run->instance.scale = 1;
	if (hand_init(&run->hand, info->box_min, info->box_max, up, FOV, &err) != PSR_OK
	    || link_open(&run->link, address, "latency", &err) != PSR_OK || view_show_create(&run->show, 2, &err) != PSR_OK
	    || psr_pool_create(&run->pool, 0, &err) != PSR_OK)
		report_die(movement->name, err.text);
	hand_set_size(&run->hand, WIDTH, HEIGHT);
	hand_set_pose(&run->hand, &run->path.pose[0].pose);
	link_wish_default(&run->wish);
	run->wish.instance = &run->instance;
	run->wish.n_instances = 1;
	run->wish.width = WIDTH;
	run->wish.height = HEIGHT;
	run->wish.overscan = OVERSCAN;
	run->wish.has_key_light = 0; /* lights stand still: what is true does not change but by the camera */
	psr_msg_light_set(&run->wish.light[0], &light);
	say_wish(run);
	wait_sharp(run, 60, movement->name);
}

static void move(struct run *run)
{
	const uint64_t start_ns = clock_ns();
	const double end_s = path_seconds(&run->path);
	double t = 0;

	run->n_pictures = 0;
	for (int frame = 0; t < end_s; frame++) {
		struct hand_pose pose;

		t = (double)(clock_ns() - start_ns) * 1e-9;
		path_at(&run->path, t, &pose);
		hand_set_pose(&run->hand, &pose);
		say_wish(run);
		hear(run, 0);
		show_frame(run);
		sleep_until(start_ns + (uint64_t)((frame + 1) * 1e9 / FPS));
	}
	say_wish(run);
}

/* Medians of the samples' PSNR. */
static void compare(struct run *run, struct psr_model *model, double *warped, double *unwarped)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	double a[MOST_FRAMES], b[MOST_FRAMES];
	struct psr_light light;
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1 };
	struct psr_renderer *renderer;
	struct psr_settings settings;
	struct psr_frame truth;
	struct psr_error err;

	psr_msg_light_get(&light, &run->wish.light[0]);
	for (int c = 0; c < 3; c++) {
		scene.ambient[c] = run->wish.ambient;
		scene.background[c] = psr_srgb_to_linear[run->wish.background[c]];
	}
	psr_settings_default(&settings, WIDTH, HEIGHT);
	settings.smooth = run->wish.is_smooth;
	if (psr_renderer_create(&renderer, &err) != PSR_OK
	    || psr_frame_alloc(&truth, WIDTH, HEIGHT, 1 << PSR_PLANE_COLOR | 1 << PSR_PLANE_DEPTH, &err) != PSR_OK)
		report_die("truth", err.text);
	for (int i = 0; i < run->n_samples; i++) {
		scene.camera = run->sample[i].camera;
		if (psr_render(renderer, &scene, &settings, run->pool, &truth, &err) != PSR_OK)
			report_die("truth", err.text);
		a[i] = psnr(&truth, run->sample[i].warped);
		b[i] = psnr(&truth, run->sample[i].unwarped);
		free(run->sample[i].warped);
		free(run->sample[i].unwarped);
	}
	*warped = stats_median(a, (size_t)run->n_samples);
	*unwarped = stats_median(b, (size_t)run->n_samples);
	psr_frame_free(&truth);
	psr_renderer_destroy(renderer);
}

static void measure(const struct movement *movement, const char *address, const char *folder, const char *hands)
{
	struct run *run = report_alloc(1, sizeof *run);
	struct psr_model *model;
	struct psr_error err;
	double warped, unwarped;
	char path[4096];

	snprintf(path, sizeof path, "%s/%s.psr", folder, movement->model);
	if (psr_model_read(&model, path, &err) != PSR_OK)
		report_die(path, err.text);
	snprintf(path, sizeof path, "%s/%s.json", hands, movement->name);
	if (path_read(&run->path, path, &err) != PSR_OK)
		report_die("hand", err.text);
	begin(run, movement, address, model);
	const uint64_t start_ns = clock_ns();
	move(run);
	const uint64_t stop_ns = clock_ns();
	const double pictures = run->n_pictures / path_seconds(&run->path);
	const double shown = run->n_frames / ((double)(stop_ns - start_ns) * 1e-9);

	wait_sharp(run, 60, movement->name);
	const double sharp_ms = (double)(clock_ns() - stop_ns) * MS;

	compare(run, model, &warped, &unwarped);
	printf("%-8s %6.1f %8.1f %6.0f %6.1f %7.2f %8.1f %9.1f %6.1f %8.0f\n", movement->name, shown, pictures,
	       stats_median(run->age_ms, (size_t)run->n_frames), stats_median(run->warp_ms, (size_t)run->n_frames),
	       stats_median(run->filled, (size_t)run->n_frames), warped, unwarped, warped - unwarped, sharp_ms);
	fflush(stdout);
	link_close(run->link);
	view_show_destroy(run->show);
	psr_pool_destroy(run->pool);
	path_fini(&run->path);
	psr_model_unref(model);
	free(run);
}

int main(int argc, char **argv)
{
	if (argc < 4) {
		fprintf(stderr, "usage: latency ADDRESS MODELS HANDS [MOVEMENT...]\n");
		return 2;
	}
	for (size_t i = 0; i < sizeof movements / sizeof movements[0]; i++) {
		int is_asked = argc == 4;

		for (int k = 4; k < argc; k++)
			is_asked |= strcmp(argv[k], movements[i].name) == 0;
		if (is_asked)
			measure(&movements[i], argv[1], argv[2], argv[3]);
	}
	return 0;
}
