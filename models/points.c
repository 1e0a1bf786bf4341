#include "points.h"

#include <stdio.h>
#include <string.h>
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
