/* first BIN FOLDER [FILE...]: what passes between `psr view FILE` and its first picture, which is of a coarse model,
 * step by step. Without files: a ball of a million triangles, written to FOLDER in five formats.
 * BIN: the folder of psrd and psr-model. */
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "client/view/hand.h"
#include "client/home/home.h"
#include "client/view/link.h"
#include "first_mesh.h"
#include "report.h"

#define WIDTH 1280
#define HEIGHT 720
#define FOV 35
#define TARGET_S 2.0
#define PATIENCE_S 60.0
#define POLL_MS 2
#define RUNS 3

/* Seconds since psr view began; NAN: not yet. */
struct times {
	double psrd, sample, write, opened, picture;
};

static double began;

static void note(double *time)
{
	if (isnan(*time))
		*time = clock_seconds() - began;
}

static void note_progress(struct times *times, const struct link_state *state)
{
	if (state->phase != LINK_OPENING)
		return;
	if (state->progress.stage >= PSR_PROGRESS_SAMPLE)
		note(&times->sample);
	if (state->progress.stage >= PSR_PROGRESS_WRITE)
		note(&times->write);
}

/* The whole scene from the front, as psr view begins. */
static void look_at(struct link_wish *wish, struct link_scene *scene)
{
	struct psr_error err;
	struct hand hand;

	if (hand_init(&hand, scene->box_min, scene->box_max, scene->up, FOV, &err) != PSR_OK)
		report_die("hand", err.text);
	hand_set_size(&hand, WIDTH, HEIGHT);
	hand_home(&hand);
	wish->camera = hand.camera;
	wish->width = WIDTH;
	wish->height = HEIGHT;
	wish->pixels = WIDTH;
	wish->is_rest = 1;
	link_scene_free(scene);
}

static void watch(struct times *times, struct link *link, struct link_wish *wish)
{
	struct link_state state;

	while (isnan(times->picture)) {
		struct pollfd waits = { .fd = link_fd(link), .events = POLLIN };
		struct link_picture *picture;
		struct link_scene *scene;

		poll(&waits, 1, POLL_MS);
		link_heard(link);
		link_state(link, &state);
		if (state.phase == LINK_REFUSED || clock_seconds() - began > PATIENCE_S)
			report_die(wish->instance[0].model, state.error.text);
		note_progress(times, &state);
		scene = link_scene_take(link);
		if (scene != NULL) {
			note(&times->opened);
			look_at(wish, scene);
			link_wish(link, wish);
		}
		picture = link_take(link);
		if (picture != NULL)
			note(&times->picture);
		link_release(picture);
	}
}

static struct times view(const char *file)
{
	struct times times = { NAN, NAN, NAN, NAN, NAN };
	struct link_instance instance = { .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct link_wish wish;
	struct psr_error err;
	struct home *home;
	struct link *link;

	began = clock_seconds();
	if (home_open(&home, file, &err) != PSR_OK || link_open(&link, home_address(home), "bench", &err) != PSR_OK)
		report_die(file, err.text);
	note(&times.psrd);
	link_wish_default(&wish);
	strcpy(instance.model, home_model(home));
	wish.instance = &instance;
	wish.n_instances = 1;
	wish.coarse_pixels = HOME_COARSE_PIXELS;
	link_wish(link, &wish);
	watch(&times, link, &wish);
	link_close(link);
	home_close(home);
	return times;
}

/* Of RUNS runs, each with an empty cache, the one with the median time. */
static void measure(const char *file, const char *folder)
{
	char cache[4096], remove[4200];
	struct times times[RUNS];
	const char *slash = strrchr(file, '/');

	for (int i = 0; i < RUNS; i++) {
		snprintf(cache, sizeof cache, "%s/cache", folder);
		snprintf(remove, sizeof remove, "rm -rf '%s'", cache);
		if (system(remove) != 0 || setenv("XDG_CACHE_HOME", cache, 1) != 0)
			report_die(cache, "cannot be emptied");
		times[i] = view(file);
		for (int k = i; k > 0 && times[k].picture < times[k - 1].picture; k--) {
			const struct times swap = times[k];

			times[k] = times[k - 1];
			times[k - 1] = swap;
		}
	}
	const struct times *t = &times[RUNS / 2];

	printf("%-20s %6.2f %6.2f %6.2f %6.2f %6.2f | %7.2f\n", slash != NULL ? slash + 1 : file, t->psrd,
	       t->sample - t->psrd, t->write - t->sample, t->opened - t->write, t->picture - t->opened, t->picture);
	fflush(stdout);
	report_target(slash != NULL ? slash + 1 : file, t->picture, "s", REPORT_AT_MOST, TARGET_S);
}

int main(int argc, char **argv)
{
	char path[8192];
	struct psr_error err;

	if (argc < 3) {
		fprintf(stderr, "usage: first BIN FOLDER [FILE...]\n");
		return 2;
	}
	snprintf(path, sizeof path, "%s:%s", argv[1], getenv("PATH") != NULL ? getenv("PATH") : "");
	setenv("PATH", path, 1);
	printf("Seconds from psr view FILE to its first picture, %dx%d, with an empty cache\n", WIDTH, HEIGHT);
	printf("%-20s %6s %6s %6s %6s %6s | %7s\n", "file", "psrd", "import", "sample", "load", "draw", "picture");
	for (int i = 3; i < argc; i++)
		measure(argv[i], argv[2]);
	for (int i = 0; argc == 3 && i < FIRST_MESH_FORMATS; i++) {
		if (first_mesh_write(path, sizeof path, argv[2], i, &err) != PSR_OK)
			report_die(argv[2], err.text);
		measure(path, argv[2]);
	}
	report_print_targets();
	return 0;
}
