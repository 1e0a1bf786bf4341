/* Views of a model as studies of octrees take them, the truth of these, and what frames cost and miss. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/vec.h"
#include "model/tree.h"
#include "octree.h"
#include "render/render.h"
#include "render/stages.h"
#include "sample/octree/of_mesh.h"

#define RAYS 4      /* along the side of a pixel */
#define TRIALS 9    /* frames of each view and model, in turn; the least time counts: other work only adds to it */
#define DISTANCE 4  /* of the eye, in radii */
#define MARGIN 1.05

static const double directions[OCTREE_VIEWS][3] = { { 0.5, 0.4, 1 }, { -0.9, 0.7, 0.6 }, { 0.3, -0.35, -1 } };

struct stage {
	struct psr_scene scene;
	struct psr_instance instance;
	struct psr_light light;
};

static void set_stage(struct stage *stage, const struct study_model *of, const double toward[3])
{
	const double away = DISTANCE * of->scale;
	struct psr_camera *camera = &stage->scene.camera;
	double unit[3], forward[3], right[3];

	memset(stage, 0, sizeof *stage);
	v3d_normalize(unit, toward);
	v3d_scale(forward, unit, -1);
	v3d_normalize(camera->up, of->mesh->up);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	memcpy(camera->target, of->origin, sizeof camera->target);
	v3d_add_scaled(camera->eye, camera->target, away, unit);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->fov_y = 2 * asin(MARGIN / DISTANCE);
	stage->instance = (struct psr_instance){ .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	stage->light.kind = PSR_LIGHT_DIRECTIONAL;
	v3d_add_scaled(stage->light.direction, forward, 0.6, right);
	v3d_add_scaled(stage->light.direction, stage->light.direction, -0.5, camera->up);
	v3d_set(stage->light.color, 1, 1, 1);
	v3d_set(stage->scene.ambient, 0.12, 0.12, 0.12);
	stage->scene.instance = &stage->instance;
	stage->scene.light = &stage->light;
	stage->scene.n_instances = stage->scene.n_lights = 1;
}

/* What is compared, and what comes of it. */
struct comparison {
	struct study *study;
	const struct octree_way *way;
	int n;
	struct octree_rate rate[OCTREE_MOST_WAYS]; /* sums of the views */
	struct sums {                     /* of the views of a model */
		double square, square_inside; /* over pixels that are covered; inside: for decibels */
		double n, n_inside, n_wrong;  /* of these; wrong: holes and leaks */
	} sums[OCTREE_MOST_WAYS];
};

static int draw_way(const struct comparison *c, int i, struct stage *stage, struct psr_frame *frame)
{
	struct render_settings settings;

	render_settings_default(&settings, OCTREE_SIDE, OCTREE_SIDE);
	settings.with_ewa = c->way[i].with_splats;
	if (c->way[i].is_whole)
		settings.spacing_px = PSR_LEAST_SPACING;
	stage->instance.model = c->way[i].model;
	return renderer_draw(c->study->renderer, &stage->scene, &settings, c->study->pool, frame, c->study->err);
}

/* Draws the view in each way in turn, and adds the least seconds of each, and what it draws. */
static int time_view(struct comparison *c, struct stage *stage, struct psr_frame *frame)
{
	struct octree_rate least[OCTREE_MOST_WAYS];

	for (int trial = 0; trial <= TRIALS; trial++)
		for (int i = 0; i < c->n; i++) {
			const uint64_t start = clock_ns();
			const int rc = draw_way(c, i, stage, frame);
			const double seconds = (double)(clock_ns() - start) * 1e-9;
			const struct psr_report *report = &frame->report;
			const double warp_seconds = (double)(report->ns[PSR_STAGE_CULL] + report->ns[PSR_STAGE_WARP]) * 1e-9;

			if (rc != PSR_OK)
				return rc;
			if (trial <= 1) /* the first one warms */
				least[i] = (struct octree_rate){ seconds, warp_seconds, (double)report->n_samples_drawn,
					                             (double)report->count[PSR_STAGE_WARP] };
			least[i].seconds = fmin(least[i].seconds, seconds);
			least[i].warp_seconds = fmin(least[i].warp_seconds, warp_seconds);
		}
	for (int i = 0; i < c->n; i++) {
		c->rate[i].seconds += least[i].seconds;
		c->rate[i].warp_seconds += least[i].warp_seconds;
		c->rate[i].drawn += least[i].drawn;
		c->rate[i].warped += least[i].warped;
	}
	return PSR_OK;
}

static int add_errors(struct sums *sums, struct study *study, const struct psr_model *model,
                      const struct psr_frame *drawn, const struct psr_source_planes *truth)
{
	struct psr_errors errors;
	const int rc = psr_errors_measure(&errors, drawn, truth, psr_model_info(model)->spacing, study->err);

	if (rc != PSR_OK)
		return rc;
	sums->square += pow(10, -errors.psnr / 10) * (double)errors.n_covered;
	sums->square_inside += pow(10, -errors.psnr_inside / 10) * (double)errors.n_inside;
	sums->n += (double)errors.n_covered;
	sums->n_inside += (double)errors.n_inside;
	sums->n_wrong += (double)(errors.n_holes + errors.n_leaks);
	return PSR_OK;
}

static struct octree_drawn drawn_of(const struct sums *sums, double seconds)
{
	return (struct octree_drawn){ .fps = OCTREE_VIEWS / seconds, .db = -10 * log10(sums->square / sums->n),
		                          .wrong = 1e6 * sums->n_wrong / sums->n_inside,
		                          .inside_db = -10 * log10(sums->square_inside / sums->n_inside) };
}

static int judge_view(struct comparison *c, struct stage *stage, const struct psr_frame *frame,
                      const struct psr_source_planes *truth)
{
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < c->n; i++) {
		struct psr_frame drawn = *frame;

		rc = draw_way(c, i, stage, &drawn);
		if (rc == PSR_OK)
			rc = add_errors(&c->sums[i], c->study, c->way[i].model, &drawn, truth);
	}
	return rc;
}

