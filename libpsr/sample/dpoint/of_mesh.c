#include "building.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/vec.h"
#include "dpoint/bound.h"
#include "surface/validate.h"

#define OVERHANG 5e-4f
#define SLACK 2e-5f       /* half a step of a place */
#define SLIT 0.5          /* pixels: of faces whose corners are further apart along a normal, some are seen through */
#define SPARSE 4          /* of candidates that come in two turns */

void dpoint_build_options_default(struct dpoint_build_options *options, uint32_t resolution)
{
	*options = (struct dpoint_build_options){ .resolution = resolution, .epsilon = 0.01, .delta = 0.125, .degrees = 2,
		                                      .height = 1.0 / resolution, .piece = 0.01 };
}

void building_say(const struct building *b, const char *stage)
{
	if (b->options->on_progress != NULL)
		b->options->on_progress(stage, 0, 1, b->options->userdata);
}

static int check_options(const struct dpoint_build_options *o, struct psr_error *err)
{
	if (o->resolution == 0 || !(o->epsilon >= 1e-6 && o->epsilon <= 0.5) || !(o->delta >= 0x1p-15 && o->delta <= 1)
	    || !(o->degrees >= 0.1 && o->degrees <= 90) || !(o->height > 0) || !(o->piece > 0))
		return psr_fail(err, PSR_ERR_ARG, "options of differential points are out of range: epsilon %g, delta %g, %g degrees",
		                o->epsilon, o->delta, o->degrees);
	if (!(o->error >= 0 && o->error <= o->resolution))
		return psr_fail(err, PSR_ERR_ARG, "an error of %g pixels is not within 0 to the resolution, %u", o->error,
		                o->resolution);
	/* As much again is left for what packing does not move. */
	if (o->error > 0 && !(o->error >= BOUND_PACKING * o->resolution))
		return psr_fail(err, PSR_ERR_ARG, "an error of %g pixels at a resolution of %u is below what the file's points hold; ask"
		                " for %.2g or more, or a lower resolution", o->error, o->resolution,
		                1.01 * BOUND_PACKING * o->resolution);
	return PSR_OK;
}

static double pixel_of(const struct dpoint_build_options *o)
{
	return 2.0 / o->resolution;
}

/* A side of a rectangle at `sine` of a radius R of curvature is s R long, and lambda is off by 2^(1/12) - 1 = 5.9 %, so
 * that the quadric ends 0.059 s^2 R / 2 off there, and in a corner twice as much: by the error where R is a quarter of
 * the model's. Where it is more, rectangles are shortened one by one; where less, they could be longer. */
static float sine_of(const struct dpoint_build_options *o, double error)
{
	return fminf(dpoint_sine(o->epsilon), (float)sqrt(error / (0.059 * 0.25)));
}

/* A normal is packed within 0.23 degrees, so a flat rectangle of 250 errors ends one error off. */
static float delta_of(const struct dpoint_build_options *o)
{
	const double most = o->error > 0 ? fmin(o->delta, 250 * o->error * pixel_of(o)) : o->delta;

	return dpoint_delta_of_class(dpoint_delta_class((float)most));
}

struct dpoint_cover_options building_cover(const struct dpoint_build_options *o)
{
	struct dpoint_cover_options cover = {
		.sine = dpoint_sine(o->epsilon), .slack = SLACK, .angle = (float)(o->degrees * PSR_DEGREE),
		.height = (float)o->height, .overhang = OVERHANG, .looks = BUILDING_LOOKS, .delta = delta_of(o),
		.graze = 0.5f * dpoint_graze(o->resolution), .slit = (float)(SLIT * pixel_of(o)),
	};

	if (o->error > 0) {
		cover.error = (float)(o->error * pixel_of(o) - BOUND_PACKING);
		cover.height = fminf(cover.height, cover.error);
		cover.overhang = fminf(OVERHANG, 0.5f * cover.error);
		cover.sine = sine_of(o, (double)cover.error);
	}
	return cover;
}

static int choose(struct building *b, struct dpoint_set *set, struct dpoint_build_report *report)
{
	int rc;

	building_say(b, "sample");
	rc = b->mesh->n_triangles > 0 ? building_put_mesh(b) : building_put_cloud(b);
	if (rc != PSR_OK)
		return rc;
	building_say(b, "choose");
	rc = dpoint_finish(set, report, &b->surface, b->two_sided, b->options);
	report->n_flat = b->n_flat;
	if (rc == PSR_ERR_CANCELLED)
		return psr_fail(b->err, rc, "cancelled");
	return rc == PSR_OK ? rc : psr_fail(b->err, rc, "no memory for the points of %zu pieces", b->surface.n_cells);
}

