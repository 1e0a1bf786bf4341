/* Cameras around an object, for benches that draw it from several sides. */
#ifndef TESTS_BENCH_AROUND_H
#define TESTS_BENCH_AROUND_H

#include "base/vec.h"
#include "psr/model.h"
#include "psr/scene.h"

/* Looks from one of the directions around the object, `distance` times as far away as it fits the picture; aspect: the
 * picture's width over its height. */
static inline void around_camera(struct psr_camera *camera, const struct psr_model_info *info, int direction,
                                 double distance, double aspect)
{
	double away[3];

	psr_camera_frame(camera, info->box_min, info->box_max, info->up, 0.7, aspect);
	v3d_sub(away, camera->eye, camera->target);
	for (int i = 0; i < direction; i++) { /* a quarter around the way up, if that is y */
		const double x = away[0];

		away[0] = away[2];
		away[2] = -x;
	}
	v3d_add_scaled(camera->eye, camera->target, distance, away);
}

#endif
