/* What drawing differential points costs: dpoint_draws [-n ROUNDS] [-t THREADS] [-i ISA] DPOINTS.psr
 *
 * Draws frames of 800x600, as [K] 6 does, from four directions and at some distances, with highlights and without
 * (gloss is taken from a copy of the points). Sets of instructions take turns, and times are medians; a ratio is that
 * of C's processor time to the set's. drawn: points of groups in view, a second of cull and warp together, as
 * octree_draws counts; all: points of the model, a second of whole frames, as [K] counts. Targets are those of two
 * threads with highlights. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "around.h"
#include "base/clock.h"
#include "base/stats.h"
#include "base/vec.h"
#include "model/points.h"
#include "model/tree.h"
#include "psr/render.h"
#include "simd/simd.h"

#define WIDTH 800
#define HEIGHT 600
#define N_THREADS 2
#define MOST_FRAMES 400
#define DIRECTIONS 4
#define TARGET_POINTS 30  /* millions drawn a second, a pixel of the model on one of the picture */
#define TARGET_FRAMES 400 /* a second, as the object fits the picture */

enum { DIFFUSE, SPECULAR, N_LOOKS };
static const char *const look_name[N_LOOKS] = { "diffuse", "specular" };

/* Of the distance at which all fits the picture; 0: where a pixel of the model is one of the picture. */
static const double distances[] = { 0, 1, 0.5 };
#define N_DISTANCES 3

struct times {
	double frame[MOST_FRAMES], cpu[MOST_FRAMES], drawn[MOST_FRAMES], stage[PSR_N_STAGES][MOST_FRAMES], covered;
	int n;
};

struct bench {
	struct psr_renderer *renderer[PSR_N_ISAS];
	struct psr_model *model[N_LOOKS];
	struct psr_pool *pool;
	struct psr_frame frame;
	int n_rounds;
	enum psr_isa most;
};

static int make_diffuse(struct psr_model **out, const struct psr_model *model, struct psr_error *err)
{
	const struct dpoint_set *of = psr_model_point_set(model);
	struct dpoint_set set = *of;
	struct dpoint_word *word = malloc(of->n_points * sizeof *word);
	int rc;

	if (word == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u points", of->n_points);
	for (uint32_t i = 0; i < of->n_points; i++) {
		word[i] = of->word[i];
		word[i].attr &= (UINT64_C(1) << 40) - 1;
	}
	set.word = word;
	rc = psr_model_create_of(out, psr_model_info(model), &(struct psr_model_parts){ .points = &set }, NULL, err);
	free(word);
	return rc;
}

/* The unit sphere is then as many pixels high as the model's resolution says. */
static double distance_of(const struct psr_model_info *info, double distance)
{
	struct psr_camera camera;
	double away[3];

	if (distance > 0)
		return distance;
	psr_camera_frame(&camera, info->box_min, info->box_max, info->up, 0.7, (double)WIDTH / HEIGHT);
	v3d_sub(away, camera.eye, camera.target);
	return HEIGHT * info->scale / (tan(camera.fov_y / 2) * info->resolution * v3d_length(away));
}

/* Of all threads: it does not grow while others use the cores. */
static double processor_ms(void)
{
	return (double)clock_read(CLOCK_PROCESS_CPUTIME_ID) * 1e-6;
}

static int draw(struct times *times, struct bench *bench, enum psr_isa isa, int look, int direction, double distance,
                struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(bench->model[look]);
	struct psr_instance instance = { .model = bench->model[look], .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_light light;
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                       .ambient = { 0.1, 0.1, 0.1 } };
	const struct psr_report *report = &bench->frame.report;
	struct psr_settings settings;
	double ns = 0, start;
	int rc;

	around_camera(&scene.camera, info, direction, distance, (double)WIDTH / HEIGHT);
	psr_light_key(&light, &scene.camera);
	light.casts_shadow = 0;
	psr_settings_default(&settings, WIDTH, HEIGHT);
	start = processor_ms();
	rc = psr_render(bench->renderer[isa], &scene, &settings, bench->pool, &bench->frame, err);
	if (rc != PSR_OK || times == NULL)
		return rc;
	for (int s = 0; s < PSR_N_STAGES; s++) {
		times->stage[s][times->n] = (double)report->ns[s] * 1e-6;
		ns += (double)report->ns[s];
	}
	times->frame[times->n] = ns * 1e-6;
	times->cpu[times->n] = processor_ms() - start;
	times->drawn[times->n++] = (double)report->n_samples_drawn * 1e3
	                           / (double)(report->ns[PSR_STAGE_CULL] + report->ns[PSR_STAGE_WARP]);
	times->covered += (double)report->n_covered;
	return PSR_OK;
}

static void print_head(void)
{
	printf("%-9s %-8s %-6s %8s %5s %8s %8s %8s %8s", "covered", "", "isa", "frames/s", "ratio", "drawn M", "all M",
	       "cpu ms", "ms:");
	for (int s = 0; s < PSR_N_STAGES; s++)
		printf(" %7s", psr_stage_name((enum psr_stage)s));
	printf("\n");
}

static void print_times(const struct bench *bench, enum psr_isa isa, int look, struct times times[PSR_N_ISAS])
{
	struct times *t = &times[isa];
	const size_t n = (size_t)t->n;
	const double frame = stats_median(t->frame, n), first = stats_median(times[PSR_ISA_C].cpu, n);

	printf("%7.1f %% %-8s %-6s %8.0f %5.2f %8.1f %8.1f %8.3f %8.3f", 100 * t->covered / (double)n / (WIDTH * HEIGHT),
	       look_name[look], psr_isa_name(isa), 1e3 / frame, first / stats_median(t->cpu, n), stats_median(t->drawn, n),
	       psr_model_point_set(bench->model[look])->n_points * 1e-3 / frame, stats_median(t->cpu, n), frame);
	for (int s = 0; s < PSR_N_STAGES; s++)
		printf(" %7.3f", stats_median(t->stage[s], n));
	printf("\n");
}

static void print_target(const char *what, double value, double target)
{
	printf("%s: %.0f, target at least %.0f: %s\n", what, value, target, value >= target ? "met" : "missed");
}

static int measure(struct bench *bench, struct psr_error *err)
{
	static struct times times[N_LOOKS][PSR_N_ISAS];
	double rate = 0, frames = 0;

	print_head();
	for (int d = 0; d < N_DISTANCES; d++) {
		const double distance = distance_of(psr_model_info(bench->model[0]), distances[d]);

		memset(times, 0, sizeof times);
		for (int round = -1; round < bench->n_rounds; round++)
			for (int direction = 0; direction < DIRECTIONS; direction++)
				for (int k = 0; k < N_LOOKS * PSR_N_ISAS; k++) {
					const int look = k / PSR_N_ISAS, isa = k % PSR_N_ISAS;
					struct times *to = round < 0 ? NULL : &times[look][isa];
					const int rc = bench->renderer[isa] == NULL ? PSR_OK
					                                            : draw(to, bench, isa, look, direction, distance, err);

					if (rc != PSR_OK)
						return rc;
				}
		for (int k = 0; k < N_LOOKS * PSR_N_ISAS; k++)
			if (bench->renderer[k % PSR_N_ISAS] != NULL)
				print_times(bench, k % PSR_N_ISAS, k / PSR_N_ISAS, times[k / PSR_N_ISAS]);
		struct times *best = &times[SPECULAR][bench->most];
		rate = distances[d] == 0 ? stats_median(best->drawn, (size_t)best->n) : rate;
		frames = distances[d] == 1 ? 1e3 / stats_median(best->frame, (size_t)best->n) : frames;
	}
	print_target("M points drawn a second, specular, a pixel of the model on one of the picture", rate, TARGET_POINTS);
	print_target("frames a second, specular, as the object fits the picture", frames, TARGET_FRAMES);
	return PSR_OK;
}

static int make_renderers(struct bench *bench, int only, struct psr_error *err)
{
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		int rc;

		if (simd_of(isa) == NULL || (isa != PSR_ISA_C && only >= 0 && isa != only))
			continue;
		psr_isa_cap(isa);
		rc = psr_renderer_create(&bench->renderer[isa], err);
		if (rc != PSR_OK)
			return rc;
		bench->most = isa;
	}
	return PSR_OK;
}

