#include "base/stats.h"
#include "model/calibration.h"
#include "commands.h"
#include "info_octree.h"
#include "info_points.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/cli.h"
#include "base/json.h"
#include "base/outfile.h"
#include "base/view.h"
#include "model/blocks.h"
#include "model/tree.h"

#define DEGREES (180 / 3.14159265358979323846)

/* The facts that both forms of the answer give. */
struct summary {
	char name[256];
	char id[JSON_ID_TEXT];
	const struct psr_model_info *info;
	const struct psr_blocks *blocks; /* NULL if there are none */
	const struct octree *tree;       /* likewise */
	const struct dpoint_set *points; /* likewise */
	struct octree_shares shares;     /* zeros where the file has no packed octree */
	uint64_t bytes, file_bytes, drawn_bytes; /* drawn_bytes: with what is made of an octree to draw it */
	int is_packed, is_prefix;
	struct psr_model_prefix prefix;
	const struct psr_presets *presets;
	const struct psr_calibration *calibration;
	uint32_t level_blocks[PSR_MAX_LEVELS], n_bent, n_sheer;
	uint64_t level_samples[PSR_MAX_LEVELS];
};

static void take_name(char name[256], const char *path)
{
	const char *slash = strrchr(path, '/');
	char *dot;

	snprintf(name, 256, "%s", slash == NULL ? path : slash + 1);
	dot = strrchr(name, '.');
	if (dot != NULL && dot != name && strcmp(dot, ".psr") == 0)
		*dot = '\0';
}

static void summarize(struct summary *summary, const struct psr_model *model, const char *path)
{
	uint8_t id[16];

	memset(summary, 0, sizeof *summary);
	take_name(summary->name, path);
	psr_model_content_id(model, id);
	json_id(summary->id, id);
	summary->info = psr_model_info(model);
	summary->blocks = psr_model_blocks(model);
	summary->tree = psr_model_octree(model);
	summary->points = psr_model_point_set(model);
	psr_model_octree_shares(model, &summary->shares);
	summary->bytes = psr_model_bytes(model);
	summary->drawn_bytes = summary->bytes + (summary->tree != NULL ? info_octree_drawn(summary->tree) : 0);
	summary->file_bytes = psr_model_file_bytes(model, &summary->is_packed);
	summary->is_prefix = psr_model_is_prefix(model, &summary->prefix);
	summary->presets = psr_model_presets(model);
	summary->calibration = psr_model_calibration(model);
	for (uint32_t b = 0; summary->blocks != NULL && b < summary->blocks->n_blocks; b++) {
		unsigned level = psr_blocks_level(summary->blocks, b);

		summary->level_blocks[level]++;
		summary->n_bent += (psr_blocks_traits(summary->blocks, b) & PSR_BLOCK_BENT) != 0;
		/* Of materials, not of the coverage of things narrower than a sample. */
		summary->n_sheer += psr_blocks_is_sheer(summary->blocks, b)
		                    && (psr_blocks_traits(summary->blocks, b) & PSR_BLOCK_THIN) == 0;
		summary->level_samples[level] += (uint64_t)__builtin_popcountll(summary->blocks->mask[b]);
	}
}

static double ratio(double a, double b)
{
	return b > 0 ? a / b : 0;
}

/* With a comma before each three digits from the right. */
static const char *grouped(char text[28], uint64_t n)
{
	char *at = text + 27;

	*at = '\0';
	for (int digits = 0; n != 0 || digits == 0; n /= 10, digits++) {
		if (digits != 0 && digits % 3 == 0)
			*--at = ',';
		*--at = (char)('0' + n % 10);
	}
	return at;
}

static void print_share(const char *label, uint64_t n, uint64_t n_trials, const char *what)
{
	char part[28], all[28];

	if (n_trials == 0)
		printf("%s not measured\n", label);
	else
		printf("%s %s of %s pixels of the visible surface %s (%.2g %%)\n", label, grouped(part, n),
		       grouped(all, n_trials), what, ratio((double)n, (double)n_trials) * 100);
}

static void print_presets(const struct psr_presets *p)
{
	printf("cameras           %" PRIu32 "\n", p->n_cameras);
	for (uint32_t i = 0; i < p->n_cameras; i++)
		printf("  %-12s    %s\n", view_camera_kinds[p->camera[i].camera.kind], p->camera[i].name);
	printf("lights            %" PRIu32 "\n", p->n_lights);
	for (uint32_t i = 0; i < p->n_lights; i++)
		printf("  %-12s    %s\n", view_light_kinds[p->light[i].light.kind], p->light[i].name);
}

