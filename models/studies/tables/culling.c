/* Figures 6.7 and 6.8: how much visibility tests cull, and how much time that saves. */
#include "models/studies/cull/cull.h"
#include "tables.h"

#define N_VIEWS 24
#define N_MASKS 10

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

int culling_set(struct cull_set **out, const struct study *study, const struct study_model *model, int finest)
{
	struct psr_model *built = NULL;
	int rc = study_build(&built, NULL, study, model);

	if (rc != PSR_OK)
		return rc;
	rc = cull_set_create(out, built, finest, study->pool, study->err);
	psr_model_unref(built);
	return rc;
}

static void put(double *value, int has_gain, const struct cull_result *result, int choice)
{
	const struct cull_figures *figures = &result->figures[choice], *base = &result->figures[0];

	value[CULLED] = 100 * figures->blocks;
	value[SAMPLES] = 100 * figures->samples;
	value[HIDDEN] = 100 * result->blocks;
	value[WRONG] = 100 * figures->wrong;
	value[TEST] = 1e6 * figures->test_seconds;
	value[FRAME] = 1e6 * figures->frame_seconds;
	value[SPEEDUP] = 100 * (base->frame_seconds / figures->frame_seconds - 1);
	if (has_gain && base->blocks > 0)
		value[GAIN] = 100 * (figures->blocks / base->blocks - 1);
}

/* A row for each choice; the others are compared with the first. */
static int run_choices(struct study *study, const struct cull_choice *choice, int n, int finest)
{
	const struct cull_views views = { N_VIEWS, 1, 1, choice, n };
	int rc = PSR_OK;

	study->total = study->n_models;
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		struct cull_set *set = NULL;
		struct cull_result result;

		rc = culling_set(&set, study, &study->model[m], finest);
		if (rc == PSR_OK)
			rc = cull_measure(&result, set, study->model[m].scene, &views, study->pool, study->err);
		for (int i = 0; rc == PSR_OK && i < n; i++)
			put(study_at(&study->table, i, m, 0), study->table.n_columns > GAIN, &result, i);
		cull_set_destroy(set);
		study_step(study, study->model[m].name);
	}
	return rc;
}

int table_masks(struct study *study)
{
	static const char *const label[N_MASKS] = {
		"neither", "8 bits", "32 bits", "128 bits", "512 bits",
		"cones", "cones, 8 bits", "cones, 32 bits", "cones, 128 bits", "cones, 512 bits",
	};
	struct cull_choice choice[N_MASKS];
	const struct study_form form = { "tests", columns, GAIN };
	int rc = study_table_init(&study->table, form, N_MASKS, study->n_models, study->err);

	for (int i = 0; rc == PSR_OK && i < N_MASKS; i++) {
		choice[i] = (struct cull_choice){ .cones = i >= 5, .level = i % 5 + CULL_NO_MASK, .n = CULL_THESIS_N };
		study_label(&study->table, i, "%s", label[i]);
	}
	return rc == PSR_OK ? run_choices(study, choice, N_MASKS, CULL_FINEST) : rc;
}

int table_subdivision(struct study *study)
{
	struct cull_choice choice[SCREEN_MOST + 1];
	const int n = SCREEN_MOST + 1;
	const struct study_form form = { "screen", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, n, study->n_models, study->err);

	for (int i = 0; rc == PSR_OK && i < n; i++) {
		choice[i] = (struct cull_choice){ .cones = 1, .level = CULL_THESIS_LEVEL, .n = i };
		study_label(&study->table, i, "%dx%d", 1 << i, 1 << i);
	}
	return rc == PSR_OK ? run_choices(study, choice, n, CULL_THESIS_LEVEL) : rc;
}
