/* first [-c] BIN FOLDER [FILE...]: what passes between `psr view FILE` and its first picture, which is of a coarse model,
 * step by step. Without files: a ball of a million triangles, written to FOLDER in five formats.
 * BIN: the folder of psrd and psr-model.
 *
 * -c: from OPEN on, when psrd runs already, with the file out of memory, and then in it; beside what reading the file
 * takes alone. A model (.psr) has another target than a file that becomes one. */
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
#include "cold.h"
#include "first_mesh.h"
#include "report.h"

#define WIDTH 1280
#define HEIGHT 720
#define FOV 35
#define TARGET_S 2.0
#define TARGET_OPEN_S 1.0  /* from OPEN, of a model */
#define TARGET_BUILD_S 5.0 /* of what is built meanwhile */
#define PATIENCE_S 60.0
#define POLL_MS 2
#define RUNS 3

/* Seconds since psr view began; NAN: not yet. */
struct times {
	double psrd, asked, sample, write, opened, picture;
};

static double began;
static int has_stayed; /* some of a file that was to be out of memory */

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

static void drop(const char *file)
{
	uint64_t n_left, n_pages;
	struct psr_error err;

	if (cold_drop(&n_left, &n_pages, file, &err) != PSR_OK)
		report_die(file, err.text);
	if (n_left > 0)
		printf("%s: %llu of %llu pages stayed in memory\n", file, (unsigned long long)n_left, (unsigned long long)n_pages);
	has_stayed |= n_left > 0;
}

static struct times view(const char *file, int is_cold)
{
	struct times times = { NAN, NAN, NAN, NAN, NAN, NAN };
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
	if (is_cold)
		drop(file);
	note(&times.asked);
	link_wish(link, &wish);
	watch(&times, link, &wish);
	link_close(link);
	home_close(home);
	return times;
}

/* Of RUNS runs, each with an empty cache, the one with the median time from OPEN to the picture. */
static struct times median_of(const char *file, const char *folder, int is_cold)
{
	char cache[4096], remove[4200];
	struct times times[RUNS];

	for (int i = 0; i < RUNS; i++) {
		snprintf(cache, sizeof cache, "%s/cache", folder);
		snprintf(remove, sizeof remove, "rm -rf '%s'", cache);
		if (system(remove) != 0 || setenv("XDG_CACHE_HOME", cache, 1) != 0)
			report_die(cache, "cannot be emptied");
		times[i] = view(file, is_cold);
		for (int k = i; k > 0 && times[k].picture - times[k].asked < times[k - 1].picture - times[k - 1].asked; k--) {
			const struct times swap = times[k];

			times[k] = times[k - 1];
			times[k - 1] = swap;
		}
	}
	return times[RUNS / 2];
}

static const char *name_of(const char *file)
{
	const char *slash = strrchr(file, '/');

	return slash != NULL ? slash + 1 : file;
}

static void measure(const char *file, const char *folder)
{
	const struct times t = median_of(file, folder, 0);

	printf("%-20s %6.2f %6.2f %6.2f %6.2f %6.2f | %7.2f\n", name_of(file), t.psrd, t.sample - t.psrd, t.write - t.sample,
	       t.opened - t.write, t.picture - t.opened, t.picture);
	fflush(stdout);
	report_target(name_of(file), t.picture, "s", REPORT_AT_MOST, TARGET_S);
}

static void measure_cold(const char *file, const char *folder)
{
	const size_t n = strlen(file);
	const int is_model = n > 4 && strcmp(file + n - 4, ".psr") == 0;
	char name[256];

	for (int is_cold = 1; is_cold >= 0; is_cold--) {
		struct psr_error err;
		double seconds;
		uint64_t n_bytes;

		has_stayed = 0;
		if (is_cold)
			drop(file);
		if (cold_read(&seconds, &n_bytes, file, &err) != PSR_OK)
			report_die(file, err.text);
		const struct times t = median_of(file, folder, is_cold);
		snprintf(name, sizeof name, "%.200s, %s", name_of(file), !is_cold ? "warm" : has_stayed ? "not cold" : "cold");
		printf("%-28s %8.1f %6.2f %6.0f | %6.2f %6.2f | %7.2f\n", name, (double)n_bytes * 1e-6, seconds,
		       (double)n_bytes * 1e-6 / seconds, t.opened - t.asked, t.picture - t.opened, t.picture - t.asked);
		fflush(stdout);
		report_target(name, t.picture - t.asked, "s", REPORT_AT_MOST, is_model ? TARGET_OPEN_S : TARGET_BUILD_S);
	}
}

static int print_usage(void)
{
	fprintf(stderr, "usage: first [-c] BIN FOLDER [FILE...]; -c needs files\n");
	return 2;
}

int main(int argc, char **argv)
{
	const int is_cold = argc > 1 && strcmp(argv[1], "-c") == 0;
	char path[8192];
	struct psr_error err;

	argc -= is_cold;
	argv += is_cold;
	if (argc < 3 + is_cold)
		return print_usage();
	snprintf(path, sizeof path, "%s:%s", argv[1], getenv("PATH") != NULL ? getenv("PATH") : "");
	setenv("PATH", path, 1);
	if (is_cold) {
		printf("Seconds from OPEN to the first picture, %dx%d, and of reading the file alone\n", WIDTH, HEIGHT);
		printf("%-28s %8s %6s %6s | %6s %6s | %7s\n", "file", "MB", "read", "MB/s", "opened", "draw", "picture");
	} else {
		printf("Seconds from psr view FILE to its first picture, %dx%d, with an empty cache\n", WIDTH, HEIGHT);
		printf("%-20s %6s %6s %6s %6s %6s | %7s\n", "file", "psrd", "import", "sample", "load", "draw", "picture");
	}
	for (int i = 3; i < argc; i++)
		(is_cold ? measure_cold : measure)(argv[i], argv[2]);
	for (int i = 0; argc == 3 && i < FIRST_MESH_FORMATS; i++) {
		if (first_mesh_write(path, sizeof path, argv[2], i, &err) != PSR_OK)
			report_die(argv[2], err.text);
		measure(path, argv[2]);
	}
	report_print_targets();
	return 0;
}
