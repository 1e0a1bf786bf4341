/* A small frame beside large ones; the sharp frame at rest. */
#include "daemon.h"

#include <math.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/random.h"
#include "base/stats.h"
#include "model/blocks.h"
#include "report.h"

#define SMALL 256
#define PASSES 4
#define REFRESH_NS 33333333 /* between requests of a viewer that moves */
#define WORST_INSTANCES 870
#define MOST_BLOCKS ((UINT64_C(1) << 26) - 1) /* of a scene */
#define WORST_SIDE 2048
#define MOST_TRIALS 2000
#define MOVES 8

/* ---- 1, 2: a small frame beside others ---- */

enum { ALONE, BUSY, PACED, OTHERS, MOST_LINKS = OTHERS + 2 };

struct beside {
	const struct daemon_bench *bench;
	struct daemon_server server;
	struct scene_film small, large;
	struct link link[MOST_LINKS]; /* small ones by themselves, beside others, at a viewer's rate; the others */
	unsigned n;
};

static void beside_start(struct beside *b, const struct daemon_bench *bench, const char *const *options,
                         const uint32_t large[2])
{
	*b = (struct beside){ .bench = bench, .n = OTHERS };
	daemon_start(&b->server, bench, options);
	daemon_film(&b->small, bench, SMALL, SMALL);
	daemon_film(&b->large, bench, large[0], large[1]);
	for (int i = 0; i < OTHERS; i++) {
		link_connect(&b->link[i], &b->server, &b->small);
		link_frame(&b->link[i], SMALL, SMALL);
	}
	b->link[PACED].period_ns = REFRESH_NS;
}

static struct link *beside_add(struct beside *b)
{
	struct link *link = &b->link[b->n++];

	link_connect(link, &b->server, &b->large);
	link_frame(link, b->large.picture.width, b->large.picture.height);
	return link;
}

/* One of the small ones asks for so long, beside whatever the others do. */
static void beside_run(struct beside *b, int i, double seconds)
{
	b->link[i].n_wanted = 1;
	links_run(b->link, b->n, seconds);
	b->link[i].n_wanted = 0;
}

static void beside_print(struct beside *b)
{
	const double alone_ms = link_percentile(&b->link[ALONE], 0.5);
	struct link *busy = &b->link[BUSY];

	daemon_figure(b->bench, "p99 / median alone", "x", link_percentile(busy, 0.99) / alone_ms, DAEMON_AT_MOST, 4);
	daemon_figure(b->bench, "median alone", "ms", alone_ms, DAEMON_NO_BOUND, 0);
	daemon_figure(b->bench, "p99 alone / median alone", "x", link_percentile(&b->link[ALONE], 0.99) / alone_ms,
	              DAEMON_NO_BOUND, 0);
	daemon_figure(b->bench, "p50 / median alone", "x", link_percentile(busy, 0.5) / alone_ms, DAEMON_NO_BOUND, 0);
	daemon_figure(b->bench, "max / median alone", "x", link_percentile(busy, 1) / alone_ms, DAEMON_NO_BOUND, 0);
	daemon_figure(b->bench, "frames", "", busy->n_done, DAEMON_NO_BOUND, 0);
	daemon_figure(b->bench, "p99 / median alone, 30 frames/s", "x", link_percentile(&b->link[PACED], 0.99) / alone_ms,
	              DAEMON_NO_BOUND, 0);
}

/* The others are not there yet; start() adds them. They are measured alone before and after. */
static void beside_measure(struct beside *b, void (*start)(struct beside *b))
{
	const double seconds = b->bench->seconds;

	beside_run(b, ALONE, seconds / 4);
	links_forget(b->link, OTHERS);
	beside_run(b, ALONE, seconds / 2);
	start(b);
	beside_run(b, BUSY, seconds / 4);
	links_forget(&b->link[BUSY], 1);
	beside_run(b, BUSY, seconds);
	beside_run(b, PACED, seconds);
	while (b->n > OTHERS) {
		struct link *other = &b->link[--b->n];

		if (other->n_failed > 0)
			report_die("the others' frames", other->error.text);
		link_close(other);
	}
	beside_run(b, ALONE, seconds / 2);
	beside_print(b);
	for (int i = 0; i < OTHERS; i++)
		link_close(&b->link[i]);
	daemon_stop(&b->server);
}

static void start_stills(struct beside *b)
{
	for (int i = 0; i < 2; i++) {
		struct link *still = beside_add(b);

		still->frame.pass_limit = PASSES;
		still->n_wanted = 1;
	}
}

