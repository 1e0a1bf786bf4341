/* Draws the shots of tests/golden/shots with every instruction set that the machine has, by one thread and by two: each
 * frame has the hashes that tests/golden/hashes names, whatever the machine. PSR_GOLDEN=write rewrites that file. */
#define _GNU_SOURCE
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "simd/isa.h"
#include "simd/simd.h"
#include "shot.h"

#define FOLDER "tests/golden"
#define MAX_SHOTS 256
#define MAX_MODELS 16
#define N_POOLS 2

struct way { /* of drawing the same frame */
	enum psr_isa isa;
	int n_threads;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
};

struct golden {
	char name[SHOT_NAME_BYTES];
	uint64_t color, depth;
};

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

static uint32_t read_golden(struct golden *golden)
{
	FILE *file = fopen(FOLDER "/hashes", "r");
	uint32_t n = 0;
	if (!file)
		return 0;
	while (n < MAX_SHOTS && fscanf(file, "%63s color %" SCNx64 " depth %" SCNx64, golden[n].name, &golden[n].color,
	                               &golden[n].depth) == 3)
		n++;
	fclose(file);
	return n;
}

static void write_golden(const struct golden *golden, uint32_t n)
{
	FILE *file = fopen(FOLDER "/hashes", "w");
	if (!file)
		stop("the golden hashes are written", FOLDER "/hashes cannot be opened");
	for (uint32_t i = 0; i < n; i++)
		fprintf(file, "%s color %016" PRIx64 " depth %016" PRIx64 "\n", golden[i].name, golden[i].color, golden[i].depth);
	if (fclose(file))
		stop("the golden hashes are written", "they could not be");
}

static uint32_t make_ways(struct way *ways)
{
	uint32_t n = 0;
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		if (!simd_of((enum psr_isa)isa))
			continue;
		psr_isa_cap((enum psr_isa)isa);
		for (int threads = 1; threads <= N_POOLS; threads++) {
			struct way *way = &ways[n++];
			*way = (struct way){ .isa = (enum psr_isa)isa, .n_threads = threads };
			if (psr_renderer_create(&way->renderer, NULL) || psr_pool_create(&way->pool, threads, NULL))
				stop("a renderer is made", "no memory");
		}
	}
	return n;
}

static void draw(struct golden *out, const struct shot *shot, const struct way *way)
{
	const size_t n = (size_t)shot->size[0] * shot->size[1];
	struct psr_frame frame = { .width = shot->size[0], .height = shot->size[1], .rgb = malloc(3 * n), .depth = malloc(4 * n) };
	struct psr_settings settings;
	struct psr_error err;
	psr_settings_default(&settings, shot->size[0], shot->size[1]);
	settings.is_smooth = shot->is_smooth;
	if (!frame.rgb || !frame.depth || psr_render(way->renderer, &shot->scene, &settings, way->pool, &frame, &err))
		stop(shot->name, frame.rgb && frame.depth ? err.text : "no memory");
	snprintf(out->name, sizeof out->name, "%s", shot->name);
	out->color = psr_frame_hash(&frame, PSR_PLANE_COLOR);
	out->depth = psr_frame_hash(&frame, PSR_PLANE_DEPTH);
	free(frame.rgb);
	free(frame.depth);
}

/* Each way of drawing must give what is expected, or if nothing is, what the first gives. */
static int check_shot(struct golden *first, const struct shot *shot, const struct golden *expected, const struct way *ways,
                      uint32_t n_ways, int number)
{
	struct golden got[PSR_N_ISAS * N_POOLS];
	int is_same = 1;
	for (uint32_t i = 0; i < n_ways; i++) {
		draw(&got[i], shot, &ways[i]);
		is_same &= got[i].color == got[0].color && got[i].depth == got[0].depth;
	}
	*first = got[0];
	const int is_right = is_same && (!expected || (got[0].color == expected->color && got[0].depth == expected->depth));
	printf("%s %d - frame '%s' has its golden hash with every instruction set, by one thread and by two\n",
	       is_right ? "ok" : "not ok", number, shot->name);
	for (uint32_t i = 0; i < (is_right ? 0 : is_same ? 1 : n_ways); i++)
		printf("# %s, threads: %d: color %016" PRIx64 " depth %016" PRIx64 "%s\n", psr_isa_name(ways[i].isa), ways[i].n_threads,
		       got[i].color, got[i].depth, is_same ? ", and so have all others" : "");
	if (!is_right && expected)
		printf("# expected: color %016" PRIx64 " depth %016" PRIx64 "\n", expected->color, expected->depth);
	fflush(stdout);
	return is_right;
}

int main(void)
{
	static struct golden golden[MAX_SHOTS], got[MAX_SHOTS];
	static struct shot shot;
	struct way ways[PSR_N_ISAS * N_POOLS];
	const char *wanted = getenv("PSR_GOLDEN");
	const int is_writing = wanted && strcmp(wanted, "write") == 0;
	const uint32_t n_golden = read_golden(golden), n_ways = make_ways(ways);
	uint32_t n = 0, n_failed = 0;
	FILE *file = fopen(FOLDER "/shots", "r");
	char line[1024];
	struct psr_error err;

	if (!file)
		stop("the shots are read", FOLDER "/shots cannot be opened");
	while (n < MAX_SHOTS && fgets(line, sizeof line, file)) {
		int rc = shot_parse(&shot, line, open_model, &err);
		if (rc < 0)
			stop(shot.name, err.text);
		if (rc)
			continue;
		uint32_t g = 0;
		while (g < n_golden && strcmp(golden[g].name, shot.name) != 0)
			g++;
		if (g == n_golden && !is_writing)
			stop(shot.name, "it has no golden hash; PSR_GOLDEN=write writes them: look at the frames first");
		n_failed += !check_shot(&got[n], &shot, is_writing ? NULL : &golden[g], ways, n_ways, (int)n + 1);
		n++;
	}
	fclose(file);
	if (is_writing && !n_failed)
		write_golden(got, n);
	if (!is_writing && n != n_golden)
		stop("every golden hash is of a shot", FOLDER "/hashes has others, too");
	printf("1..%u\n", n);
	for (uint32_t i = 0; i < n_ways; i++) {
		psr_renderer_destroy(ways[i].renderer);
		psr_pool_destroy(ways[i].pool);
	}
	for (int i = 0; i < MAX_MODELS; i++)
		psr_model_unref(models[i].model);
	return n_failed != 0;
}
