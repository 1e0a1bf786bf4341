/* Sections 5.2 and 9.2: ways to select blocks, the thesis's and psr's own. */
#include "base/clock.h"
#include "psr/build.h"
#include "sample/levels/draft.h"
#include "sample/level.h"
#include "tables.h"

static const struct selection greedy_rows[] = {
	{ "[G] 32, one test, both passes", .is_one_test = 1 },
	{ "[G] 32, backs count, both passes", .not_facing = 1 },
	{ "[G] 32, depths 10 times as strict, first pass", .depth = 0.1, .no_second_pass = 1 },
	{ "  both passes", .goes_on = 1, .depth = 0.1 },
	{ "[G] 32, blocks of 4x4, both passes", .side = 4 },
	{ "[G] 32, blocks of 16x16, both passes", .side = 16 },
	{ "[G] 32, first pass", .no_second_pass = 1 },
	{ "  both passes", .goes_on = 1 },
	{ "    samples dropped (9.2.3)", .goes_on = 1, .drops = 1, .no_second_pass = 1 },
	{ "[G] 32, square lattice, 40 degrees, both passes", .degrees = 40, .lattice = GREEDY_SQUARE },
	{ "icosahedral 32, first pass", .directions = GREEDY_ICOSAHEDRAL, .no_second_pass = 1 },
	{ "  both passes", .directions = GREEDY_ICOSAHEDRAL, .goes_on = 1 },
	{ "    samples dropped (9.2.3)", .directions = GREEDY_ICOSAHEDRAL, .goes_on = 1, .drops = 1, .no_second_pass = 1 },
	{ "icosahedral 32, by score (9.2.2)", .directions = GREEDY_ICOSAHEDRAL, .by_score = 1 },
	{ "  samples dropped (9.2.3)", .directions = GREEDY_ICOSAHEDRAL, .goes_on = 1, .drops = 1, .no_second_pass = 1 },
	{ "98 and scouts, strict first", .directions = GREEDY_CORNERS, .strict = 1, .no_second_pass = 1 },
	{ "  second pass", .directions = GREEDY_CORNERS, .goes_on = 1, .strict = 1 },
};
#define BASE 7
#define N_GREEDY ((int)(sizeof greedy_rows / sizeof *greedy_rows))

/* psr's own way, at one level, and its result for a model. */
enum { OWNED = N_GREEDY, MERGED, DICED, REACHED, BUILT, N_ROWS };
static const char *const steps[] = { "psr: owned by what faces it best", "  blocks that own little merged away",
	                                 "    diced, and what is missing added (9.2.1)", "      until it is adequate",
	                                 "psr, all levels built" };

/* The kept samples of a level, measured like the others. */
static int measure_level(struct selections *s, int row, int model, const struct level *level, double seconds)
{
	struct draft draft = { .projection = level->sampling.projection, .ds = level->sampling.ds };
	struct greedy *greedy = NULL;
	struct greedy_result result;
	int rc = draft_add(&draft, level->sheets, &level->kept);

	if (rc != PSR_OK)
		psr_fail(s->study->err, rc, "no memory for a level");
	else
		rc = greedy_take_draft(&greedy, &draft, N_PROJECTIONS, s->study->resolution, &result, s->study->err);
	draft_fini(&draft);
	if (rc == PSR_OK)
		rc = selections_put(s, row, model, greedy, &result, seconds);
	greedy_destroy(greedy);
	return rc;
}

/* Blocks are kept once: ownership alone is a level by itself. */
static int run_steps(struct selections *s, int model, const struct surface *surface, int first, int last)
{
	const struct study *study = s->study;
	const struct study_model *m = &study->model[model];
	struct level level = { .sampling = { .mesh = m->mesh, .scene = m->scene, .surface = surface, .pool = study->pool,
		                                 .ds = 2.0 / study->resolution } };
	struct psr_build_options defaults;
	struct adequacy adequacy;
	double seconds = 0;
	int rc = PSR_OK;

	psr_build_options_default(&defaults);
	projection_list(level.sampling.projection, level.sampling.ds, defaults.tolerance);
	for (int row = first; rc == PSR_OK && row <= last; row++) {
		double started = clock_seconds();

		if (row == first)
			rc = level_own(&level, NULL);
		if (rc == PSR_OK && row == MERGED)
			level_merge(&level);
		if (rc == PSR_OK && (row == OWNED || row == MERGED))
			rc = level_keep(&level);
		else if (rc == PSR_OK && row == DICED)
			rc = level_mend(&level);
		else if (rc == PSR_OK)
			rc = level_reach(&adequacy, &level);
		seconds += clock_seconds() - started;
		if (rc != PSR_OK)
			psr_fail(study->err, rc, "no memory for a level");
		else
			rc = measure_level(s, row, model, &level, seconds);
	}
	level_fini(&level);
	return rc;
}

static int run_product(struct selections *s, int model)
{
	struct study *study = s->study;
	struct greedy *greedy = NULL;
	struct greedy_result result;
	struct surface surface;
	double seconds;
	int rc = surface_init(&surface, study->model[model].mesh, study->model[model].scale);

	for (int row = OWNED; row < N_ROWS; row++)
		study_label(&study->table, row, "%s", steps[row - OWNED]);
	if (rc != PSR_OK)
		psr_fail(study->err, rc, "no memory for the mesh's textures");
	else
		rc = run_steps(s, model, &surface, OWNED, OWNED);
	if (rc == PSR_OK)
		rc = run_steps(s, model, &surface, MERGED, REACHED);
	surface_fini(&surface);
	if (rc == PSR_OK)
		rc = selection_of_model(&greedy, &result, &seconds, study, &study->model[model]);
	if (rc == PSR_OK)
		rc = selections_put(s, BUILT, model, greedy, &result, seconds);
	greedy_destroy(greedy);
	return rc;
}

int table_selection(struct study *study)
{
	struct selections s;
	int rc = selections_start(&s, study, "selection", N_ROWS);

	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		rc = selections_run(&s, m, greedy_rows, N_GREEDY);
		if (rc == PSR_OK)
			rc = run_product(&s, m);
	}
	return selections_finish(&s, BASE, rc);
}
