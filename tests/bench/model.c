/* model PSR-MODEL FOLDER OUT.json [DRAGON.ply] [NAME...]: what the modeller costs and how large its models are, beside
 * the thesis ([G] table 8.1) and our targets. FOLDER takes the models; NAME... are those of the standard set to build,
 * all of them without any. The table goes to standard output. A missed target is said and does not fail. */
#include <cjson/cJSON.h>
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "child.h"
#include "measure/rate.h"
#include "psr/mesh.h"
#include "model/blocks.h"

#define MAX_SECONDS 2.0          /* the standard set at 256, on two cores */
#define MAX_BYTES_IN_MEMORY 12.5 /* a valid sample of all levels, all overhead included; the thesis: 95 bits */
#define MAX_BYTES_PACKED 7.0     /* the same on disk */
#define MAX_MISSING 1e-4         /* of the visible surface */
#define MAX_PEAK_MIB 3072.0
#define MIN_RATE 0.5             /* of Embree's own */

/* [G] table 8.1: at 256, on a Pentium II of 333 MHz. */
static const struct {
	const char *name;
	double megabytes;
	int blocks, minutes;
} thesis[] = {
	{ "chair", 1.32, 2666, 15 }, { "dragon", 0.96, 2100, 18 }, { "gavel", 1.20, 1779, 8 },
	{ "kittyhawk", 1.73, 3390, 62 }, { "pencil", 0.38, 682, 9 }, { "pinetree", 7.12, 11051, 95 },
	{ "plant", 2.33, 3973, 34 }, { "sailboat", 1.00, 1786, 13 }, { "table", 1.86, 3128, 78 },
	{ "teapot", 1.94, 2871, 34 }, { "top", 2.96, 4473, 43 }, { "toybird", 1.46, 2411, 11 },
	{ "tree", 7.41, 10694, 248 }, { "wheel", 2.19, 4742, 64 },
};
#define N_THESIS (sizeof thesis / sizeof thesis[0])

struct result {
	struct child_use use;
	uint64_t samples, samples_finest, bytes, bytes_plain, bytes_packed, trials, missing;
	uint32_t blocks, blocks_finest, levels;
};

static struct {
	const char *program, *folder;
	cJSON *json;
	int n_targets, n_missed;
} bench;

static void die(const char *what, const char *detail)
{
	fprintf(stderr, "bench-model: %s: %s\n", what, detail);
	exit(1);
}

/* Returns "met" or "missed" and counts. */
static const char *target(const char *model, const char *name, double value, double bound, int is_met)
{
	cJSON *list = cJSON_GetObjectItemCaseSensitive(bench.json, "targets"), *item = cJSON_CreateObject();

	cJSON_AddStringToObject(item, "model", model);
	cJSON_AddStringToObject(item, "name", name);
	cJSON_AddNumberToObject(item, "value", value);
	cJSON_AddNumberToObject(item, "bound", bound);
	cJSON_AddBoolToObject(item, "met", is_met);
	cJSON_AddItemToArray(list, item);
	bench.n_targets++;
	bench.n_missed += !is_met;
	return is_met ? "met" : "missed";
}

static uint64_t file_bytes(const char *path)
{
	struct stat info;

	if (stat(path, &info) != 0)
		die(path, "cannot be read");
	return (uint64_t)info.st_size;
}

static double per(uint64_t a, uint64_t b)
{
	return b == 0 ? 0 : (double)a / (double)b;
}

/* Builds a model, measures its file, and its file packed. */
static struct result build(const char *source, const char *name, int resolution)
{
	struct result r = { .levels = 0 };
	struct psr_model *model;
	struct psr_error err;
	const struct psr_blocks *blocks;
	char path[4096], packed[4096], number[16];
	const char *argv[] = { bench.program, "build", source, "-o", path, "-r", number, "--quiet", NULL };

	snprintf(path, sizeof path, "%s/%s-%d.psr", bench.folder, name, resolution);
	snprintf(packed, sizeof packed, "%s/%s-%d.packed.psr", bench.folder, name, resolution);
	snprintf(number, sizeof number, "%d", resolution);
	if (child_run(&r.use, argv) != 0)
		die(source, "cannot be built");
	if (psr_model_map(&model, path, &err) != PSR_OK || psr_model_write_packed(model, packed, &err) != PSR_OK)
		die(path, err.text);
	blocks = psr_model_blocks(model);
	r.samples = blocks->n_samples;
	r.blocks = blocks->n_blocks;
	r.levels = blocks->n_levels;
	r.bytes = psr_model_bytes(model);
	r.trials = psr_model_info(model)->n_trials;
	r.missing = psr_model_info(model)->n_missing;
	for (uint32_t b = 0; b < blocks->n_blocks; b++) {
		r.blocks_finest += psr_blocks_level(blocks, b) == 0;
		r.samples_finest += psr_blocks_level(blocks, b) == 0 ? (uint64_t)__builtin_popcountll(blocks->mask[b]) : 0;
	}
	psr_model_unref(model);
	r.bytes_plain = file_bytes(path);
	r.bytes_packed = file_bytes(packed);
	return r;
}

