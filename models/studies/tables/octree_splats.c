/* Leaves as points and as splats of [B] 5.2, from leaves of about a pixel on: decibels to the traced source. */
#include <math.h>
#include "octree.h"

#define FINEST 9 /* levels whose leaves are about a pixel: magnification 1 */
#define N_MAGNIFICATIONS 3

/* Points and splats of each way beside each other. */
enum { LEAF, PLAIN, SMOOTH = PLAIN + 2, FINE = SMOOTH + 2, PASS = FINE + 2, INSIDE, WRONG = INSIDE + 2, TIME = WRONG + 2,
       N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[LEAF] = { "leaf", "leaf_px", 2 },
	[PLAIN] = { "points", "points_db", 2 },         [PLAIN + 1] = { "splats", "splats_db", 2 },
	[SMOOTH] = { "smooth", "points_smooth_db", 2 }, [SMOOTH + 1] = { "splats", "splats_smooth_db", 2 },
	[FINE] = { "fine", "points_fine_db", 2 },       [FINE + 1] = { "splats", "splats_fine_db", 2 },
	[PASS] = { "pass 2", "pass_2_db", 2 },
	[INSIDE] = { "inside", "points_inside_db", 2 }, [INSIDE + 1] = { "splats", "splats_inside_db", 2 },
	[WRONG] = { "wrong", "points_wrong_a_million", 0 },
	[WRONG + 1] = { "splats", "splats_wrong_a_million", 0 },
	[TIME] = { "time", "splats_time_over_points", 1 },
};

struct subject {
	struct study *study;
	const struct study_model *of;
	struct psr_model *model;
	struct octree_truth truth;
	int row;
};

static double *value(const struct subject *s, int column)
{
	return study_at(&s->study->table, s->row, 0, column);
}

static int draw(struct octree_drawn *drawn, const struct subject *s, enum psr_smooth smooth, unsigned pass,
                int with_splats)
{
	struct psr_settings settings;

	psr_settings_default(&settings, OCTREE_SIDE, OCTREE_SIDE);
	settings.smooth = smooth;
	settings.pass = pass;
	settings.with_splats = with_splats;
	return octree_score(drawn, s->study, s->of, s->model, &settings, &s->truth);
}

static int put_pictures(const struct subject *s)
{
	static const int column[] = { [PSR_SMOOTH_NONE] = PLAIN, [PSR_SMOOTH_EDGES] = SMOOTH, [PSR_SMOOTH_FINE] = FINE };
	struct octree_drawn drawn[2];
	int rc = PSR_OK;

	for (int smooth = PSR_SMOOTH_NONE; rc == PSR_OK && smooth <= PSR_SMOOTH_FINE; smooth++)
		for (int i = 0; rc == PSR_OK && i < 2; i++) {
			rc = draw(&drawn[i], s, (enum psr_smooth)smooth, 0, i);
			*value(s, column[smooth] + i) = drawn[i].db;
			if (smooth != PSR_SMOOTH_NONE)
				continue;
			*value(s, INSIDE + i) = drawn[i].inside_db;
			*value(s, WRONG + i) = drawn[i].wrong;
			*value(s, TIME) = drawn[0].fps / drawn[i].fps;
		}
	if (rc == PSR_OK)
		rc = draw(&drawn[0], s, PSR_SMOOTH_NONE, 2, 0);
	*value(s, PASS) = drawn[0].db;
	return rc;
}

static int run_model(struct subject *s)
{
	int rc = octree_truth_init(&s->truth, s->study, s->of);

	for (int i = 0; rc == PSR_OK && i < N_MAGNIFICATIONS; i++, s->row++) {
		struct octree *tree = NULL;

		study_label(&s->study->table, s->row, "%.20s %d", s->of->name, 1 << i);
		rc = octree_points(&s->model, &tree, s->study, s->of, FINEST - i);
		*value(s, LEAF) = tree != NULL ? ldexp(tree->edge, -tree->levels) * octree_pixels(s->of) : NAN;
		octree_destroy(tree);
		if (rc == PSR_OK)
			rc = put_pictures(s);
		psr_model_unref(s->model);
		s->model = NULL;
		study_step(s->study, s->of->name);
	}
	octree_truth_fini(&s->truth);
	return rc;
}

int table_octree_splats(struct study *study)
{
	const struct study_form form = { "model, magnification", columns, N_COLUMNS };
	struct subject s = { .study = study };
	int rc = study_table_init(&study->table, form, study->n_models * N_MAGNIFICATIONS, 1, study->err);

	study->total = study->n_models * N_MAGNIFICATIONS;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		s.of = &study->model[m];
		rc = run_model(&s);
	}
	psr_renderer_destroy(study->renderer);
	return rc;
}
