/* Table 1 of [B] again: bits a point, frames a second, beside blocks of the same models, and decibels of both. */
#include <stdlib.h>
#include "octree.h"
#include "octree/pack.h"

#define FIRST_LEVEL 9
#define N_LEVELS 3  /* as [B] has them: 9, 10 and 11 */

enum { POINTS, IN_CORE, PACKED, FAST, OFFSETS, NORMALS, COLORS, FPS, FPS_SPLATS, FPS_BLOCKS, DB, DB_SPLATS,
       DB_BLOCKS, WRONG, WRONG_SPLATS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[POINTS] = { "M pts", "million_points", 2 },    [IN_CORE] = { "codes", "codes", 2 },
	[PACKED] = { "packed", "codes_packed", 2 },     [FAST] = { "fast", "codes_fast", 2 },
	[OFFSETS] = { "offs.", "offsets", 2 },          [NORMALS] = { "norm.", "normals", 2 },
	[COLORS] = { "col.", "colors", 2 },             [FPS] = { "fps", "frames_per_second", 1 },
	[FPS_SPLATS] = { "splats", "splats_frames_per_second", 1 },
	[FPS_BLOCKS] = { "blocks", "blocks_frames_per_second", 1 },
	[DB] = { "dB", "db", 2 },                       [DB_SPLATS] = { "splats", "splats_db", 2 },
	[DB_BLOCKS] = { "blocks", "blocks_db", 2 },     [WRONG] = { "wrong", "wrong_pixels_a_million", 0 },
	[WRONG_SPLATS] = { "splats", "splats_wrong_pixels_a_million", 0 },
};

struct subject {
	struct study *study;
	const struct study_model *of;
	struct psr_model *blocks, *points;
	struct octree_truth truth;
	int row;
};

static double *value(const struct subject *s, int column)
{
	return study_at(&s->study->table, s->row, 0, column);
}

/* ---- bits ---- */

/* Finds the bytes of each stream of the packed tree. */
static int find_shares(struct octree_shares *shares, const struct subject *s, const struct octree *tree,
                       enum octree_packing packing)
{
	uint8_t *bytes;
	size_t n_bytes;
	const int rc = octree_pack(&bytes, &n_bytes, tree, packing, s->study->pool, s->study->err);

	*shares = (struct octree_shares){ .codes = 0 };
	if (rc != PSR_OK)
		return rc;
	octree_packed_shares(shares, bytes, n_bytes);
	free(bytes);
	return PSR_OK;
}

/* Normals are packed with 13 bits, as [B] has them: the last two of ours are a finer subdivision. */
static int put_bits(const struct subject *s, struct octree *tree)
{
	const double n = (double)tree->n_leaves;
	struct octree_shares small, fast;
	int rc;

	for (uint64_t i = 0; i < tree->n_leaves; i++)
		tree->normal[i] &= (uint16_t)~3u;
	rc = find_shares(&small, s, tree, OCTREE_SMALL);
	if (rc == PSR_OK)
		rc = find_shares(&fast, s, tree, OCTREE_FAST);
	if (rc != PSR_OK)
		return rc;
	*value(s, POINTS) = n * 1e-6;
	*value(s, IN_CORE) = 8.0 * (double)tree->n_codes / n;
	*value(s, PACKED) = 8.0 * (double)small.codes / n;
	*value(s, FAST) = 8.0 * (double)fast.codes / n;
	*value(s, NORMALS) = 8.0 * (double)small.stream[OCTREE_NORMAL_STREAM] / n;
	*value(s, OFFSETS) = 8.0 * (double)small.stream[OCTREE_OFFSET_STREAM] / n;
	*value(s, COLORS) = 8.0 * (double)small.stream[OCTREE_COLOR_STREAM] / n;
	return PSR_OK;
}

static int make_points(struct subject *s, int levels)
{
	struct octree *tree = NULL;
	int rc = octree_points(&s->points, &tree, s->study, s->of, levels);

	if (rc == PSR_OK)
		rc = put_bits(s, tree);
	octree_destroy(tree);
	return rc;
}

static int put_pictures(const struct subject *s)
{
	const struct octree_way way[] = { { .model = s->points }, { .model = s->points, .with_splats = 1 }, { .model = s->blocks } };
	struct octree_drawn drawn[3];
	const int rc = octree_compare(drawn, s->study, s->of, way, 3, &s->truth);

	if (rc != PSR_OK)
		return rc;
	*value(s, FPS) = drawn[0].fps;
	*value(s, FPS_SPLATS) = drawn[1].fps;
	*value(s, FPS_BLOCKS) = drawn[2].fps;
	*value(s, DB) = drawn[0].db;
	*value(s, DB_SPLATS) = drawn[1].db;
	*value(s, DB_BLOCKS) = drawn[2].db;
	*value(s, WRONG) = drawn[0].wrong;
	*value(s, WRONG_SPLATS) = drawn[1].wrong;
	return PSR_OK;
}

static int run_model(struct subject *s)
{
	int rc = octree_truth_init(&s->truth, s->study, s->of);

	if (rc == PSR_OK)
		rc = study_build(&s->blocks, NULL, s->study, s->of);
	for (int l = 0; rc == PSR_OK && l < N_LEVELS; l++, s->row++) {
		study_label(&s->study->table, s->row, "%.20s %d", s->of->name, FIRST_LEVEL + l);
		rc = make_points(s, FIRST_LEVEL + l);
		if (rc == PSR_OK)
			rc = put_pictures(s);
		psr_model_unref(s->points);
		s->points = NULL;
		study_step(s->study, s->of->name);
	}
	octree_truth_fini(&s->truth);
	psr_model_unref(s->blocks);
	return rc;
}

int table_octree(struct study *study)
{
	const struct study_form form = { "model, levels", columns, N_COLUMNS };
	struct subject s = { .study = study };
	int rc = study_table_init(&study->table, form, study->n_models * N_LEVELS, 1, study->err);

	study->total = study->n_models * N_LEVELS;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		s.of = &study->model[m];
		s.blocks = s.points = NULL;
		rc = run_model(&s);
	}
	psr_renderer_destroy(study->renderer);
	return rc;
}
