/* Figures 8 to 10, 12 and 13 of [B]: offsets, textures finer than pixels, points beside splats by levels, and parts of
 * files. */
#include <string.h>
#include "figures.h"
#include "model/tree.h"
#include "models/studies/tables/octree.h"

#define RESOLUTION 256 /* of the blocks whose samples magnifications count in */

static void as_splats(struct figure_shot *shot)
{
	shot->settings.with_ewa = 1;
}

/* The first model of --models. */
static int load(struct figure_model *model, struct study *study)
{
	char name[512];

	snprintf(name, sizeof name, "%.*s", (int)strcspn(study->names, ","), study->names);
	return figure_model_load(model, study, name, NULL, RESOLUTION);
}

/* Makes an octree of the source, to be drawn in the place of its blocks; *tree as octree_points() gives it. */
static int load_octree(struct figure_model *out, struct octree **tree, struct study *study,
                       const struct figure_model *source, int levels)
{
	*out = (struct figure_model){ .model = NULL };
	return octree_points(&out->model, tree, study, &source->source, levels);
}

/* ---- figures 8 and 9 ---- */

#define OFFSET_LEVELS 8 /* as in [B] */

int figure_octree_offsets(struct study *study)
{
	static const double aslant[][3] = { { 1, 0.12, 0.4 }, { -0.6, 0.15, 1 }, { 0.3, -0.2, -1 } };
	static const struct figure_look look = { 3, 512, 4, aslant, .n_views = 3 };
	static const struct figure_part part = { FIGURE_FIND, 0, 96, 96, 2 };
	struct figure_model model, with = { .model = NULL }, without = { .model = NULL };
	struct figure_sheet sheet;
	struct octree *tree = NULL;
	int rc = load(&model, study);

	figure_sheet_init(&sheet, 5, &part);
	if (rc == PSR_OK)
		rc = load_octree(&with, &tree, study, &model, OFFSET_LEVELS);
	if (rc == PSR_OK) {
		struct octree plain = *tree; /* each leaf in the middle of its cell */

		plain.offset = NULL;
		rc = octree_model(&without.model, study, &plain);
	}
	if (rc == PSR_OK) {
		const struct figure_way way[] = {
			{ .label = "splats without offsets", .model = &without, .change = as_splats },
			{ .label = "points without offsets", .model = &without },
			{ .label = "points", .model = &with },
			{ .label = "splats", .model = &with, .change = as_splats },
			{ .label = NULL },
		};

		figure_score_print_head(model.source.name);
		rc = figure_compare(study, &sheet, &model, &look, &part, way);
	}
	rc = figure_sheet_finish(&sheet, study, "octree-offsets", rc);
	octree_destroy(tree);
	psr_model_unref(with.model);
	psr_model_unref(without.model);
	figure_model_fini(&model);
	return rc;
}

/* ---- figure 10 ---- */

#define ALIAS_LEVELS 10

int figure_octree_alias(struct study *study)
{
	static const double view[][3] = { { 0.5, 0.25, 1 }, { -1, 0.4, 0.3 }, { 0.2, 0.8, 1 } };
	static const struct figure_look whole = { 1.5, 384, 8, view, .n_views = 1 };
	static const struct figure_look all = { 1.5, 384, 8, view, .n_views = 3 };
	static const struct figure_part part = { 0, 104, 384, 192, 1 }, close = { FIGURE_FIND, 0, 96, 48, 4 };
	struct figure_model model, points = { .model = NULL };
	struct figure_sheet sheet;
	struct octree *tree = NULL;
	int rc = load(&model, study);

	figure_sheet_init(&sheet, 3, &part);
	if (rc == PSR_OK)
		rc = load_octree(&points, &tree, study, &model, ALIAS_LEVELS);
	octree_destroy(tree);
	if (rc == PSR_OK) {
		const struct figure_way way[] = {
			{ .label = "points", .model = &points },
			{ .label = "splats", .model = &points, .change = as_splats },
			{ .label = NULL },
		};

		figure_score_print_head("the first view");
		rc = figure_compare(study, &sheet, &model, &whole, &part, way);
		figure_score_print_head("all views");
		if (rc == PSR_OK)
			rc = figure_compare(study, &sheet, &model, &all, &close, way);
	}
	rc = figure_sheet_finish(&sheet, study, "octree-alias", rc);
	psr_model_unref(points.model);
	figure_model_fini(&model);
	return rc;
}

