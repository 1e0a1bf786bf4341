/* Differential points of meshes: how many their curvatures leave. */
#include "base/clock.h"
#include "dpoint/mesh.h"
#include "models/studies/lib/study.h"
#include "study_dpoint.h"

#define EPSILON 0.02
#define CELL 0.02      /* triangles are cut into these; radii of the model */
#define DELTA 0.1f

enum { TRIANGLES, PIECES, BAD, POINTS, PER_TRIANGLE, BYTES, SECONDS, NORMAL_RMS, NORMAL_WORST, HEIGHT_WORST, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	{ "triangles", "triangles", 0 }, { "pieces", "pieces", 0 }, { "bad", "bad", 0 }, { "points", "points", 0 },
	{ "a triangle", "points_a_triangle", 2 }, { "kB", "kilobytes", 0 }, { "s", "seconds", 1 },
	{ "normal rms", "normal_rms_degrees", 2 }, { "worst", "normal_worst_degrees", 1 },
	{ "height worst", "height_worst", 4 },
};

static int measure(double value[N_COLUMNS], const struct study_model *model, struct study *study)
{
	static const struct dpoint_cover_options options = {
		.slack = 2e-5f, .angle = (float)(4 * PSR_DEGREE), .height = 0.002f, .overhang = 1e-3f,
	};
	struct dpoint_cover_options with = options;
	struct dpoint_mesh_options mesh = { .scale = 1 / model->scale, .cell = CELL, .delta = DELTA };
	struct dpoint_surface surface;
	struct dpoint_cover cover = { 0 };
	struct dpoint_choice choice = { 0 };
	struct dpoint_errors errors;
	const double start = clock_seconds();
	int rc;

	with.sine = dpoint_sine(EPSILON);
	for (int k = 0; k < 3; k++)
		mesh.origin[k] = model->origin[k];
	dpoint_surface_init(&surface);
	rc = dpoint_sample_mesh(&surface, model->mesh, &mesh, study->err);
	value[PIECES] = (double)surface.n_candidates;
	if (rc == PSR_OK) {
		rc = dpoint_simplify(&choice, &cover, &surface, &with, 4, study->pool, NULL);
		value[SECONDS] = clock_seconds() - start;
		if (rc == PSR_OK)
			rc = dpoint_measure(&errors, &surface, &cover, &choice, study->pool);
		if (rc != PSR_OK)
			psr_fail(study->err, rc, "no memory for the points of %s", model->name);
	}
	if (rc == PSR_OK) {
		value[TRIANGLES] = model->mesh->n_triangles;
		value[BAD] = (double)surface.n_bad;
		value[POINTS] = (double)choice.n_kept;
		value[PER_TRIANGLE] = (double)choice.n_kept / model->mesh->n_triangles;
		value[BYTES] = (double)choice.n_kept * sizeof(struct dpoint_word) / 1e3;
		value[NORMAL_RMS] = errors.normal_rms / PSR_DEGREE;
		value[NORMAL_WORST] = errors.normal_worst / PSR_DEGREE;
		value[HEIGHT_WORST] = errors.height_worst;
	}
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	return rc;
}

int table_dpoint_meshes(struct study *study)
{
	const struct study_form form = { "model", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, study->n_models, 1, study->err);

	study->total = study->n_models;
	for (int i = 0; i < study->n_models && rc == PSR_OK; i++) {
		study_label(&study->table, i, "%s", study->model[i].name);
		rc = measure(study_at(&study->table, i, 0, 0), &study->model[i], study);
		study_step(study, study->model[i].name);
	}
	return rc;
}
