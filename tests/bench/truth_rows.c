#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "base/vec.h"
#include "report.h"
#include "truth.h"

/* As the figures of docs/figures.md. */
#define DISTANCE 4 /* of the eye, in radii of the model */
#define AMBIENT 0.12
#define BACKGROUND 243 /* sRGB */
#define VIEWS 6

static const double view[VIEWS][3] = {
	{ 0.5, 0.4, 1 }, { -0.9, 0.7, 0.6 }, { 0.3, -0.35, -1 }, { 1, 0.1, -0.4 }, { -0.6, 1, -0.7 }, { -1, -0.2, 0.8 },
};

const struct truth_row truth_rows[] = {
	{ "defaults", "magnification 1, 256x256, as psr shot draws without options", 256, 256, 1, VIEWS, 4, 0, 0, { NULL },
	  NULL },
	{ "raw", "the same without smoothing", 256, 256, 1, VIEWS, 4, 0, 0, { "--no-smooth", NULL }, NULL },
	{ "double", "magnification 2, 512x512, no smoothing: the tables of figures gaps, fill and threshold", 256, 512, 2,
	  VIEWS, 4, 0, 0, { "--no-smooth", NULL }, "dragon toybird" },
	{ "smooth", "the same, as psr shot draws without options", 256, 512, 2, VIEWS, 4, 0, 0, { NULL }, "dragon toybird" },
	{ "shadows", "magnification 1, 256x256, the light casts shadows", 256, 256, 1, 3, 4, 1, 0, { NULL }, NULL },
	{ "lamps", "the same, lit by two lamps near it", 256, 256, 1, 3, 4, 1, 1, { NULL }, NULL },
	{ "close", "magnification 4 of a model of 1024, 256x256, with shadows", 1024, 256, 4, 2, 4, 1, 0, { NULL },
	  "teapot dragon gavel chair" },
	{ "texture", "magnification 1, 256x256, in pass 1", 256, 256, 1, VIEWS, 4, 0, 0, { "--passes=1", NULL }, "table" },
	{ "still", "pass 4, 256x256, models of 1024", 1024, 256, 0.25, 1, 16, 0, 0, { "--passes=4", NULL }, NULL },
};
const unsigned truth_n_rows = sizeof truth_rows / sizeof truth_rows[0];

struct stage {
	struct psr_scene scene;
	struct psr_light light[2];
};

static void light_over_shoulder(struct psr_light *light, const double forward[3], const double right[3],
                                const double down[3])
{
	light->kind = PSR_LIGHT_DIRECTIONAL;
	v3d_scale(light->direction, forward, 0.8);
	v3d_add_scaled(light->direction, light->direction, 0.5, right);
	v3d_add_scaled(light->direction, light->direction, 0.45, down);
}

static void lamp_at(struct psr_light *light, const struct truth_subject *subject, const double toward[3])
{
	light->kind = PSR_LIGHT_POINT;
	light->reference = 2 * subject->radius;
	v3d_add_scaled(light->position, subject->center, 1.6 * subject->radius, toward);
}

static void set_stage(struct stage *stage, const struct truth_row *row, const struct truth_subject *subject,
                      unsigned i)
{
	const double away = DISTANCE * subject->radius, spacing = 2 * subject->radius / row->resolution;
	struct psr_camera *camera = &stage->scene.camera;
	double unit[3], forward[3], right[3], down[3], toward[3];

	memset(stage, 0, sizeof *stage);
	v3d_normalize(unit, view[i]);
	v3d_scale(forward, unit, -1);
	v3d_normalize(camera->up, subject->mesh->up);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(down, forward, right);
	v3d_add_scaled(camera->eye, subject->center, away, unit);
	v3d_set(camera->target, subject->center[0], subject->center[1], subject->center[2]);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->fov_y = 2 * atan(row->side / 2.0 * spacing / (row->magnification * away));
	stage->scene.light = stage->light;
	stage->scene.n_lights = row->has_lamps ? 2 : 1;
	light_over_shoulder(&stage->light[0], forward, right, down);
	for (int k = 0; k < 3; k++)
		toward[k] = 0.7 * unit[k] - 0.6 * right[k] - 0.5 * down[k];
	if (row->has_lamps)
		lamp_at(&stage->light[0], subject, toward);
	for (int k = 0; k < 3; k++)
		toward[k] = 0.5 * unit[k] + 0.8 * right[k] - 0.3 * down[k];
	if (row->has_lamps)
		lamp_at(&stage->light[1], subject, toward);
	for (uint32_t l = 0; l < stage->scene.n_lights; l++) {
		v3d_set(stage->light[l].color, 1, 1, 1);
		stage->light[l].casts_shadow = row->has_shadows;
	}
	v3d_set(stage->scene.ambient, AMBIENT, AMBIENT, AMBIENT);
	const double behind = (double)psr_srgb_to_linear[BACKGROUND];
	v3d_set(stage->scene.background, behind, behind, behind);
}

