#include <string.h>
#include "cull.h"
#include "study.h"

#define N_VIEWS 24
#define ZOOM 4 /* of the views that show what a frustum culls */
#define THESIS_LEVEL 2 /* 128 triangles */
#define THESIS_N 2     /* 4x4 regions */
#define MOST_CHOICES 10

static int make_set(struct cull_set **out, const struct study *study, const struct study_model *model, int finest)
{
	struct psr_model *built = NULL;
	int rc = study_built(&built, NULL, study, model);

	if (rc != PSR_OK)
		return rc;
	rc = cull_set_create(out, built, finest, study->pool, study->err);
	psr_model_unref(built);
	return rc;
}

/* ---- figures 6.7 and 6.8 ---- */

enum { CULLED, SAMPLES, HIDDEN, WRONG, TEST, FRAME, SPEEDUP, GAIN, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[CULLED] = { "% culled", "percent_culled", 2 },
	[SAMPLES] = { "% samples", "percent_samples_culled", 2 },
	[HIDDEN] = { "% hidden", "percent_hidden", 2 },
	[WRONG] = { "% wrong", "percent_wrong", 3 },
	[TEST] = { "test us", "test_us", 0 },
	[FRAME] = { "frame us", "frame_us", 0 },
	[SPEEDUP] = { "% speedup", "percent_speedup", 1 },
	[GAIN] = { "% more culled", "percent_more_culled", 1 },
};

static void put(struct study *study, int row, int model, const struct cull_figures *figures,
                const struct cull_truth *truth, const struct cull_figures *base)
{
	const struct study_table *table = &study->table;

	*study_at(table, row, model, CULLED) = 100 * figures->blocks;
	*study_at(table, row, model, SAMPLES) = 100 * figures->samples;
	*study_at(table, row, model, HIDDEN) = 100 * truth->blocks;
	*study_at(table, row, model, WRONG) = 100 * figures->wrong;
	*study_at(table, row, model, TEST) = 1e6 * figures->test_seconds;
	*study_at(table, row, model, FRAME) = 1e6 * figures->frame_seconds;
	*study_at(table, row, model, SPEEDUP) = 100 * (base->frame_seconds / figures->frame_seconds - 1);
	if (base->blocks > 0)
		*study_at(table, row, model, GAIN) = 100 * (figures->blocks / base->blocks - 1);
}

/* A row for each choice; the first is what others are compared with. */
static int run_choices(struct study *study, const struct cull_choice *choice, int n, int finest)
{
	const struct cull_views views = { .n = N_VIEWS, .zoom = 1, .is_timed = 1 };
	int rc = PSR_OK;

	study->total = study->n_models;
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		struct cull_set *set = NULL;
		struct cull_figures figures[MOST_CHOICES];
		struct cull_truth truth;

		rc = make_set(&set, study, &study->model[m], finest);
		if (rc == PSR_OK)
			rc = cull_measure(set, study->model[m].scene, &views, choice, n, study->pool, figures, &truth, study->err);
		for (int i = 0; rc == PSR_OK && i < n; i++)
			put(study, i, m, &figures[i], &truth, &figures[0]);
		cull_set_destroy(set);
		study_step(study, study->model[m].name);
	}
	return rc;
}

int study_run_masks(struct study *study)
{
	const int n_masks = CULL_FINEST + 2;
	struct cull_choice choice[MOST_CHOICES];
	int rc = study_table_init(&study->table, "tests", columns, GAIN, 2 * n_masks, study->n_models, study->err);

	for (int i = 0; rc == PSR_OK && i < 2 * n_masks; i++) {
		char *label = study->table.label[i];
		int level = i % n_masks - 1;

		choice[i] = (struct cull_choice){ .cones = i >= n_masks, .level = level, .n = THESIS_N };
		if (level == CULL_NO_MASK)
			snprintf(label, sizeof *study->table.label, "%s", i == 0 ? "neither" : "cones");
		else
			snprintf(label, sizeof *study->table.label, "%s%d bits", i < n_masks ? "" : "cones, ", 8 << 2 * level);
	}
	return rc == PSR_OK ? run_choices(study, choice, 2 * n_masks, CULL_FINEST) : rc;
}

int study_run_subdivision(struct study *study)
{
	struct cull_choice choice[MOST_CHOICES];
	const int n = SCREEN_MOST + 1;
	int rc = study_table_init(&study->table, "screen", columns, N_COLUMNS, n, study->n_models, study->err);

	for (int i = 0; rc == PSR_OK && i < n; i++) {
		choice[i] = (struct cull_choice){ .cones = 1, .level = THESIS_LEVEL, .n = i };
		snprintf(study->table.label[i], sizeof *study->table.label, "%dx%d", 1 << i, 1 << i);
	}
	return rc == PSR_OK ? run_choices(study, choice, n, THESIS_LEVEL) : rc;
}

/* ---- table 8.3 ---- */