void daemon_beside_stills(struct daemon_bench *bench)
{
	static const char *const options[] = { NULL };
	static const uint32_t size[2] = { 1920, 1080 };
	struct beside b;

	beside_start(&b, bench, options, size);
	beside_measure(&b, start_stills);
}

/* Within all limits, and takes as long as any request: most of its lights need six maps. */
static void send_worst_scene(struct link *link, const struct scene_film *film)
{
	static struct psr_instance instance[WORST_INSTANCES];
	const struct psr_model_info *info = psr_model_info(film->model);
	struct psr_light light[PSR_WIRE_MAX_LIGHTS] = { film->light };
	const uint64_t n_fitting = MOST_BLOCKS / psr_model_blocks(film->model)->n_blocks;
	const uint32_t n_instances = n_fitting < WORST_INSTANCES ? (uint32_t)n_fitting : WORST_INSTANCES;
	struct psr_scene scene;
	uint64_t seed = 1;

	scene_film_frame(&scene, film, 0);
	scene_spread(instance, film, film->model, n_instances);
	light[0].casts_shadow = 1;
	for (int l = 1; l < PSR_WIRE_MAX_LIGHTS; l++) {
		light[l] = (struct psr_light){ .kind = PSR_LIGHT_POINT, .color = { 0.1, 0.1, 0.1 }, .casts_shadow = 1 };
		for (int k = 0; k < 3; k++)
			light[l].position[k] = info->origin[k] + random_in(&seed, -0.6, 0.6) * info->scale;
	}
	scene.instance = instance;
	scene.n_instances = n_instances;
	scene.light = light;
	scene.n_lights = PSR_WIRE_MAX_LIGHTS;
	link_scene(link, &scene);
}

static void start_worst(struct beside *b)
{
	struct link *worst = beside_add(b);

	send_worst_scene(worst, &b->large);
	worst->frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	worst->frame.settings = (struct psr_msg_settings){ .scale = 1, .spacing_px = 1.0 / 64 };
	worst->n_wanted = 1;
}

void daemon_beside_worst(struct daemon_bench *bench)
{
	static const char *const without_limit[] = { "--frame-timeout", "3600", NULL }, *const none[] = { NULL };
	static const uint32_t size[2] = { WORST_SIDE, WORST_SIDE };
	struct beside b;

	beside_start(&b, bench, bench->build == 0 ? without_limit : none, size);
	beside_measure(&b, start_worst);
}

/* ---- 9: the sharp frame ---- */

/* A viewer moves, then rests. Returns ms from its last request to its sharp frame's end. */
static double rest_once(struct link *viewer)
{
	uint32_t id = 0;
	uint64_t start_ns = 0;

	for (int i = 0; i < MOVES; i++) {
		id = link_ask(viewer);
		start_ns = clock_ns();
		if (i + 1 < MOVES)
			links_run(viewer, 1, REFRESH_NS * 1e-9);
	}
	while (viewer->last_id != id || viewer->last_pass < 1) {
		if (viewer->is_lost || viewer->n_open == 0)
			report_die("the sharp frame", viewer->error.text);
		links_run(viewer, 1, 0.005);
	}
	return (double)(viewer->last_ns - start_ns) * 1e-6;
}

void daemon_at_rest(struct daemon_bench *bench)
{
	static const char *const options[] = { NULL };
	static double ms[MOST_TRIALS];
	struct daemon_server server;
	struct scene_film film;
	struct link viewer;
	size_t n = 0;

	daemon_start(&server, bench, options);
	if (server.minor >= 2) {
		const uint64_t start_ns = clock_ns();

		daemon_film(&film, bench, 1920, 1080);
		link_connect(&viewer, &server, &film);
		link_frame(&viewer, 1920, 1080);
		viewer.view = 1;
		viewer.frame.flags = PSR_WIRE_FRAME_SHARP;
		viewer.frame.pass_limit = PASSES;
		viewer.frame.budget = PSR_WIRE_BUDGET_SETTINGS;
		viewer.frame.settings = (struct psr_msg_settings){ .scale = 2, .spacing_px = 1 };
		while (n < MOST_TRIALS && (double)(clock_ns() - start_ns) * 1e-9 < 2 * bench->seconds)
			ms[n++] = rest_once(&viewer);
		link_close(&viewer);
		stats_sort(ms, n);
		daemon_figure(bench, "last request to sharp frame, p50", "s", stats_percentile(ms, n, 0.5) * 1e-3,
		              DAEMON_AT_MOST, 0.3);
		daemon_figure(bench, "last request to sharp frame, p99", "s", stats_percentile(ms, n, 0.99) * 1e-3,
		              DAEMON_AT_MOST, 0.3);
	}
	daemon_stop(&server);
}
