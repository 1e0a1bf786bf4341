/* cancel PSR-MODEL MODELS CACHE [SECONDS [SCENE...]]: how long psr_render() goes on once its frame is cancelled. MODELS
 * takes models that are built once; CACHE has the real meshes. SECONDS: about how long each scene is tried, 10 without
 * it. SCENE...: names of the table's rows, all without any. */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/random.h"
#include "base/stats.h"
#include "model/blocks.h"
#include "ours.h"
#include "report.h"
#include "scene.h"

#define MOST_TRIALS 4000
#define TARGET_MS 2
#define MOST_WAIT_MS 1000
#define WORST_INSTANCES 870
#define MOST_BLOCKS ((UINT64_C(1) << 26) - 1)

/* What is drawn, over and over. */
struct subject {
	const char *name;
	struct psr_instance instance[PSR_MAX_INSTANCES];
	struct psr_light light[PSR_MAX_LIGHTS];
	struct psr_scene scene;
	struct psr_settings settings;
};

struct bench {
	struct psr_pool *pool;
	struct psr_renderer *renderer;
	struct psr_frame frame;
	uint64_t seed;
	double seconds;
	char **names; /* of scenes that are asked for, or none */
	int n_names;
};

/* ---- subjects ---- */

static void subject_init(struct subject *s, const char *name, struct psr_model *model, uint32_t n_instances)
{
	static const double straight[3];
	const struct scene_picture picture = { "", 1920, 1080, 0 };
	struct scene_film film;

	memset(s, 0, sizeof *s);
	s->name = name;
	scene_film_init(&film, &picture, model, straight);
	scene_film_frame(&s->scene, &film, 0);
	if (n_instances == 1)
		s->instance[0] = film.instance;
	else
		scene_spread(s->instance, &film, model, n_instances);
	s->light[0] = film.light;
	s->scene.instance = s->instance;
	s->scene.n_instances = n_instances;
	s->scene.light = s->light;
	psr_settings_default(&s->settings, picture.width, picture.height);
}

/* Adds lights around the model, most of them so near that each needs six maps. */
static void add_lamps(struct subject *s, const struct psr_model *model, uint32_t n, uint64_t *seed)
{
	const struct psr_model_info *info = psr_model_info(model);

	s->light[0].casts_shadow = 1;
	for (uint32_t l = 1; l < n; l++) {
		s->light[l] = (struct psr_light){ .kind = PSR_LIGHT_POINT, .color = { 0.1, 0.1, 0.1 }, .casts_shadow = 1 };
		for (int k = 0; k < 3; k++)
			s->light[l].position[k] = info->origin[k] + random_in(seed, -0.6, 0.6) * info->scale;
	}
	s->scene.n_lights = n;
}

/* A request within all limits that takes as long as any. */
static void make_worst(struct subject *s, struct psr_model *model, uint32_t n_instances, uint64_t *seed)
{
	subject_init(s, "worst", model, n_instances);
	add_lamps(s, model, PSR_MAX_LIGHTS, seed);
	s->settings.width = s->settings.height = 2048;
	s->settings.spacing_px = 1.0 / 64;
}

/* ---- the longest stretch between two questions ---- */

static atomic_uint frame_number;
static _Atomic uint64_t longest_ns;

static uint64_t thread_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* Never cancels before the deadline. Processor time of the thread that asks: other programs do not count. */
static int note_stretch(void *userdata)
{
	static _Thread_local uint64_t last_ns;
	static _Thread_local unsigned last_frame;
	const uint64_t *deadline_ns = userdata, now_ns = thread_ns();
	const unsigned frame = atomic_load(&frame_number);
	uint64_t longest = atomic_load(&longest_ns);

	if (frame == last_frame) {
		const uint64_t stretch = now_ns - last_ns;

		while (stretch > longest && !atomic_compare_exchange_weak(&longest_ns, &longest, stretch))
			;
	}
	last_frame = frame;
	last_ns = thread_ns();
	return clock_ns() > *deadline_ns;
}

/* ---- trials ---- */

/* The next frame is to draw its shadow maps anew. */
static void move(struct subject *s)
{
	s->instance[0].translation[0] += 0.001 * s->instance[0].scale;
}

/* Draws a frame; it may be cancelled. */
static int draw(struct bench *bench, struct subject *s, struct psr_cancel cancel)
{
	struct psr_error err;

	s->settings.cancel = cancel;
	const int rc = psr_render(bench->renderer, &s->scene, &s->settings, bench->pool, &bench->frame, &err);
	if (rc != PSR_OK && rc != PSR_ERR_CANCELLED)
		report_die(s->name, err.text);
	return rc;
}