/* Medians over the views that were measured with a rung; times as multiples of that of the plain picture. */
struct rung_figures {
	uint32_t n;
	double rmse, times;
};

static void take_rung(struct rung_figures *figures, const struct psr_calibration *c, int rung)
{
	const int plain = 4; /* scale 1, spacing 1 */
	double rmse[PSR_MAX_CALIBRATED], times[PSR_MAX_CALIBRATED];

	uint32_t n = 0;

	for (uint32_t i = 0; i < c->n; i++) {
		const struct psr_measured at = psr_calibration_at(c, i, rung);

		if (!(at.ms > 0))
			continue;
		rmse[n] = at.rmse;
		times[n++] = at.ms / psr_calibration_at(c, i, plain).ms;
	}
	*figures = (struct rung_figures){ n, n > 0 ? stats_median(rmse, n) : 0, n > 0 ? stats_median(times, n) : 0 };
}

static void print_calibration(const struct psr_calibration *c)
{
	if (c->n == 0)
		return;
	printf("calibration       %" PRIu32 " views; medians of error (codes of 8 bits) and time (of the plain picture's)\n",
	       c->n);
	for (int r = 0; r < PSR_RUNGS; r++) {
		const struct psr_rung *rung = &psr_ladder[r];
		struct rung_figures figures;

		take_rung(&figures, c, r);
		if (figures.n == 0)
			continue;
		if (rung->pass > 0)
			printf("  pass %u                 ", rung->pass);
		else
			printf("  scale %u, spacing %-4g%s", rung->scale, rung->spacing_px,
			       r == PSR_RUNG_FINE ? ", fine  " : rung->smooth ? ", smooth" : "        ");
		printf("  %6.2f  %8.2f\n", figures.rmse, figures.times);
	}
}

static void add_calibration(cJSON *root, const struct psr_calibration *c)
{
	cJSON *part, *rungs;

	if (c->n == 0)
		return;
	part = cJSON_AddObjectToObject(root, "calibration");
	cJSON_AddNumberToObject(part, "views", c->n);
	rungs = cJSON_AddArrayToObject(part, "rungs");
	for (int r = 0; r < PSR_RUNGS; r++) {
		struct rung_figures figures;

		take_rung(&figures, c, r);
		if (figures.n == 0)
			continue;
		cJSON *rung = cJSON_CreateObject();
		cJSON_AddNumberToObject(rung, "scale", psr_ladder[r].scale);
		cJSON_AddNumberToObject(rung, "spacing_px", psr_ladder[r].spacing_px);
		cJSON_AddBoolToObject(rung, "smooth", psr_ladder[r].smooth > 0);
		cJSON_AddBoolToObject(rung, "fine", r == PSR_RUNG_FINE);
		cJSON_AddNumberToObject(rung, "pass", psr_ladder[r].pass);
		cJSON_AddNumberToObject(rung, "rmse", figures.rmse);
		cJSON_AddNumberToObject(rung, "time", figures.times);
		cJSON_AddItemToArray(rungs, rung);
	}
}