int dpoint_finish(struct dpoint_set *set, struct dpoint_build_report *report, struct dpoint_surface *surface,
                  const uint8_t *two_sided, const struct dpoint_build_options *options)
{
	struct dpoint_cover_options cover_options = building_cover(options);
	struct dpoint_cover cover = { 0 };
	struct dpoint_choice choice = { 0 };
	struct dpoint_errors errors;
	struct dpoint_bounds bounds;
	int rc;

	cover_options.margin = surface->margin;
	cover_options.is_two_sided = two_sided;
	rc = dpoint_simplify(&choice, &cover, surface, &cover_options, SPARSE, options->pool, options->cancel);

	if (rc == PSR_OK)
		rc = dpoint_set_make(set, &(struct dpoint_grouping){ surface, &choice, cover_options.sine, two_sided });
	if (rc == PSR_OK)
		rc = dpoint_bounds_measure(&bounds, surface, &choice, &cover_options, options->pool);
	if (rc == PSR_OK)
		rc = dpoint_measure(&errors, surface, &cover, &choice, options->pool);
	if (rc == PSR_OK) {
		set->height = (float)fmin(bounds.worst + BOUND_PACKING, 2);
		*report = (struct dpoint_build_report){ .n_candidates = surface->n_candidates, .n_kept = choice.n_kept,
			                                    .n_open = choice.n_holes, .n_bad = surface->n_bad,
			                                    .normal_rms = errors.normal_rms, .normal_worst = errors.normal_worst,
			                                    .height_worst = errors.height_worst, .n_over = bounds.n_over,
			                                    .off_worst = (double)set->height / pixel_of(options) };
	}
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	return rc;
}

static void widen(struct psr_model_info *info, const double at[3])
{
	for (int k = 0; k < 3; k++) {
		info->box_min[k] = fmin(info->box_min[k], at[k]);
		info->box_max[k] = fmax(info->box_max[k], at[k]);
	}
}

static int describe(struct building *b)
{
	struct psr_model_info *info = b->info;
	int rc = validate_mesh(b->mesh, b->err);

	if (rc == PSR_OK)
		rc = validate_bound_mesh(b->mesh, info->origin, &info->scale, b->err);
	info->resolution = b->options->resolution;
	info->spacing = 2 * info->scale / info->resolution;
	for (int k = 0; k < 3; k++) {
		info->box_min[k] = INFINITY;
		info->box_max[k] = -INFINITY;
	}
	for (uint32_t t = 0; t < b->mesh->n_triangles && rc == PSR_OK; t++)
		for (int i = 0; i < 3; i++)
			widen(info, b->mesh->position[b->mesh->triangle[t][i]]);
	for (uint32_t i = 0; b->mesh->n_triangles == 0 && i < b->mesh->n_points && rc == PSR_OK; i++)
		widen(info, b->mesh->point[i]);
	return rc;
}

int dpoint_of_mesh(struct dpoint_set *set, struct psr_model_info *info, struct dpoint_build_report *report,
                   const struct psr_mesh *mesh, const struct dpoint_build_options *options, struct psr_error *err)
{
	struct building b = { .mesh = mesh, .options = options, .err = err, .info = info };
	const double begin = clock_seconds();
	int rc = check_options(options, err);

	memset(set, 0, sizeof *set);
	if (rc == PSR_OK)
		rc = describe(&b);
	if (rc != PSR_OK)
		return rc;
	dpoint_surface_init(&b.surface);
	b.two_sided = calloc(mesh->n_materials, 1);
	b.grain = calloc(mesh->n_materials, sizeof *b.grain);
	rc = surface_init(&b.look, mesh, info->scale);
	if (rc == PSR_OK && (b.two_sided == NULL || b.grain == NULL))
		rc = PSR_ERR_MEMORY;
	rc = rc == PSR_OK ? choose(&b, set, report)
	                  : psr_fail(err, rc, "no memory for a surface of %u triangles", mesh->n_triangles);
	if (rc == PSR_OK)
		report->seconds = clock_seconds() - begin;
	surface_fini(&b.look);
	dpoint_surface_fini(&b.surface);
	free(b.two_sided);
	free(b.grain);
	return rc;
}