static int run(const char *path, struct bench *bench, int n_threads, int only, struct psr_error *err)
{
	int rc = psr_model_read(&bench->model[SPECULAR], path, err);

	if (rc == PSR_OK && psr_model_point_set(bench->model[SPECULAR]) == NULL)
		rc = psr_fail(err, PSR_ERR_ARG, "%s has no differential points", path);
	if (rc == PSR_OK)
		rc = make_diffuse(&bench->model[DIFFUSE], bench->model[SPECULAR], err);
	if (rc == PSR_OK)
		rc = psr_frame_alloc(&bench->frame, WIDTH, HEIGHT, 1u << PSR_PLANE_COLOR, err);
	if (rc == PSR_OK)
		rc = psr_pool_create(&bench->pool, n_threads, err);
	if (rc == PSR_OK)
		rc = make_renderers(bench, only, err);
	if (rc == PSR_OK) {
		const struct dpoint_set *set = psr_model_point_set(bench->model[SPECULAR]);

		printf("%u points in %u groups; %dx%d, %d threads\n", set->n_points, set->n_groups, WIDTH, HEIGHT, n_threads);
		rc = measure(bench, err);
	}
	psr_pool_destroy(bench->pool);
	for (int isa = 0; isa < PSR_N_ISAS; isa++)
		psr_renderer_destroy(bench->renderer[isa]);
	for (int look = 0; look < N_LOOKS; look++)
		psr_model_unref(bench->model[look]);
	psr_frame_free(&bench->frame);
	return rc;
}

int main(int argc, char **argv)
{
	static struct bench bench = { .n_rounds = 10 };
	int option, rc, n_threads = N_THREADS, only = -1;
	struct psr_error err;

	while ((option = getopt(argc, argv, "n:t:i:")) != -1) {
		enum psr_isa isa = PSR_ISA_C;

		if (option == '?' || (option == 'i' && psr_isa_parse(&isa, optarg) != PSR_OK))
			return 2;
		bench.n_rounds = option == 'n' ? atoi(optarg) : bench.n_rounds;
		n_threads = option == 't' ? atoi(optarg) : n_threads;
		only = option == 'i' ? (int)isa : only;
	}
	if (optind >= argc || bench.n_rounds < 1 || bench.n_rounds * DIRECTIONS > MOST_FRAMES) {
		fprintf(stderr, "dpoint_draws [-n ROUNDS] [-t THREADS] [-i ISA] DPOINTS.psr\n");
		return 2;
	}
	rc = run(argv[optind], &bench, n_threads, only, &err);
	if (rc != PSR_OK)
		fprintf(stderr, "dpoint_draws: %s\n", err.text);
	return psr_exit_status(rc);
}
