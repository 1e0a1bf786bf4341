/* Draws the shots of tests/golden/frames.suite, octrees.suite and dpoints.suite with every instruction set that the
 * machine has, by one thread and by two: each frame has the hashes that the suite names, whatever the machine. */
#define _GNU_SOURCE
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "simd/isa.h"
#include "simd/simd.h"
#include "shot.h"

#define FOLDER "tests/golden"
#define MAX_MODELS 16
#define N_POOLS 2

struct way { /* of drawing the same frame */
	enum psr_isa isa;
	int n_threads;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
};

struct golden {
	uint64_t hash[PSR_N_PLANES];
};

static struct way ways[PSR_N_ISAS * N_POOLS];
static uint32_t n_ways, n_shots, n_failed;

static struct {
	char name[SHOT_NAME_BYTES];
	struct psr_model *model;
} models[MAX_MODELS];

static void stop(const char *what, const char *why)
{
	printf("not ok - %s\n# %s\n", what, why);
	exit(1);
}

static const struct psr_model *open_model(const char *name)
{
	int i = 0;
	char path[256];
	struct psr_error err;
	while (i < MAX_MODELS && models[i].model && strcmp(models[i].name, name) != 0)
		i++;
	if (i == MAX_MODELS || models[i].model)
		return i < MAX_MODELS ? models[i].model : NULL;
	snprintf(models[i].name, sizeof models[i].name, "%s", name);
	snprintf(path, sizeof path, FOLDER "/%s.psr", name);
	if (psr_model_read(&models[i].model, path, &err))
		stop(path, err.text);
	return models[i].model;
}

/* Under the thread sanitizer a way takes as long as all others together without it, and one thread shows it nothing. */
static void make_ways(void)
{
#ifdef __SANITIZE_THREAD__
	const int isas = 1, least_threads = 2;
#else
	const int isas = PSR_N_ISAS, least_threads = 1;
#endif

	for (int isa = 0; isa < isas; isa++) {
		if (!simd_of((enum psr_isa)isa))
			continue;
		psr_isa_cap((enum psr_isa)isa);
		for (int threads = least_threads; threads <= N_POOLS; threads++) {
			struct way *way = &ways[n_ways++];
			*way = (struct way){ .isa = (enum psr_isa)isa, .n_threads = threads };
			if (psr_renderer_create(&way->renderer, NULL) || psr_pool_create(&way->pool, threads, NULL))
				stop("a renderer is made", "no memory");
		}
	}
}

static void draw(struct golden *out, const struct shot *shot, const struct way *way)
{
	struct psr_settings settings;
	struct psr_frame frame;
	struct psr_error err;
	psr_settings_default(&settings, shot->size[0], shot->size[1]);
	settings.smooth = shot->smooth;
	settings.pass = shot->n_passes;
	settings.with_splats = shot->with_splats;
	if (psr_frame_alloc(&frame, shot->size[0], shot->size[1], shot->planes, &err)
	    || psr_render(way->renderer, &shot->scene, &settings, way->pool, &frame, &err))
		stop(shot->name, err.text);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		out->hash[plane] = shot->planes >> plane & 1 ? psr_frame_hash(&frame, plane) : 0;
	psr_frame_free(&frame);
}

static void print_hashes(const struct shot *shot, const uint64_t *hash)
{
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (shot->planes >> plane & 1)
			printf(" %s %016" PRIx64, psr_plane_name(plane), hash[plane]);
	printf("\n");
}

static void check_shot(struct shot *shot)
{
	struct golden got[PSR_N_ISAS * N_POOLS];
	int is_right = 1;
	for (uint32_t i = 0; i < n_ways; i++) {
		draw(&got[i], shot, &ways[i]);
		is_right &= memcmp(got[i].hash, shot->hash, sizeof shot->hash) == 0;
	}
	printf("%s %u - frame '%s' has its golden hash with every instruction set, by one thread and by two\n",
	       is_right ? "ok" : "not ok", ++n_shots, shot->name);
	for (uint32_t i = 0; i < (is_right ? 0 : n_ways); i++) {
		printf("# %s, threads: %d:", psr_isa_name(ways[i].isa), ways[i].n_threads);
		print_hashes(shot, got[i].hash);
	}
	if (!is_right) {
		printf("# expected:");
		print_hashes(shot, shot->hash);
	}
	fflush(stdout);
	n_failed += !is_right;
}

int main(void)
{
	static const char *const suite[] = { FOLDER "/frames.suite", FOLDER "/octrees.suite", FOLDER "/dpoints.suite" };
	struct psr_error err;

	make_ways();
	for (size_t i = 0; i < sizeof suite / sizeof *suite; i++)
		if (shots_read(suite[i], open_model, check_shot, &err))
			stop(suite[i], err.text);
	printf("1..%u\n", n_shots);
	for (uint32_t i = 0; i < n_ways; i++) {
		psr_renderer_destroy(ways[i].renderer);
		psr_pool_destroy(ways[i].pool);
	}
	for (int i = 0; i < MAX_MODELS; i++)
		psr_model_unref(models[i].model);
	return n_failed != 0;
}