int octree_compare(struct octree_drawn *drawn, struct study *study, const struct study_model *of,
                   const struct octree_way *way, int n, const struct octree_truth *truth)
{
	struct psr_frame quiet = { .width = OCTREE_SIDE, .height = OCTREE_SIDE, .rgb = truth->frame.rgb };
	struct comparison c = { .study = study, .way = way, .n = n };

	for (int v = 0; v < OCTREE_VIEWS; v++) {
		struct stage stage;
		int rc;

		set_stage(&stage, of, directions[v]);
		rc = time_view(&c, &stage, &quiet);
		if (rc == PSR_OK)
			rc = judge_view(&c, &stage, &truth->frame, &truth->view[v]);
		if (rc != PSR_OK)
			return rc;
	}
	for (int i = 0; i < n; i++)
		drawn[i] = drawn_of(&c.sums[i], c.rate[i].seconds);
	return PSR_OK;
}

int octree_rates(struct octree_rate *rate, struct study *study, const struct study_model *of,
                 const struct octree_way *way, int n)
{
	struct psr_frame frame;
	struct comparison c = { .study = study, .way = way, .n = n };
	int rc = psr_frame_alloc(&frame, OCTREE_SIDE, OCTREE_SIDE, 1u << PSR_PLANE_COLOR, study->err);

	for (int v = 0; rc == PSR_OK && v < OCTREE_VIEWS; v++) {
		struct stage stage;

		set_stage(&stage, of, directions[v]);
		rc = time_view(&c, &stage, &frame);
	}
	psr_frame_free(&frame);
	memcpy(rate, c.rate, (size_t)n * sizeof *rate);
	return rc;
}