static void print_text(const struct summary *s)
{
	const struct psr_model_info *info = s->info;
	const struct psr_blocks *blocks = s->blocks;

	printf("name              %s\n", s->name);
	printf("content id        %s\n", s->id);
	printf("builder           %.32s\n", info->builder);
	printf("resolution        %" PRIu32 " pixels across the unit sphere\n", info->resolution);
	printf("tolerance         %.4g degrees\n", info->tolerance * DEGREES);
	printf("spacing           %.6g\n", info->spacing);
	printf("box               %.6g,%.6g,%.6g to %.6g,%.6g,%.6g\n", info->box_min[0], info->box_min[1], info->box_min[2],
	       info->box_max[0], info->box_max[1], info->box_max[2]);
	printf("up                %.6g,%.6g,%.6g\n", info->up[0], info->up[1], info->up[2]);
	printf("origin, scale     %.6g,%.6g,%.6g  %.6g\n", info->origin[0], info->origin[1], info->origin[2], info->scale);
	print_share("adequacy         ", info->n_missing, info->n_trials, "miss");
	print_share("culling loss     ", info->n_lost, info->n_trials, "are lost");
	print_presets(s->presets);
	print_calibration(s->calibration);
	printf("file              %.2f MB, %s\n", (double)s->file_bytes / 1e6, s->is_packed ? "packed" : "not packed");
	if (s->is_prefix && s->prefix.levels == s->prefix.of_levels)
		printf("                  the beginning of %.2f MB: all %" PRIu32 " levels of its octree, without its scan\n",
		       (double)s->prefix.of_bytes / 1e6, s->prefix.levels);
	else if (s->is_prefix)
		printf("                  the beginning of %.2f MB: %" PRIu32 " of %" PRIu32 " levels of its octree\n",
		       (double)s->prefix.of_bytes / 1e6, s->prefix.levels, s->prefix.of_levels);
	printf("memory            %.2f MB", (double)s->bytes / 1e6);
	if (s->drawn_bytes != s->bytes)
		printf(", some %.2f MB once the octree is drawn", (double)s->drawn_bytes / 1e6);
	printf("\n");
	if (s->tree != NULL)
		info_print_octree(s->tree, &s->shares, s->info->scale);
	if (s->points != NULL)
		info_print_points(s->points, s->info, s->file_bytes);
	if (blocks == NULL)
		return;
	printf("samples           %" PRIu64 "\n", blocks->n_samples);
	printf("blocks            %" PRIu32 " of %" PRIu32 " projections\n", blocks->n_blocks, blocks->n_projections);
	printf("clusters          %" PRIu32 "\n", blocks->n_clusters);
	printf("levels            %" PRIu32 "\n", blocks->n_levels);
	if (blocks->n_levels > 1) {
		for (uint32_t l = 0; l < blocks->n_levels; l++)
			printf("  level %-3" PRIu32 "       %" PRIu64 " samples in %" PRIu32 " blocks\n", l, s->level_samples[l],
			       s->level_blocks[l]);
	}
	printf("bytes a sample    %.2f of all levels, all overhead included; %.2f in the file\n",
	       ratio((double)s->bytes, (double)blocks->n_samples), ratio((double)s->file_bytes, (double)blocks->n_samples));
	printf("samples a block   %.1f of %d valid\n", ratio((double)blocks->n_samples, blocks->n_blocks),
	       PSR_BLOCK_SAMPLES);
	if (s->n_bent != 0)
		printf("bent blocks       %" PRIu32 ", whose shading normals are far from those of their faces\n", s->n_bent);
	if (s->n_sheer != 0)
		printf("sheer blocks      %" PRIu32 ", of surfaces that let a part of the light through\n",
		       s->n_sheer);
}

static void add_vec3(cJSON *root, const char *name, const double v[3])
{
	cJSON_AddItemToObject(root, name, cJSON_CreateDoubleArray(v, 3));
}

static void add_preset(cJSON *list, const char *name, const char *kind)
{
	cJSON *item = cJSON_CreateObject();

	cJSON_AddStringToObject(item, "name", name);
	cJSON_AddStringToObject(item, "kind", kind);
	cJSON_AddItemToArray(list, item);
}

