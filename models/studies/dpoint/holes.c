/* Holes between differential points: views around a model, from half to sixteen times the size that it is made for. */
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "measure/measure.h"
#include "model/points.h"
#include "model/tree.h"
#include "render/stages.h"
#include "study_dpoint.h"

#define SIDE 512   /* pixels, of what is magnified; of smaller objects, as many as they fill */
#define DISTANCE 4 /* of the eye, in radii */
#define N_SIZES 6
#define N_VIEWS 8

static const double magnification[N_SIZES] = { 0.5, 1, 2, 4, 8, 16 };

/* Azimuth and elevation, degrees. */
static const double view[N_VIEWS][2] = {
	{ 20, 20 }, { 110, -10 }, { 200, -40 }, { 290, 60 }, { 65, 5 }, { 155, -70 }, { 245, 85 }, { 335, 0 },
};

enum { POINTS, INSIDE, HOLES, ALL = HOLES + N_SIZES, BLOCKS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[POINTS] = { "points", "points", 0 }, [INSIDE] = { "M pixels", "million_pixels", 2 },
	[HOLES] = { "0.5", "holes_half", 0 }, [HOLES + 1] = { "1", "holes_1", 0 }, [HOLES + 2] = { "2", "holes_2", 0 },
	[HOLES + 3] = { "4", "holes_4", 0 }, [HOLES + 4] = { "8", "holes_8", 0 }, [HOLES + 5] = { "16", "holes_16", 0 },
	[ALL] = { "holes", "holes", 0 }, [BLOCKS] = { "blocks", "blocks_holes", 0 },
};

static void set_camera(struct psr_camera *camera, const struct study_model *of, const double degrees[2], double times,
                       uint32_t side, uint32_t resolution)
{
	const double azimuth = degrees[0] * PSR_DEGREE, elevation = degrees[1] * PSR_DEGREE;
	const double away[3] = { sin(azimuth) * cos(elevation), sin(elevation), cos(azimuth) * cos(elevation) };

	*camera = (struct psr_camera){ .up = { 0, 1, 0 }, .kind = PSR_CAMERA_PERSPECTIVE };
	memcpy(camera->target, of->origin, sizeof camera->target);
	memcpy(camera->eye, of->origin, sizeof camera->eye);
	v3d_add_scaled(camera->eye, camera->eye, DISTANCE * of->scale, away);
	camera->fov_y = 2 * atan(side / (resolution * times * DISTANCE));
}

static int count(uint64_t *n_holes, uint64_t *n_inside, const struct study *study, const struct psr_model *model,
                 const struct psr_truth_shot *shot, const struct psr_frame *frame)
{
	struct psr_accuracy accuracy;
	const int rc = psr_accuracy_measure(&accuracy, shot, frame->depth, psr_model_info(model)->spacing, study->err);

	if (rc == PSR_OK) {
		*n_holes += accuracy.n_holes;
		*n_inside += accuracy.n_inside;
	}
	return rc;
}

/* Draws all views of a size; of two models the second is blocks. */
static int draw_views(uint64_t n_holes[2], uint64_t *n_inside, const struct study *study,
                      struct psr_model *const model[2], struct psr_truth *truth, const struct study_model *of,
                      double times)
{
	const uint32_t side = (uint32_t)fmin(SIDE, study->resolution * times);
	struct psr_instance instance = { .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
	struct render_settings settings;
	struct psr_frame frame;
	int rc = psr_frame_alloc(&frame, side, side, 1u << PSR_PLANE_DEPTH, study->err);

	render_settings_default(&settings, side, side);
	for (int v = 0; v < N_VIEWS; v++)
		for (int k = 0; k < 2 && rc == PSR_OK; k++) {
			const struct psr_truth_shot shot = { truth, &scene.camera, side, side, study->n_threads };
			uint64_t again = 0;

			instance.model = model[k];
			set_camera(&scene.camera, of, view[v], times, side, study->resolution);
			rc = renderer_draw(study->renderer, &scene, &settings, study->pool, &frame, study->err);
			if (rc == PSR_OK)
				rc = count(&n_holes[k], k == 0 ? n_inside : &again, study, model[k], &shot, &frame);
		}
	psr_frame_free(&frame);
	return rc;
}

static int run_model(struct study *study, const struct study_model *of, int row)
{
	double *value = study_at(&study->table, row, 0, 0);
	struct psr_model *model[2] = { NULL, NULL };
	struct psr_truth *truth = NULL;
	uint64_t n_inside = 0, n_all[2] = { 0, 0 };
	int rc = study_dpoint_of_mesh(&model[0], study, of);

	study_label(&study->table, row, "%.20s", of->name);
	if (rc == PSR_OK)
		rc = study_build(&model[1], NULL, study, of);
	if (rc == PSR_OK)
		rc = psr_truth_create(&truth, of->mesh, study->err);
	for (int i = 0; i < N_SIZES && rc == PSR_OK; i++) {
		uint64_t n_holes[2] = { 0, 0 };

		rc = draw_views(n_holes, &n_inside, study, model, truth, of, magnification[i]);
		value[HOLES + i] = (double)n_holes[0];
		for (int k = 0; k < 2; k++)
			n_all[k] += n_holes[k];
		study_step(study, of->name);
	}
	if (rc == PSR_OK) {
		value[POINTS] = psr_model_point_set(model[0])->n_points;
		value[INSIDE] = (double)n_inside * 1e-6;
		value[ALL] = (double)n_all[0];
		value[BLOCKS] = (double)n_all[1];
	}
	psr_truth_destroy(truth);
	psr_model_unref(model[0]);
	psr_model_unref(model[1]);
	return rc;
}

int table_dpoint_holes(struct study *study)
{
	const struct study_form form = { "model", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, study->n_models, 1, study->err);

	study->total = study->n_models * N_SIZES;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++)
		rc = run_model(study, &study->model[m], m);
	psr_renderer_destroy(study->renderer);
	return rc;
}
