/* Points and splats a second, told in both ways: as table 1 of [B] has them, of the whole tree, which is drawn down to its
 * leaves for that, and beside what is asked; and those that are placed in the picture. */
#include "octree.h"

#define FIRST_LEVEL 9
#define N_LEVELS 3

/* Asked for, in millions a second. */
#define OF_SURFACES 400
#define OF_SCANS 230
#define OF_SPLATS 30

enum { POINTS, WHOLE, ASKED, WHOLE_SPLATS, ASKED_SPLATS, DRAWN, WARPED, SHARE, OF_FRAMES, RATE, SPLATS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[POINTS] = { "M pts", "million_points", 2 },
	[WHOLE] = { "whole", "million_points_of_the_tree_per_second", 0 },
	[ASKED] = { "asked", "million_points_of_the_tree_asked_per_second", 0 },
	[WHOLE_SPLATS] = { "splats", "million_splats_of_the_tree_per_second", 0 },
	[ASKED_SPLATS] = { "asked", "million_splats_of_the_tree_asked_per_second", 0 },
	[DRAWN] = { "drawn", "million_points_drawn", 3 },
	[WARPED] = { "warped", "million_points_warped", 3 },
	[SHARE] = { "%", "percent_warped", 1 },
	[OF_FRAMES] = { "frames", "million_points_warped_per_second_of_frames", 0 },
	[RATE] = { "Mpt/s", "million_points_warped_per_second", 0 },
	[SPLATS] = { "Mspl/s", "million_splats_warped_per_second", 0 },
};

static int put_rates(struct study *study, int row, const struct study_model *of, const struct psr_model *model,
                     double n_points)
{
	const struct octree_way way[] = { { .model = model }, { .model = model, .with_splats = 1 },
		                              { .model = model, .is_whole = 1 },
		                              { .model = model, .with_splats = 1, .is_whole = 1 } };
	struct octree_rate rate[4];
	const int rc = octree_rates(rate, study, of, way, 4);
	const struct octree_rate *points = &rate[0], *splats = &rate[1], *whole = &rate[2], *whole_splats = &rate[3];
	const double value[N_COLUMNS] = {
		[POINTS] = n_points * 1e-6,
		[WHOLE] = OCTREE_VIEWS * n_points / whole->seconds * 1e-6,
		[ASKED] = of->is_scanned ? OF_SCANS : OF_SURFACES,
		[WHOLE_SPLATS] = OCTREE_VIEWS * n_points / whole_splats->seconds * 1e-6,
		[ASKED_SPLATS] = OF_SPLATS,
		[DRAWN] = points->drawn / OCTREE_VIEWS * 1e-6,
		[WARPED] = points->warped / OCTREE_VIEWS * 1e-6,
		[SHARE] = 100 * points->warped / OCTREE_VIEWS / n_points,
		[OF_FRAMES] = points->warped / points->seconds * 1e-6,
		[RATE] = points->warped / points->warp_seconds * 1e-6,
		[SPLATS] = splats->warped / splats->warp_seconds * 1e-6,
	};

	for (int c = 0; rc == PSR_OK && c < N_COLUMNS; c++)
		*study_at(&study->table, row, 0, c) = value[c];
	return rc;
}

static int run_level(struct study *study, int row, const struct study_model *of, int levels)
{
	struct psr_model *model = NULL;
	struct octree *tree = NULL;
	int rc = octree_points(&model, &tree, study, of, levels);

	study_label(&study->table, row, "%.20s %d", of->name, levels);
	if (rc == PSR_OK)
		rc = put_rates(study, row, of, model, (double)tree->n_leaves);
	octree_destroy(tree);
	psr_model_unref(model);
	study_step(study, of->name);
	return rc;
}

int table_octree_points(struct study *study)
{
	const struct study_form form = { "model, levels", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, study->n_models * N_LEVELS, 1, study->err);

	study->total = study->n_models * N_LEVELS;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	for (int row = 0; rc == PSR_OK && row < study->total; row++)
		rc = run_level(study, row, &study->model[row / N_LEVELS], FIRST_LEVEL + row % N_LEVELS);
	psr_renderer_destroy(study->renderer);
	return rc;
}