static int print_json(const struct summary *s, struct psr_error *err)
{
	cJSON *root = cJSON_CreateObject(), *part, *counts;
	const struct psr_blocks *blocks = s->blocks;
	char builder[33];

	snprintf(builder, sizeof builder, "%.32s", s->info->builder);
	cJSON_AddStringToObject(root, "name", s->name);
	cJSON_AddStringToObject(root, "content_id", s->id);
	cJSON_AddStringToObject(root, "builder", builder);
	cJSON_AddNumberToObject(root, "resolution", s->info->resolution);
	cJSON_AddNumberToObject(root, "tolerance_degrees", s->info->tolerance * DEGREES);
	cJSON_AddNumberToObject(root, "spacing", s->info->spacing);
	add_vec3(root, "box_min", s->info->box_min);
	add_vec3(root, "box_max", s->info->box_max);
	add_vec3(root, "up", s->info->up);
	add_vec3(root, "origin", s->info->origin);
	cJSON_AddNumberToObject(root, "scale", s->info->scale);
	if (s->info->n_trials != 0) {
		part = cJSON_AddObjectToObject(root, "adequacy");
		cJSON_AddNumberToObject(part, "pixels", (double)s->info->n_trials);
		cJSON_AddNumberToObject(part, "missing", (double)s->info->n_missing);
		cJSON_AddNumberToObject(part, "lost_to_culling", (double)s->info->n_lost);
	} else {
		cJSON_AddNullToObject(root, "adequacy");
	}
	part = cJSON_AddArrayToObject(root, "cameras");
	for (uint32_t i = 0; i < s->presets->n_cameras; i++)
		add_preset(part, s->presets->camera[i].name, view_camera_kinds[s->presets->camera[i].camera.kind]);
	part = cJSON_AddArrayToObject(root, "lights");
	for (uint32_t i = 0; i < s->presets->n_lights; i++)
		add_preset(part, s->presets->light[i].name, view_light_kinds[s->presets->light[i].light.kind]);
	add_calibration(root, s->calibration);
	cJSON_AddNumberToObject(root, "bytes", (double)s->bytes);
	cJSON_AddNumberToObject(root, "drawn_bytes", (double)s->drawn_bytes);
	cJSON_AddNumberToObject(root, "file_bytes", (double)s->file_bytes);
	cJSON_AddBoolToObject(root, "is_packed", s->is_packed);
	if (s->is_prefix) {
		part = cJSON_AddObjectToObject(root, "prefix");
		cJSON_AddNumberToObject(part, "levels", s->prefix.levels);
		cJSON_AddNumberToObject(part, "of_levels", s->prefix.of_levels);
		cJSON_AddNumberToObject(part, "of_bytes", (double)s->prefix.of_bytes);
	}
	if (blocks != NULL) {
		part = cJSON_AddObjectToObject(root, "blocks");
		cJSON_AddNumberToObject(part, "samples", (double)blocks->n_samples);
		cJSON_AddNumberToObject(part, "blocks", blocks->n_blocks);
		cJSON_AddNumberToObject(part, "projections", blocks->n_projections);
		cJSON_AddNumberToObject(part, "clusters", blocks->n_clusters);
		cJSON_AddNumberToObject(part, "levels", blocks->n_levels);
		cJSON_AddNumberToObject(part, "bytes_per_sample", ratio((double)s->bytes, (double)blocks->n_samples));
		cJSON_AddNumberToObject(part, "file_bytes_per_sample", ratio((double)s->file_bytes, (double)blocks->n_samples));
		cJSON_AddNumberToObject(part, "bent", s->n_bent);
		cJSON_AddNumberToObject(part, "sheer", s->n_sheer);
		cJSON_AddNumberToObject(part, "samples_per_block", ratio((double)blocks->n_samples, blocks->n_blocks));
		counts = cJSON_AddArrayToObject(part, "level_blocks");
		for (uint32_t l = 0; l < blocks->n_levels; l++)
			cJSON_AddItemToArray(counts, cJSON_CreateNumber(s->level_blocks[l]));
		counts = cJSON_AddArrayToObject(part, "level_samples");
		for (uint32_t l = 0; l < blocks->n_levels; l++)
			cJSON_AddItemToArray(counts, cJSON_CreateNumber((double)s->level_samples[l]));
	}
	if (s->tree != NULL)
		cJSON_AddItemToObject(root, "octree", info_octree_json(s->tree, &s->shares, s->info->scale));
	if (s->points != NULL)
		cJSON_AddItemToObject(root, "dpoints", info_points_json(s->points, s->info, s->file_bytes));
	return json_print(root, err);
}

int cmd_info(int argc, char **argv)
{
	int json = 0, n_operands, code;
	struct psr_model *model = NULL;
	struct summary summary;
	struct psr_error err;
	const struct psr_opt opts[] = {
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &json, .help = "Prints the same as a JSON object, for scripts." },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model info FILE.psr [--json]",
		.summary = "Checks a .psr file and describes its content. Lengths are in the source file's units.",
		.opts = opts,
		.footer = NULL,
	};

	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, "one FILE.psr is needed");
	if (code == PSR_OK)
		code = psr_model_map(&model, argv[1], &err);
	if (code == PSR_OK) {
		summarize(&summary, model, argv[1]);
		if (json)
			code = print_json(&summary, &err);
		else
			print_text(&summary);
	}
	psr_model_unref(model);
	if (code == PSR_OK)
		code = outfile_flush_stdout(&err);
	return code == PSR_OK ? 0 : psr_cli_fail("psr-model info", &err);
}
