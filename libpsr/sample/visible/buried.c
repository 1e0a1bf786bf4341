#include "base/direction.h"
#include "base/vec.h"
#include "buried.h"
#include "places.h"

/* What lies no further behind a surface the renderer takes for a part of it (decision 0149). */
#define COVER 0.75
#define SKIN 0.01 /* pixels: the surface itself is no cover */
#define RAYS 64
#define WIDEST 0.95 /* the sine of the rays' greatest angle */

static int is_covered(const struct ray_scene *scene, double ds, const float p[3], const float n[3])
{
	struct ray ray;
	uint8_t is_hidden;

	for (int k = 0; k < 3; k++) {
		ray.origin[k] = (double)p[k] + COVER * ds * (double)n[k];
		ray.direction[k] = -(double)n[k];
	}
	ray_scene_occluded(scene, &ray, 1, (COVER - SKIN) * ds, &is_hidden);
	return is_hidden;
}

int is_buried(const struct ray_scene *scene, double ds, const float p[3], const float n[3])
{
	const struct place place = { { p[0], p[1], p[2] }, { n[0], n[1], n[2] }, 0 };
	struct ray ray[RAYS];
	uint8_t is_hidden[RAYS];

	if (!is_covered(scene, ds, p, n))
		return 0;
	for (int i = 0; i < RAYS; i++) {
		const float *direction = psr_direction_table()[PSR_DIRECTIONS / RAYS * i + PSR_DIRECTIONS / RAYS / 2];
		double view[3];

		for (int k = 0; k < 3; k++)
			view[k] = WIDEST * (double)direction[k] + (double)n[k];
		v3d_normalize(view, view);
		place_ray(&place, view, &ray[i]);
	}
	ray_scene_occluded(scene, ray, RAYS, PLACE_AWAY - SKIN * ds, is_hidden);
	for (int i = 0; i < RAYS; i++)
		if (!is_hidden[i])
			return 0;
	return 1;
}