static uint64_t deadline_of(const struct bench *bench)
{
	return clock_ns() + (uint64_t)(bench->seconds * 1e9);
}

/* Of the second frame: the first one waits for memory. */
static void find_longest(struct bench *bench, struct subject *s)
{
	for (int i = 0; i < 2; i++) {
		uint64_t deadline_ns = deadline_of(bench);

		atomic_store(&longest_ns, 0);
		atomic_fetch_add(&frame_number, 1);
		note_stretch(&deadline_ns);
		draw(bench, s, (struct psr_cancel){ note_stretch, &deadline_ns });
		note_stretch(&deadline_ns);
	}
}

static int is_late(void *userdata)
{
	return clock_ns() > *(const uint64_t *)userdata;
}

/* Returns milliseconds of a frame, at most about MOST_WAIT_MS. */
static double time_frame(struct bench *bench, struct subject *s)
{
	const double start = report_ms();
	uint64_t deadline_ns = clock_ns() + (uint64_t)(MOST_WAIT_MS * 1e6);

	move(s);
	draw(bench, s, (struct psr_cancel){ is_late, &deadline_ns });
	return report_ms() - start;
}

struct canceller {
	pthread_t drawing;
	double after_ms;
	atomic_int is_cancelled;
	uint64_t wall_ns, processor_ns; /* when it was cancelled; the drawing thread's processor time */
};

static int is_cancelled(void *userdata)
{
	return atomic_load_explicit(&((struct canceller *)userdata)->is_cancelled, memory_order_relaxed);
}