/* ---- figure 12 ---- */

int figure_octree_levels(struct study *study)
{
	static const struct figure_look look = { 6, 512, 4, figure_view, .n_views = FIGURE_VIEWS };
	static const struct figure_part part = { 128, 128, 256, 256, 1 };
	struct figure_model model;
	struct figure_sheet sheet;
	int rc = load(&model, study);

	figure_sheet_init(&sheet, 3, &part);
	if (rc == PSR_OK)
		figure_score_print_head(model.source.name);
	for (int levels = 9; rc == PSR_OK && levels <= 11; levels++) {
		struct figure_model points;
		struct octree *tree = NULL;
		char label[2][32];

		rc = load_octree(&points, &tree, study, &model, levels);
		octree_destroy(tree);
		for (int i = 0; i < 2; i++)
			snprintf(label[i], sizeof label[i], "%d levels, %s", levels, i == 0 ? "points" : "splats");
		const struct figure_way way[] = {
			{ .label = label[0], .model = &points },
			{ .label = label[1], .model = &points, .change = as_splats },
			{ .label = NULL },
		};
		if (rc == PSR_OK)
			rc = figure_compare(study, &sheet, &model, &look, &part, way);
		psr_model_unref(points.model);
	}
	rc = figure_sheet_finish(&sheet, study, "octree-levels", rc);
	figure_model_fini(&model);
	return rc;
}

/* ---- figure 13 ---- */

#define PARTS_LEVELS 10

int figure_octree_parts(struct study *study)
{
	static const struct figure_look first = { 1, 256, 4, figure_view, .n_views = 1 };
	static const struct figure_look look = { 1, 256, 4, figure_view, .n_views = FIGURE_VIEWS };
	static const struct figure_part part = { 0, 0, 256, 256, 1 }, close = { FIGURE_FIND, 0, 64, 64, 4 };
	struct figure_model model, parts[OCTREE_PARTS];
	struct figure_way way[OCTREE_PARTS + 1] = { { .label = NULL } };
	struct octree_packed packed = { .bytes = NULL };
	struct figure_sheet sheet;
	char label[OCTREE_PARTS][64];
	int n = 0, rc = load(&model, study);

	if (rc == PSR_OK)
		rc = octree_packed_make(&packed, study, &model.source, PARTS_LEVELS);
	for (int i = 0; rc == PSR_OK && i < OCTREE_PARTS; i++) {
		size_t n_bytes;

		parts[n] = (struct figure_model){ .model = octree_packed_part(&n_bytes, &packed, octree_parts[i]) };
		if (parts[n].model == NULL)
			continue;
		snprintf(label[n], sizeof label[n], "%u %%, %.2f MB, %d levels", octree_parts[i], (double)n_bytes * 1e-6,
		         psr_model_octree(parts[n].model)->levels);
		way[n] = (struct figure_way){ .label = label[n], .model = &parts[n] };
		n++;
	}
	figure_sheet_init(&sheet, (uint32_t)n + 1, &part);
	if (rc == PSR_OK) {
		figure_score_print_head("the first view");
		rc = figure_compare(study, &sheet, &model, &first, &part, way);
	}
	if (rc == PSR_OK) {
		figure_score_print_head("all views");
		rc = figure_compare(study, &sheet, &model, &look, &close, way);
	}
	rc = figure_sheet_finish(&sheet, study, "octree-parts", rc);
	while (n > 0)
		psr_model_unref(parts[--n].model);
	octree_packed_fini(&packed);
	figure_model_fini(&model);
	return rc;
}
