#include "points.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "base/cli.h"
#include "base/maths.h"
#include "base/vec.h"
#include "model/tree.h"

int points_make(struct psr_model **out, struct dpoint_build_report *report, const struct psr_mesh *mesh,
                const struct points_wish *wish, struct psr_error *err)
{
	const struct psr_presets presets = { mesh->n_cameras, mesh->n_lights, mesh->camera, mesh->light };
	struct dpoint_build_options options;
	struct psr_model_info info = { 0 };
	struct dpoint_set set = { 0 };
	struct psr_pool *pool = NULL;
	int rc = psr_pool_create(&pool, wish->n_threads, err);

	dpoint_build_options_default(&options, wish->resolution);
	options.epsilon = wish->eps > 0 ? wish->eps : options.epsilon;
	options.delta = wish->delta > 0 ? wish->delta : options.delta;
	options.error = wish->error;
	options.pool = pool;
	options.on_progress = wish->on_progress;
	options.userdata = wish->userdata;
	v3d_normalize(info.up, v3d_length(wish->up) > 0 ? wish->up : mesh->up);
	snprintf(info.builder, sizeof info.builder, "psr %s", PSR_VERSION);
	if (rc == PSR_OK)
		rc = dpoint_of_mesh(&set, &info, report, mesh, &options, err);
	if (rc == PSR_OK)
		rc = psr_model_create_of(out, &info, &(struct psr_model_parts){ .points = &set }, &presets, err);
	dpoint_set_fini(&set);
	psr_pool_destroy(pool);
	return rc;
}

int points_take_error(const char *text, void *userdata, struct psr_error *err)
{
	struct points_wish *wish = userdata;
	const char *end;

	if (psr_parse_real(text, &wish->error, &end, NULL) != PSR_OK || *end != '\0' || !(wish->error > 0))
		return psr_fail(err, PSR_ERR_ARG, "'%.40s' is not a number of pixels above 0, such as 0.5; without --error there is no"
		                " bound", text);
	return PSR_OK;
}

int points_check(const struct points_wish *wish, int is_points, struct psr_error *err)
{
	if (!is_points && (wish->eps > 0 || wish->delta > 0 || wish->error > 0))
		return psr_fail(err, PSR_ERR_ARG,
		                "--eps, --delta and --error are for differential points; add --representation dpoints");
	if (wish->error > 0 && (wish->eps > 0 || wish->delta > 0))
		return psr_fail(err, PSR_ERR_ARG, "--error chooses what --eps and --delta say; leave out --error, or both of them");
	return PSR_OK;
}

void points_summarize(const struct dpoint_build_report *report, const char *out, uint64_t file_bytes,
                      const struct psr_mesh *mesh)
{
	const uint32_t n = mesh->n_patches > 0 ? mesh->n_patches : mesh->n_triangles > 0 ? mesh->n_triangles : mesh->n_points;

	printf("%s: %" PRIu64 " differential points of %" PRIu64 ", %.2f MB, from %" PRIu32 " %s in %.1f s; normals"
	       " within %.1f degrees, all within %.3g pixels of the surface\n", out, report->n_kept, report->n_candidates,
	       (double)file_bytes / 1e6, n,
	       mesh->n_patches > 0 ? "NURBS patches" : mesh->n_triangles > 0 ? "triangles" : "points of a cloud", report->seconds,
	       report->normal_worst / PSR_DEGREE, report->off_worst);
}

void points_warn(const struct dpoint_build_report *report, double error)
{
	if (report->n_flat > 0)
		fprintf(stderr, "psr-model build: warning: %" PRIu64 " points of the cloud have too few neighbours for a curvature, or"
		        " neighbours along a line; they are flat\n", report->n_flat);
	if (report->n_over > 0)
		fprintf(stderr, "psr-model build: warning: %" PRIu64 " of %" PRIu64 " points are further from the surface than --error"
		        " %g, up to %.3g pixels: the surface is finer there than the points' places; a greater error holds, and so may"
		        " a lower resolution\n", report->n_over, report->n_kept, error, report->off_worst);
}