static const struct thesis {
	const char *name;
	double cone, mask, both;
} thesis[] = {
	{ "chair", 13.5, 15.6, 19.0 },    { "dragon", 16.1, 19.1, 24.1 },   { "gavel", 19.3, 29.1, 31.9 },
	{ "kittyhawk", 14.3, 25.0, 26.6 }, { "pencil", 23.8, 26.8, 30.5 },  { "pinetree", 1.2, 11.1, 11.6 },
	{ "plant", 29.3, 27, 34 },        { "sailboat", 27.2, 26.9, 31.0 }, { "table", 26.0, 30.7, 36.0 },
	{ "teapot", 32.1, 25.5, 35.3 },   { "top", 39.6, 37.5, 46.4 },      { "toybird", 23.0, 20.5, 27.5 },
	{ "tree", 4.9, 36.5, 36.8 },      { "wheel", 20.3, 22.2, 25.3 },
};
#define N_THESIS ((int)(sizeof thesis / sizeof *thesis))

enum {
	THESIS_CONE, THESIS_MASK, THESIS_BOTH, CONE, MASK, BOTH, BLOCKS_HIDDEN, BOTH_SAMPLES, SAMPLES_HIDDEN, BOTH_WRONG,
	FRUSTUM, FRUSTUM_BOTH, FRUSTUM_HIDDEN, N_CULLING
};

static const struct study_column culling_columns[N_CULLING] = {
	[THESIS_CONE] = { "[G] cone", "thesis_percent_cone", 1 },
	[THESIS_MASK] = { "mask", "thesis_percent_mask", 1 },
	[THESIS_BOTH] = { "both", "thesis_percent_both", 1 },
	[CONE] = { "| cone", "percent_cone", 1 },
	[MASK] = { "mask", "percent_mask", 1 },
	[BOTH] = { "both", "percent_both", 1 },
	[BLOCKS_HIDDEN] = { "hidden", "percent_hidden", 1 },
	[BOTH_SAMPLES] = { "| samples", "percent_samples_both", 1 },
	[SAMPLES_HIDDEN] = { "hidden", "percent_samples_hidden", 1 },
	[BOTH_WRONG] = { "| wrong", "percent_wrong", 3 },
	[FRUSTUM] = { "| frustum", "zoomed_percent_frustum", 1 },
	[FRUSTUM_BOTH] = { "all", "zoomed_percent_all", 1 },
	[FRUSTUM_HIDDEN] = { "hidden", "zoomed_percent_hidden", 1 },
};

static void put_thesis(struct study *study, int row)
{
	for (int i = 0; i < N_THESIS; i++) {
		if (strcmp(thesis[i].name, study->model[row].name) != 0)
			continue;
		*study_at(&study->table, row, 0, THESIS_CONE) = thesis[i].cone;
		*study_at(&study->table, row, 0, THESIS_MASK) = thesis[i].mask;
		*study_at(&study->table, row, 0, THESIS_BOTH) = thesis[i].both;
	}
}

static int put_culling(struct study *study, int row)
{
	static const struct cull_choice choice[] = {
		{ 1, CULL_NO_MASK, 0 }, { 0, THESIS_LEVEL, THESIS_N }, { 1, THESIS_LEVEL, THESIS_N },
		{ 0, CULL_NO_MASK, 0 },
	};
	const struct cull_views whole = { .n = N_VIEWS, .zoom = 1 }, part = { .n = N_VIEWS, .zoom = ZOOM };
	const struct study_table *table = &study->table;
	struct cull_figures figures[4];
	struct cull_truth truth;
	struct cull_set *set = NULL;
	int rc = make_set(&set, study, &study->model[row], THESIS_LEVEL);

	if (rc == PSR_OK)
		rc = cull_measure(set, study->model[row].scene, &whole, choice, 3, study->pool, figures, &truth, study->err);
	if (rc == PSR_OK) {
		for (int i = 0; i < 3; i++)
			*study_at(table, row, 0, CONE + i) = 100 * figures[i].blocks;
		*study_at(table, row, 0, BLOCKS_HIDDEN) = 100 * truth.blocks;
		*study_at(table, row, 0, BOTH_SAMPLES) = 100 * figures[2].samples;
		*study_at(table, row, 0, SAMPLES_HIDDEN) = 100 * truth.samples;
		*study_at(table, row, 0, BOTH_WRONG) = 100 * figures[2].wrong;
		rc = cull_measure(set, study->model[row].scene, &part, choice, 4, study->pool, figures, &truth, study->err);
	}
	if (rc == PSR_OK) {
		*study_at(table, row, 0, FRUSTUM) = 100 * figures[3].blocks;
		*study_at(table, row, 0, FRUSTUM_BOTH) = 100 * figures[2].blocks;
		*study_at(table, row, 0, FRUSTUM_HIDDEN) = 100 * truth.blocks;
	}
	cull_set_destroy(set);
	return rc;
}

int study_run_culling(struct study *study)
{
	int rc = study_table_init(&study->table, "model", culling_columns, N_CULLING, study->n_models, 1, study->err);

	study->total = study->n_models;
	for (int i = 0; rc == PSR_OK && i < study->n_models; i++) {
		snprintf(study->table.label[i], sizeof study->table.label[i], "%s", study->model[i].name);
		put_thesis(study, i);
		rc = put_culling(study, i);
		study_step(study, study->model[i].name);
	}
	return rc;
}
