/* A model of 100 million samples in memory: what it takes, and how long its frames take, beside bounds that follow from
 * what a frame looks at. Prints a table; fails if a bound is broken. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <sys/resource.h>
#include "base/clock.h"
#include "tests/hard/lib/blocks.h"

#define GROUPS 136 /* a side: 136^2 groups of 85 blocks in 4 levels are 100,618,240 samples */
#define LEVELS 4
#define SIDE 1024
#define FRAMES 5

/* Bytes: of a sample 8 of attributes, 2 of depth, and a 64th of its block's 30 (docs/format.md) and of a cluster's; of
 * a renderer a pixel's word, weight, colours and cells, and a hit, three entries and a place in its order for each
 * block, where all are in view in three tiles. */
#define SAMPLE_BYTES 12
#define PIXEL_BYTES 64
#define BLOCK_BYTES (24 + 3 * 12 + 8)

/* Nanoseconds, on one thread of a slow machine: of a sample drawn, a pixel, a cluster in the model and a block tested.
 * */
#define SAMPLE_NS 20
#define PIXEL_NS 150
#define CLUSTER_NS 100
#define TESTED_NS 50

static int line(const char *name, const char *unit, double is, double most)
{
	printf("%-28s %10.1f of %10.1f %s%s\n", name, is, most, unit, is <= most ? "" : "  EXCEEDED");
	return is <= most;
}

/* Draws from a distance, in units of the sheet's side, at an angle from above; the fastest of some frames counts. */
static int view(struct psr_renderer *renderer, const struct psr_model *model, double distance, double degrees)
{
	struct psr_instance instance = hard_place(model);
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0.3, 0.2, -1 }, .color = { 1, 1, 1 } };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1 };
	struct psr_settings settings;
	struct psr_frame frame;
	struct psr_error err;
	char name[64];
	double best = INFINITY;
	const double a = degrees * 3.14159265358979323846 / 180;

	scene.camera = (struct psr_camera){ .eye = { 0, -distance * sin(a), distance * cos(a) }, .up = { 0, 1, 0.001 },
		                                .fov_y = 0.6 };
	psr_settings_default(&settings, SIDE, SIDE);
	if (psr_frame_alloc(&frame, SIDE, SIDE, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, &err))
		return 0;
	for (int i = 0; i < FRAMES; i++) {
		const uint64_t start = clock_ns();

		if (psr_render(renderer, &scene, &settings, NULL, &frame, &err)) {
			fprintf(stderr, "%s\n", err.text);
			return 0;
		}
		best = fmin(best, (double)(clock_ns() - start) / 1e6);
	}
	const struct psr_report *r = &frame.report;
	const double n_clusters = psr_model_blocks(model)->n_clusters;
	const double most = ((double)r->n_samples_drawn * SAMPLE_NS + SIDE * SIDE * (double)PIXEL_NS
	                     + n_clusters * CLUSTER_NS + (double)r->count[PSR_STAGE_CULL] * TESTED_NS) / 1e6;
	snprintf(name, sizeof name, "frame: distance %g, %g deg", distance, degrees);
	int is_good = line(name, "ms", best, most);
	/* A level has at most a pixel between samples where it is furthest apart, and a quarter of the next's samples: less
	 * than 4 / 0.866 a pixel face on, 1 / cos of that where it slants, and as much again for whole clusters at borders.
	 * */
	if (r->levels == 1)
		is_good &= line("    samples a pixel", "", (double)r->n_samples_drawn / (SIDE * SIDE), 2 * 4 / 0.866 / cos(a));
	printf("    %llu samples drawn, %llu covered pixels, %u clamped blocks\n", (unsigned long long)r->n_samples_drawn,
	       (unsigned long long)r->n_covered, r->n_clamped);
	psr_frame_free(&frame);
	return is_good;
}

int main(void)
{
	const uint64_t attr = hard_attr((const double[3]){ 0, 0, 1 }, 0, 0);
	const struct hard_sheet sheet = {
		.spacing = 1.3 / (GROUPS * 64), .groups = GROUPS, .levels = LEVELS, .attr = attr,
	};
	struct psr_renderer *renderer;
	struct rusage usage;
	uint64_t start = clock_ns();
	struct psr_model *model = hard_sheet(&sheet);
	const struct psr_blocks *b = psr_model_blocks(model);
	int is_good;

	printf("%llu samples in %u blocks, made in %.1f s\n", (unsigned long long)b->n_samples, b->n_blocks,
	       (double)(clock_ns() - start) / 1e9);
	if (b->n_samples < 100000000 || psr_renderer_create(&renderer, NULL))
		return 1;
	is_good = line("model", "MB", (double)psr_model_bytes(model) / 1e6, (double)b->n_samples * SAMPLE_BYTES / 1e6);
	is_good &= view(renderer, model, 2.2, 0);
	is_good &= view(renderer, model, 0.5, 0);
	is_good &= view(renderer, model, 0.05, 0);
	is_good &= view(renderer, model, 0.005, 0);
	is_good &= view(renderer, model, 0.6, 60);
	is_good &= view(renderer, model, 0.1, 80);
	is_good &= line("renderer", "MB", (double)psr_renderer_bytes(renderer) / 1e6,
	                (SIDE * SIDE * (double)PIXEL_BYTES + b->n_blocks * (double)BLOCK_BYTES) / 1e6);
	getrusage(RUSAGE_SELF, &usage);
	printf("%-28s %10.1f MB, most of it the blocks that the model was made from\n", "process, at its greatest",
	       (double)usage.ru_maxrss / 1024);
	psr_renderer_destroy(renderer);
	psr_model_unref(model);
	return !is_good;
}