/* ---- truths ---- */

static void free_planes(struct psr_source_planes *planes)
{
	free(planes->rgb);
	free(planes->coverage);
	free(planes->textured);
	free(planes->depth);
	free(planes->range);
}

static void draw_truth(struct psr_source_planes *planes, const struct truth_row *row,
                       const struct truth_subject *subject, const struct psr_scene *scene)
{
	const size_t n = (size_t)row->side * row->side;
	const struct psr_source_shot shot = { subject->source, scene, row->side, row->side, row->rays, 0 };
	struct psr_error err;

	*planes = (struct psr_source_planes){ .rgb = report_alloc(n, sizeof *planes->rgb),
		                                  .coverage = report_alloc(n, sizeof *planes->coverage),
		                                  .textured = report_alloc(n, sizeof *planes->textured),
		                                  .depth = report_alloc(n, sizeof *planes->depth),
		                                  .range = report_alloc(n, sizeof *planes->range) };
	if (psr_source_draw(&shot, planes, &err) != PSR_OK)
		report_die(subject->name, err.text);
}

/* ---- sums over views ---- */

/* Decibels become mean squares times pixels on the way in, and decibels again at the end. */
static double square_of(double db, uint64_t n)
{
	return isinf(db) ? 0 : pow(10, -db / 10) * (double)n;
}

static double db_of(double square, uint64_t n)
{
	return square > 0 ? -10 * log10(square / (double)n) : INFINITY;
}

static void add_view(struct psr_errors *sum, const struct psr_errors *e, unsigned n_views)
{
	sum->n_covered += e->n_covered;
	sum->n_inside += e->n_inside;
	sum->n_textured += e->n_textured;
	sum->n_holes += e->n_holes;
	sum->n_leaks += e->n_leaks;
	sum->n_outline += e->n_outline;
	sum->psnr += square_of(e->psnr, e->n_covered);
	sum->psnr_inside += square_of(e->psnr_inside, e->n_inside);
	sum->psnr_textured += square_of(e->psnr_textured, e->n_textured);
	sum->psnr_shading += square_of(e->psnr_shading, e->n_inside);
	sum->ssim += e->ssim / n_views;
	sum->flip += e->flip / n_views;
	sum->depth_rmse += e->depth_rmse / n_views;
	sum->depth_p999 += e->depth_p999 / n_views;
	sum->outline_mean += e->outline_mean / n_views;
	sum->outline_max = fmax(sum->outline_max, e->outline_max);
	sum->geometry += e->geometry / n_views;
}

static void end_views(struct psr_errors *sum)
{
	sum->psnr = db_of(sum->psnr, sum->n_covered);
	sum->psnr_inside = db_of(sum->psnr_inside, sum->n_inside);
	sum->psnr_textured = db_of(sum->psnr_textured, sum->n_textured);
	sum->psnr_shading = db_of(sum->psnr_shading, sum->n_inside);
}

static void keep_picture(const struct truth_build *build, const char *what, const struct truth_row *row,
                         const struct truth_subject *subject, const struct psr_frame *frame)
{
	char path[2 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s-%s-%s.png", build->folder, subject->name, row->name, what);
	if (psr_image_write(frame, path, NULL) != PSR_OK)
		report_die(path, "cannot be written");
}

void truth_row_run(const struct truth_row *row, const struct truth_subject *subject, struct truth_build *build,
                   unsigned n_builds, struct truth_result *result)
{
	const double spacing = 2 * subject->radius / row->resolution;

	for (unsigned b = 0; b < n_builds; b++)
		if (!result[b].is_known)
			memset(&result[b].errors, 0, sizeof result[b].errors);
	for (unsigned i = 0; i < row->n_views; i++) {
		struct psr_source_planes truth;
		struct stage stage;

		set_stage(&stage, row, subject, i);
		draw_truth(&truth, row, subject, &stage.scene);
		for (unsigned b = 0; b < n_builds; b++) {
			const struct truth_shot shot = { subject->name, row->resolution, &stage.scene, row->side, row->options };
			struct psr_errors errors;
			struct psr_frame frame;
			struct psr_error err;

			if (result[b].is_known)
				continue;
			truth_build_shot(&build[b], &shot, &frame);
			if (psr_errors_measure(&errors, &frame, &truth, spacing, &err) != PSR_OK)
				report_die(subject->name, err.text);
			add_view(&result[b].errors, &errors, row->n_views);
			if (i == 0) {
				keep_picture(&build[b], "drawn", row, subject, &frame);
				keep_picture(&build[b], "truth", row, subject,
				             &(struct psr_frame){ row->side, row->side, .rgb = (uint8_t *)truth.rgb });
			}
			free(frame.rgb);
			free(frame.depth);
		}
		free_planes(&truth);
	}
	for (unsigned b = 0; b < n_builds; b++)
		if (!result[b].is_known)
			end_views(&result[b].errors);
}
