/* Figure 13 of [B] again: what there is to be seen when a part of the packed file has come. */
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "model/pack.h"
#include "octree.h"

#define LEVELS 11
#define N_PARTS 4

static const unsigned parts[N_PARTS] = { 5, 15, 50, 100 }; /* percent, as in [B] */

enum { CAME, DEPTH, POINTS, FPS, DB, BELOW, WRONG, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[CAME] = { "MB", "megabytes", 3 },          [DEPTH] = { "levels", "levels", 0 },
	[POINTS] = { "M pts", "million_points", 3 }, [FPS] = { "fps", "frames_per_second", 1 },
	[DB] = { "dB", "db", 2 },                   [BELOW] = { "below", "db_below_the_whole", 2 },
	[WRONG] = { "wrong", "wrong_pixels_a_million", 0 },
};

/* A packed file of a model, in memory. */
struct packed {
	uint8_t *bytes;
	size_t n, capacity;
	struct psr_model *whole;
};

static int make_packed(struct packed *packed, struct study *study, const struct study_model *of)
{
	struct octree *tree = NULL;
	const uint8_t *image;
	size_t n_image;
	int rc = octree_points(&packed->whole, &tree, study, of, LEVELS);

	octree_destroy(tree);
	if (rc != PSR_OK)
		return rc;
	image = model_image(packed->whole, &n_image);
	return pack_image(&packed->bytes, &packed->n, &packed->capacity, image, n_image, study->err);
}

/* Puts down what the first bytes of the file are; nothing where they are no model. */
static int put_part(struct study *study, int row, const struct study_model *of, const struct packed *packed,
                    const struct octree_truth *truth)
{
	const size_t n = packed->n / 100 * parts[row % N_PARTS] + packed->n % 100 * parts[row % N_PARTS] / 100;
	struct psr_model *part = NULL;
	struct octree_drawn drawn[2];
	int rc;

	*study_at(&study->table, row, 0, CAME) = (double)n * 1e-6;
	if (psr_model_parse(&part, packed->bytes, n, NULL) != PSR_OK)
		return PSR_OK;
	const struct octree_way way[] = { { .model = part }, { .model = packed->whole } };
	rc = octree_compare(drawn, study, of, way, 2, truth);
	*study_at(&study->table, row, 0, DEPTH) = psr_model_octree(part)->levels;
	*study_at(&study->table, row, 0, POINTS) = (double)psr_model_octree(part)->n_leaves * 1e-6;
	psr_model_unref(part);
	if (rc != PSR_OK)
		return rc;
	*study_at(&study->table, row, 0, FPS) = drawn[0].fps;
	*study_at(&study->table, row, 0, DB) = drawn[0].db;
	*study_at(&study->table, row, 0, BELOW) = drawn[1].db - drawn[0].db;
	*study_at(&study->table, row, 0, WRONG) = drawn[0].wrong;
	return PSR_OK;
}

static int run_model(struct study *study, int m)
{
	const struct study_model *of = &study->model[m];
	struct packed packed = { .bytes = NULL };
	struct octree_truth truth;
	int rc = octree_truth_init(&truth, study, of);

	if (rc == PSR_OK)
		rc = make_packed(&packed, study, of);
	for (int p = 0; rc == PSR_OK && p < N_PARTS; p++) {
		study_label(&study->table, m * N_PARTS + p, "%.20s %u %%", of->name, parts[p]);
		rc = put_part(study, m * N_PARTS + p, of, &packed, &truth);
		study_step(study, of->name);
	}
	psr_free_huge(packed.bytes, packed.capacity);
	psr_model_unref(packed.whole);
	octree_truth_fini(&truth);
	return rc;
}

int table_octree_prefixes(struct study *study)
{
	const struct study_form form = { "model, part", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, study->n_models * N_PARTS, 1, study->err);

	study->total = study->n_models * N_PARTS;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++)
		rc = run_model(study, m);
	psr_renderer_destroy(study->renderer);
	return rc;
}
