/* Figure 13 of [B] again: what there is to be seen when a part of the packed file has come. */
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "model/pack.h"
#include "octree.h"

#define LEVELS 11

const unsigned octree_parts[OCTREE_PARTS] = { 5, 15, 50, 100 };

enum { CAME, DEPTH, POINTS, FPS, DB, BELOW, WRONG, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[CAME] = { "MB", "megabytes", 3 },          [DEPTH] = { "levels", "levels", 0 },
	[POINTS] = { "M pts", "million_points", 3 }, [FPS] = { "fps", "frames_per_second", 1 },
	[DB] = { "dB", "db", 2 },                   [BELOW] = { "below", "db_below_the_whole", 2 },
	[WRONG] = { "wrong", "wrong_pixels_a_million", 0 },
};

int octree_packed_make(struct octree_packed *packed, struct study *study, const struct study_model *of, int levels)
{
	struct octree *tree = NULL;
	const uint8_t *image;
	size_t n_image;
	int rc;

	*packed = (struct octree_packed){ .bytes = NULL };
	rc = octree_points(&packed->whole, &tree, study, of, levels);
	octree_destroy(tree);
	if (rc != PSR_OK)
		return rc;
	image = model_image(packed->whole, &n_image);
	return pack_image(&packed->bytes, &packed->n, &packed->capacity, image, n_image, study->err);
}

void octree_packed_fini(struct octree_packed *packed)
{
	psr_free_huge(packed->bytes, packed->capacity);
	psr_model_unref(packed->whole);
}

struct psr_model *octree_packed_part(size_t *n, const struct octree_packed *packed, unsigned percent)
{
	struct psr_model *part = NULL;

	*n = packed->n / 100 * percent + packed->n % 100 * percent / 100;
	return psr_model_parse(&part, packed->bytes, *n, NULL) == PSR_OK ? part : NULL;
}

/* Puts down what the first bytes of the file are; nothing where they are no model. whole_db: of all of them. */
static int put_part(struct study *study, int row, const struct study_model *of,
                    const struct octree_packed *packed, const struct octree_truth *truth, double whole_db)
{
	struct octree_drawn drawn;
	size_t n;
	struct psr_model *part = octree_packed_part(&n, packed, octree_parts[row % OCTREE_PARTS]);
	int rc;

	*study_at(&study->table, row, 0, CAME) = (double)n * 1e-6;
	if (part == NULL)
		return PSR_OK;
	rc = octree_compare(&drawn, study, of, &(struct octree_way){ .model = part }, 1, truth);
	*study_at(&study->table, row, 0, DEPTH) = psr_model_octree(part)->levels;
	*study_at(&study->table, row, 0, POINTS) = (double)psr_model_octree(part)->n_leaves * 1e-6;
	psr_model_unref(part);
	if (rc != PSR_OK)
		return rc;
	*study_at(&study->table, row, 0, FPS) = drawn.fps;
	*study_at(&study->table, row, 0, DB) = drawn.db;
	*study_at(&study->table, row, 0, BELOW) = whole_db - drawn.db;
	*study_at(&study->table, row, 0, WRONG) = drawn.wrong;
	return PSR_OK;
}

static int run_model(struct study *study, int m)
{
	const struct study_model *of = &study->model[m];
	struct octree_packed packed = { .bytes = NULL };
	struct octree_drawn whole = { 0 };
	struct octree_truth truth;
	int rc = octree_truth_init(&truth, study, of);

	if (rc == PSR_OK)
		rc = octree_packed_make(&packed, study, of, LEVELS);
	if (rc == PSR_OK)
		rc = octree_compare(&whole, study, of, &(struct octree_way){ .model = packed.whole }, 1, &truth);
	for (int p = 0; rc == PSR_OK && p < OCTREE_PARTS; p++) {
		study_label(&study->table, m * OCTREE_PARTS + p, "%.20s %u %%", of->name, octree_parts[p]);
		rc = put_part(study, m * OCTREE_PARTS + p, of, &packed, &truth, whole.db);
		study_step(study, of->name);
	}
	octree_packed_fini(&packed);
	octree_truth_fini(&truth);
	return rc;
}

int table_octree_prefixes(struct study *study)
{
	const struct study_form form = { "model, part", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, study->n_models * OCTREE_PARTS, 1, study->err);

	study->total = study->n_models * OCTREE_PARTS;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++)
		rc = run_model(study, m);
	psr_renderer_destroy(study->renderer);
	return rc;
}