int octree_score(struct octree_drawn *drawn, struct study *study, const struct study_model *of,
                 const struct psr_model *model, const struct psr_settings *settings, const struct octree_truth *truth)
{
	struct sums sums = { .n = 0 };
	uint64_t ns = 0;

	for (int v = 0; v < OCTREE_VIEWS; v++) {
		struct psr_frame frame = truth->frame;
		struct stage stage;
		int rc;

		set_stage(&stage, of, directions[v]);
		stage.instance.model = model;
		rc = psr_render(study->renderer, &stage.scene, settings, study->pool, &frame, study->err);
		if (rc == PSR_OK) /* the first one warms */
			rc = psr_render(study->renderer, &stage.scene, settings, study->pool, &frame, study->err);
		if (rc == PSR_OK)
			rc = add_errors(&sums, study, model, &frame, &truth->view[v]);
		if (rc != PSR_OK)
			return rc;
		for (int s = 0; s < PSR_N_STAGES; s++)
			ns += frame.report.ns[s];
	}
	*drawn = drawn_of(&sums, (double)ns * 1e-9);
	return PSR_OK;
}

double octree_pixels(const struct study_model *of)
{
	return OCTREE_SIDE / (2 * DISTANCE * of->scale * tan(asin(MARGIN / DISTANCE)));
}

void octree_truth_fini(struct octree_truth *truth)
{
	for (int v = 0; v < OCTREE_VIEWS; v++) {
		free(truth->view[v].rgb);
		free(truth->view[v].coverage);
		free(truth->view[v].depth);
		free(truth->view[v].range);
	}
	psr_frame_free(&truth->frame);
}

int octree_truth_init(struct octree_truth *truth, struct study *study, const struct study_model *of)
{
	const size_t n = (size_t)OCTREE_SIDE * OCTREE_SIDE;
	struct psr_source *source = NULL;
	int rc = psr_source_create(&source, of->mesh, study->err);

	memset(truth, 0, sizeof *truth);
	if (rc == PSR_OK)
		rc = psr_frame_alloc(&truth->frame, OCTREE_SIDE, OCTREE_SIDE, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH,
		                     study->err);
	for (int v = 0; rc == PSR_OK && v < OCTREE_VIEWS; v++) {
		struct psr_source_planes *view = &truth->view[v];
		struct stage stage;
		const struct psr_source_shot shot = { source, &stage.scene, OCTREE_SIDE, OCTREE_SIDE, RAYS, study->n_threads };

		*view = (struct psr_source_planes){ .rgb = malloc(n * sizeof *view->rgb),
			                                .coverage = malloc(n * sizeof *view->coverage),
			                                .depth = malloc(n * sizeof *view->depth),
			                                .range = malloc(n * sizeof *view->range) };
		set_stage(&stage, of, directions[v]);
		if (view->rgb == NULL || view->coverage == NULL || view->depth == NULL || view->range == NULL)
			rc = psr_fail(study->err, PSR_ERR_MEMORY, "no memory for pictures");
		else
			rc = psr_source_draw(&shot, view, study->err);
	}
	psr_source_destroy(source);
	return rc;
}

int octree_model(struct psr_model **out, struct study *study, const struct octree *tree)
{
	struct psr_model_info info;
	struct octree inner;

	psr_octree_info(&info, tree);
	psr_octree_to_inner(&inner, tree, &info);
	return psr_model_create_octree(out, &info, &inner, NULL, study->err);
}

int octree_points(struct psr_model **out, struct octree **tree, struct study *study, const struct study_model *of,
                  int levels)
{
	struct octree_build_options options;
	int rc;

	octree_build_options_default(&options);
	options.levels = levels;
	rc = of->is_scanned ? octree_scanned(tree, study, of, levels)
	                    : octree_of_mesh(tree, NULL, of->mesh, &options, study->err);
	return rc == PSR_OK ? octree_model(out, study, *tree) : rc;
}