static void add_json(const char *name, int resolution, const struct result *r)
{
	cJSON *item = cJSON_CreateObject();

	cJSON_AddStringToObject(item, "name", name);
	cJSON_AddNumberToObject(item, "resolution", resolution);
	cJSON_AddNumberToObject(item, "seconds", r->use.seconds);
	cJSON_AddNumberToObject(item, "cpu_seconds", r->use.cpu_seconds);
	cJSON_AddNumberToObject(item, "peak_mib", r->use.peak_mib);
	cJSON_AddNumberToObject(item, "samples", (double)r->samples);
	cJSON_AddNumberToObject(item, "samples_finest", (double)r->samples_finest);
	cJSON_AddNumberToObject(item, "blocks", r->blocks);
	cJSON_AddNumberToObject(item, "blocks_finest", r->blocks_finest);
	cJSON_AddNumberToObject(item, "levels", r->levels);
	cJSON_AddNumberToObject(item, "bytes_in_memory", (double)r->bytes);
	cJSON_AddNumberToObject(item, "bytes_on_disk", (double)r->bytes_plain);
	cJSON_AddNumberToObject(item, "bytes_packed", (double)r->bytes_packed);
	cJSON_AddNumberToObject(item, "adequacy_pixels", (double)r->trials);
	cJSON_AddNumberToObject(item, "adequacy_missing", (double)r->missing);
	cJSON_AddItemToArray(cJSON_GetObjectItemCaseSensitive(bench.json, "models"), item);
}

static void print_head(void)
{
	printf("%-9s %5s %7s %7s %6s %9s %7s %3s | %6s %6s %6s | %-16s | %s\n", "model", "res", "seconds", "CPU s", "MiB",
	       "samples", "blocks", "lv", "memory", "disk", "packed", "missing of",
	       "targets: time, memory, packed, adequacy, peak");
	printf("%-9s %5s %7s %7s %6s %9s %7s %3s | %22s | %-16s |\n", "", "", "", "", "peak", "", "", "", "bytes a sample",
	       "pixels");
}

static void print_row(const char *name, int resolution, const struct result *r, double max_seconds)
{
	double memory = per(r->bytes, r->samples), packed = per(r->bytes_packed, r->samples),
		missing = per(r->missing, r->trials);
	char share[32], at[64];

	snprintf(share, sizeof share, "%" PRIu64 " / %" PRIu64, r->missing, r->trials);
	printf("%-9s %5d %7.2f %7.2f %6.0f %9" PRIu64 " %7" PRIu32 " %3" PRIu32 " | %6.2f %6.2f %6.2f | %-16s |", name,
	       resolution,
	       r->use.seconds, r->use.cpu_seconds, r->use.peak_mib, r->samples, r->blocks, r->levels, memory,
	       per(r->bytes_plain, r->samples), packed, share);
	snprintf(at, sizeof at, "%s at %d", name, resolution);
	printf(" %s,", target(at, "seconds", r->use.seconds, max_seconds, r->use.seconds < max_seconds));
	printf(" %s,", target(at, "bytes a sample in memory", memory, MAX_BYTES_IN_MEMORY, memory <= MAX_BYTES_IN_MEMORY));
	printf(" %s,", target(at, "bytes a sample packed", packed, MAX_BYTES_PACKED, packed <= MAX_BYTES_PACKED));
	printf(" %s,", target(at, "missing of the visible surface", missing, MAX_MISSING,
	                      r->trials > 0 && missing < MAX_MISSING));
	printf(" %s\n", target(at, "peak MiB", r->use.peak_mib, MAX_PEAK_MIB, r->use.peak_mib < MAX_PEAK_MIB));
	add_json(name, resolution, r);
	fflush(stdout);
}

static int is_asked(const char *name, char **names, int n)
{
	int asked = n == 0;

	for (int i = 0; i < n; i++)
		asked |= strcmp(names[i], name) == 0;
	return asked;
}