static void *wait_and_cancel(void *userdata)
{
	struct canceller *c = userdata;
	const uint64_t ns = (uint64_t)(c->after_ms * 1e6);
	clockid_t clock;
	struct timespec t;

	nanosleep(&(struct timespec){ (time_t)(ns / 1000000000u), (long)(ns % 1000000000u) }, NULL);
	if (pthread_getcpuclockid(c->drawing, &clock) != 0 || clock_gettime(clock, &t) != 0)
		report_die("the drawing thread", "has no clock");
	c->processor_ns = (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
	c->wall_ns = clock_ns();
	atomic_store(&c->is_cancelled, 1);
	return NULL;
}

/* Milliseconds from the cancel to the end of a frame, and the processor time of the thread that draws. */
struct latencies {
	double wall[MOST_TRIALS], processor[MOST_TRIALS];
	size_t n;
};

static void try_once(struct latencies *to, struct bench *bench, struct subject *s, double after_ms)
{
	struct canceller canceller = { .drawing = pthread_self(), .after_ms = after_ms };
	pthread_t thread;

	if (pthread_create(&thread, NULL, wait_and_cancel, &canceller) != 0)
		report_die("a thread", "cannot be started");
	const int rc = draw(bench, s, (struct psr_cancel){ is_cancelled, &canceller });
	const uint64_t wall_ns = clock_ns(), processor_ns = thread_ns();
	pthread_join(thread, NULL);
	if (rc == PSR_OK) {
		move(s);
		return;
	}
	to->wall[to->n] = (double)(wall_ns - canceller.wall_ns) * 1e-6;
	to->processor[to->n++] = (double)(processor_ns - canceller.processor_ns) * 1e-6;
}

static double print_percentiles(double *ms, size_t n)
{
	stats_sort(ms, n);
	printf(" %8.3f %8.3f %8.3f", stats_percentile(ms, n, 0.5), stats_percentile(ms, n, 0.99),
	       stats_percentile(ms, n, 1));
	return stats_percentile(ms, n, 0.99);
}

/* In turn with all threads and with one. */
static void measure(struct bench *bench, struct subject *s)
{
	const size_t area = (size_t)s->settings.width * s->settings.height;
	struct latencies *all, *one;
	struct psr_pool *pool = bench->pool;
	int is_asked = bench->n_names <= 0;
	char name[64];

	for (int i = 0; i < bench->n_names; i++)
		is_asked |= strcmp(bench->names[i], s->name) == 0;
	if (!is_asked)
		return;
	bench->frame = (struct psr_frame){ .width = s->settings.width, .height = s->settings.height,
		                               .rgb = report_alloc(area, 3), .depth = report_alloc(area, 4) };
	all = report_alloc(1, sizeof *all);
	one = report_alloc(1, sizeof *one);
	find_longest(bench, s);
	const double frame_ms = time_frame(bench, s), start = report_ms();
	while (all->n < MOST_TRIALS && one->n < MOST_TRIALS && report_ms() - start < bench->seconds * 1000) {
		try_once(all, bench, s, random_in(&bench->seed, 0, frame_ms));
		bench->pool = NULL;
		try_once(one, bench, s, random_in(&bench->seed, 0, frame_ms));
		bench->pool = pool;
	}
	printf("%-8s %8.1f %6zu", s->name, frame_ms, all->n + one->n);
	const double p99 = print_percentiles(all->wall, all->n), p99_one = print_percentiles(one->processor, one->n);
	printf(" %8.3f\n", (double)longest_ns * 1e-6);
	fflush(stdout);
	snprintf(name, sizeof name, "%s, wall's clock", s->name);
	report_target(name, p99, "ms", REPORT_AT_MOST, TARGET_MS);
	snprintf(name, sizeof name, "%s, one thread", s->name);
	report_target(name, p99_one, "ms", REPORT_AT_MOST, TARGET_MS);
	free(bench->frame.rgb);
	free(bench->frame.depth);
	free(all);
	free(one);
}

static void measure_all(struct bench *bench, struct psr_model *model, struct psr_model *glass)
{
	const uint64_t n_fitting = MOST_BLOCKS / psr_model_blocks(model)->n_blocks;
	const uint32_t n_instances = n_fitting < WORST_INSTANCES ? (uint32_t)n_fitting : WORST_INSTANCES;
	struct subject *s = report_alloc(1, sizeof *s);

	subject_init(s, "plain", model, 1);
	measure(bench, s);
	subject_init(s, "smooth", model, 1);
	s->settings.smooth = 1;
	measure(bench, s);
	subject_init(s, "close", model, 1);
	s->scene.camera.fov_y /= 16;
	measure(bench, s);
	subject_init(s, "shadows", model, 1);
	add_lamps(s, model, 4, &bench->seed);
	measure(bench, s);
	subject_init(s, "glass", glass, 64);
	measure(bench, s);
	subject_init(s, "refined", model, 1);
	s->settings.pass = 2;
	measure(bench, s);
	subject_init(s, "crowd", model, n_instances);
	measure(bench, s);
	make_worst(s, model, n_instances, &bench->seed);
	measure(bench, s);
	free(s);
}

int main(int argc, char **argv)
{
	struct bench bench = { .seconds = argc > 4 ? atof(argv[4]) : 10, .seed = 1, .names = argv + 5, .n_names = argc - 5 };
	char source[4096];
	const char *name = "stanford";
	struct psr_model *model, *glass;
	struct psr_error err;

	if (argc < 4 || !(bench.seconds > 0)) {
		fprintf(stderr, "usage: cancel PSR-MODEL MODELS CACHE [SECONDS [SCENE...]]\n");
		return 2;
	}
	if (mkdir(argv[2], 0777) != 0 && access(argv[2], W_OK) != 0)
		report_die(argv[2], "cannot be made");
	snprintf(source, sizeof source, "%s/dragon.ply", argv[3]);
	if (access(source, R_OK) != 0)
		scene_standard(source, argv[1], argv[2], name = "teapot");
	model = scene_model(argv[1], argv[2], name, source, 1024);
	if (psr_model_read(&glass, "tests/golden/case.psr", &err) != PSR_OK)
		report_die("glass", err.text);
	if (psr_pool_create(&bench.pool, 0, &err) != PSR_OK || psr_renderer_create(&bench.renderer, &err) != PSR_OK)
		report_die("psr", err.text);
	printf("%s, %d threads: frames cancelled at a random time. Milliseconds from there to their end: by the wall's\n"
	       "clock with all threads, where other programs count, and in processor time with one thread. The longest\n"
	       "stretch is the processor time between any two questions of a thread in a whole frame.\n\n"
	       "%33s %26s %26s\n%-8s %8s %6s %8s %8s %8s %8s %8s %8s %8s\n", name, psr_pool_threads(bench.pool), "",
	       "all threads, wall", "one thread, processor", "", "frame", "tried", "p50", "p99", "max", "p50", "p99", "max",
	       "stretch");
	measure_all(&bench, model, glass);
	report_print_targets();
	psr_renderer_destroy(bench.renderer);
	psr_pool_destroy(bench.pool);
	psr_model_unref(model);
	psr_model_unref(glass);
	return 0;
}
