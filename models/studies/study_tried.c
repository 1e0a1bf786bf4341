#include <string.h>
#include <time.h>
#include "psr/build.h"
#include "sample/levels/draft.h"
#include "sample/level.h"
#include "study.h"

static const struct variant {
	const char *label;
	enum greedy_directions directions;
	int goes_on; /* from the row before */
	int second_pass, is_one_test, not_facing, by_score, drops, strict;
	double depth;   /* 0: 1 */
	int side;       /* of blocks; 0: 8 */
	double degrees; /* of a square lattice; 0: the equilateral one, at 25 */
} variants[] = {
	{ "[G] 32, one test, both passes", GREEDY_THESIS, .second_pass = 1, .is_one_test = 1 },
	{ "[G] 32, backs count, both passes", GREEDY_THESIS, .second_pass = 1, .not_facing = 1 },
	{ "[G] 32, depths 10 times as strict, first pass", GREEDY_THESIS, .depth = 0.1 },
	{ "  both passes", GREEDY_THESIS, .goes_on = 1, .second_pass = 1, .depth = 0.1 },
	{ "[G] 32, blocks of 4x4, both passes", GREEDY_THESIS, .second_pass = 1, .side = 4 },
	{ "[G] 32, blocks of 16x16, both passes", GREEDY_THESIS, .second_pass = 1, .side = 16 },
	{ "[G] 32, first pass", GREEDY_THESIS, .goes_on = 0 },
	{ "  both passes", GREEDY_THESIS, .goes_on = 1, .second_pass = 1 },
	{ "    samples dropped (9.2.3)", GREEDY_THESIS, .goes_on = 1, .drops = 1 },
	{ "[G] 32, square lattice, 40 degrees, both passes", GREEDY_THESIS, .second_pass = 1, .degrees = 40 },
	{ "icosahedral 32, first pass", GREEDY_ICOSAHEDRAL, .goes_on = 0 },
	{ "  both passes", GREEDY_ICOSAHEDRAL, .goes_on = 1, .second_pass = 1 },
	{ "    samples dropped (9.2.3)", GREEDY_ICOSAHEDRAL, .goes_on = 1, .drops = 1 },
	{ "icosahedral 32, by score (9.2.2)", GREEDY_ICOSAHEDRAL, .by_score = 1 },
	{ "  samples dropped (9.2.3)", GREEDY_ICOSAHEDRAL, .goes_on = 1, .drops = 1 },
	{ "98 and scouts, strict first", GREEDY_CORNERS, .strict = 1 },
	{ "  second pass", GREEDY_CORNERS, .goes_on = 1, .second_pass = 1, .strict = 1 },
};
#define BASE_VARIANT 7
#define N_VARIANTS ((int)(sizeof variants / sizeof *variants))

/* psr's own way, of one level, and what it makes of a model. */
enum { OWNED = N_VARIANTS, MERGED, DICED, REACHED, BUILT, N_ROWS };
static const char *const steps[] = { "psr: owned by what faces it best", "  blocks that own little merged away",
	                                 "    diced, and what is missing added (9.2.1)", "      until it is adequate",
	                                 "psr, all levels built" };

static void set_label(struct study *study, int row, const char *text)
{
	snprintf(study->table.label[row], sizeof study->table.label[row], "%s", text);
}

static int run_variant(struct study *study, int row, int model, struct greedy *greedy)
{
	const struct variant *variant = &variants[row];
	struct greedy_select_options options;

	greedy_select_default(&options);
	options.goes_on = variant->goes_on;
	options.second_pass = variant->second_pass;
	options.is_facing = !variant->not_facing;
	options.by_score = variant->by_score;
	options.drops_samples = variant->drops;
	options.is_strict_first = options.forgives_outlines = variant->strict;
	if (variant->depth > 0)
		options.depth_tolerance = variant->depth;
	if (variant->is_one_test)
		options.n_rotations = options.n_shifts = 1;
	if (variant->side != 0)
		options.side = variant->side;
	return study_select(study, row, model, greedy, &options);
}

static int run_variants(struct study *study, int model)
{
	struct greedy *greedy = NULL;
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < N_VARIANTS; i++) {
		const struct variant *variant = &variants[i], *before = i > 0 ? variant - 1 : NULL;
		int is_square = variant->degrees > 0;

		set_label(study, i, variant->label);
		if (before == NULL || variant->directions != before->directions || is_square || before->degrees > 0) {
			greedy_destroy(greedy);
			greedy = NULL;
			rc = study_scan(&greedy, study, model, is_square ? variant->degrees : 25,
			                is_square ? GREEDY_SQUARE : GREEDY_EQUILATERAL, variant->directions);
		}
		if (rc == PSR_OK)
			rc = run_variant(study, i, model, greedy);
	}
	greedy_destroy(greedy);
	return rc;
}

static double now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

/* What is kept of a level, as the others are measured. */
static int measure_level(struct study *study, int row, int model, const struct level *level,
                         double seconds)
{
	struct draft draft = { .projection = level->sampling.projection, .ds = level->sampling.ds };
	struct greedy *greedy = NULL;
	struct greedy_result result;
	int rc = draft_add(&draft, level->sheets, &level->kept);

	if (rc != PSR_OK)
		psr_fail(study->err, rc, "no memory for a level");
	else
		rc = greedy_take_draft(&greedy, &draft, N_PROJECTIONS, study->resolution, &result, study->err);
	draft_fini(&draft);
	if (rc == PSR_OK)
		rc = study_put(study, row, model, greedy, &result, seconds);
	greedy_destroy(greedy);
	return rc;
}

/* Blocks are kept once: ownership alone is a level by itself. */
static int run_steps(struct study *study, int model, const struct surface *surface, int first, int last)
{
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
		double started = now();

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
		seconds += now() - started;
		if (rc != PSR_OK)
			psr_fail(study->err, rc, "no memory for a level");
		else
			rc = measure_level(study, row, model, &level, seconds);
	}
	level_fini(&level);
	return rc;
}

static int run_product(struct study *study, int model)
{
	struct greedy *greedy = NULL;
	struct greedy_result result;
	struct surface surface;
	double seconds;
	int rc = surface_init(&surface, study->model[model].mesh, study->model[model].scale);

	for (int row = OWNED; row < N_ROWS; row++)
		set_label(study, row, steps[row - OWNED]);
	if (rc != PSR_OK)
		psr_fail(study->err, rc, "no memory for the mesh's textures");
	else
		rc = run_steps(study, model, &surface, OWNED, OWNED);
	if (rc == PSR_OK)
		rc = run_steps(study, model, &surface, MERGED, REACHED);
	surface_fini(&surface);
	if (rc == PSR_OK)
		rc = study_build(&greedy, &result, &seconds, study, &study->model[model]);
	if (rc == PSR_OK)
		rc = study_put(study, BUILT, model, greedy, &result, seconds);
	greedy_destroy(greedy);
	return rc;
}

int study_run_selection(struct study *study)
{
	int rc = study_start(study, "selection", N_ROWS);

	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		rc = run_variants(study, m);
		if (rc == PSR_OK)
			rc = run_product(study, m);
	}
	if (rc == PSR_OK)
		rc = study_finish(study, BASE_VARIANT);
	return rc;
}