static void standard_set(char **names, int n)
{
	static struct result result[N_THESIS];
	char path[4096];

	puts("The standard set at 256 (targets: 2 s, 12.5 bytes a sample in memory, 7 packed, 1 in 10,000 missing, 3 GiB)");
	print_head();
	for (size_t i = 0; i < N_THESIS; i++) {
		struct child_use use;
		const char *argv[] = { bench.program, "make", thesis[i].name, "-o", path, NULL };
		if (!is_asked(thesis[i].name, names, n))
			continue;
		snprintf(path, sizeof path, "%s/%s.glb", bench.folder, thesis[i].name);
		if (child_run(&use, argv) != 0)
			die(thesis[i].name, "cannot be made");
		result[i] = build(path, thesis[i].name, 256);
		print_row(thesis[i].name, 256, &result[i], MAX_SECONDS);
	}
	puts("\n[G] table 8.1 (a Pentium II of 333 MHz, models of the same names) and ours. Its models have one level, and so have "
	     "MB\nand blocks of ours; all MB counts every level.");
	printf("%-9s | %8s %8s %9s | %8s %8s %8s %9s | %s\n", "model", "[G] MB", "blocks", "minutes", "MB", "blocks",
	       "all MB",
	       "seconds", "times faster, blocks of ours for one of [G]");
	for (size_t i = 0; i < N_THESIS; i++) {
		const struct result *r = &result[i];
		if (r->samples == 0)
			continue;
		printf("%-9s | %8.2f %8d %9d | %8.2f %8" PRIu32 " %8.2f %9.2f | %.0f, %.2f\n", thesis[i].name,
		       thesis[i].megabytes,
		       thesis[i].blocks, thesis[i].minutes, (double)r->bytes / 1e6 * per(r->samples_finest, r->samples),
		       r->blocks_finest, (double)r->bytes / 1e6, r->use.seconds, thesis[i].minutes * 60 / r->use.seconds,
		       (double)r->blocks_finest / thesis[i].blocks);
	}
}

static void dragon(const char *source)
{
	static const struct {
		int resolution;
		double seconds;
	} runs[] = { { 512, 20 }, { 1024, 90 } };
	struct psr_mesh *mesh;
	struct psr_error err;
	double ours, embree;

	puts("\nThe Stanford dragon (targets: 20 s at 512, 90 s at 1024, half of Embree's own rate)");
	if (psr_mesh_import(&mesh, source, NULL, &err) != PSR_OK || psr_ray_rate(mesh, &ours, &embree, &err) != PSR_OK)
		die(source, err.text);
	printf("primary rays on its %" PRIu32 " triangles, one thread: ours %.2f, Embree's packets %.2f Mray/s of CPU time: ratio "
	       "%.2f, %s\n",
	       mesh->n_triangles, ours, embree, ours / embree,
	       target("stanford", "primary rays against Embree's packets", ours / embree, MIN_RATE,
	              ours / embree >= MIN_RATE));
	psr_mesh_destroy(mesh);
	print_head();
	for (size_t i = 0; i < sizeof runs / sizeof runs[0]; i++) {
		struct result r = build(source, "stanford", runs[i].resolution);
		print_row("stanford", runs[i].resolution, &r, runs[i].seconds);
	}
}

static void write_json(const char *path)
{
	char *text = cJSON_Print(bench.json);
	FILE *file = fopen(path, "w");

	if (text == NULL || file == NULL || fprintf(file, "%s\n", text) < 0 || fclose(file) != 0)
		die(path, "cannot be written");
	cJSON_free(text);
	cJSON_Delete(bench.json);
}

int main(int argc, char **argv)
{
	int first_name = argc > 4 && strchr(argv[4], '.') != NULL ? 5 : 4;

	if (argc < 4) {
		fprintf(stderr, "usage: model PSR-MODEL FOLDER OUT.json [DRAGON.ply] [NAME...]\n");
		return 2;
	}
	bench.program = argv[1];
	bench.folder = argv[2];
	bench.json = cJSON_CreateObject();
	cJSON_AddArrayToObject(bench.json, "models");
	cJSON_AddArrayToObject(bench.json, "targets");
	if (mkdir(bench.folder, 0777) != 0 && access(bench.folder, W_OK) != 0)
		die(bench.folder, "cannot be made");
	standard_set(argv + first_name, argc - first_name);
	if (first_name == 5)
		dragon(argv[4]);
	else
		puts("\nThe Stanford dragon is not here: make models fetches it");
	printf("\n%d of %d targets met, %d missed; everything as numbers in %s\n", bench.n_targets - bench.n_missed,
	       bench.n_targets,
	       bench.n_missed, argv[3]);
	write_json(argv[3]);
	return 0;
}
