#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "base/view.h"
#include "placed.h"

#define RUN 64
#define OFF 1e-5 /* inner units from a surface to the beginning of a ray to a light: floats of the tree are coarser */

static void turn_by(double m[3][3], const double q[4])
{
	static const double unit[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };

	/* Column k is v + 2 q x (q x v + w v) of axis k. */
	for (int k = 0; k < 3; k++) {
		double a[3], b[3];

		v3d_cross(a, q, unit[k]);
		v3d_add_scaled(a, a, q[3], unit[k]);
		v3d_cross(b, q, a);
		for (int i = 0; i < 3; i++)
			m[i][k] = unit[k][i] + 2 * b[i];
	}
}

static int place(struct placed_instance *to, const struct psr_source *source, const struct psr_instance *from,
                 unsigned i, struct psr_error *err)
{
	const double *q = from->rotation, norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
	double unit[4];

	if (!(fabs(norm - 1) <= 1e-6) || !view_is_point(from->translation) ||
	    !(from->scale >= 1e-30 && from->scale <= 1e30))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: rotation, translation or scale is out of range", i);
	for (int k = 0; k < 4; k++)
		unit[k] = q[k] / norm;
	turn_by(to->turn, unit);
	m3d_apply(to->center, (const double(*)[3])to->turn, source->origin);
	for (int k = 0; k < 3; k++)
		to->center[k] = from->translation[k] + from->scale * to->center[k];
	to->unit = from->scale * source->scale;
	return PSR_OK;
}

int placed_init(struct placed *placed, const struct psr_source *source, const struct psr_scene *scene,
                struct psr_error *err)
{
	const struct psr_instance origin = { .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	int rc = PSR_OK;

	*placed = (struct placed){ .source = source, .n = scene->n_instances > 0 ? scene->n_instances : 1 };
	if (scene->n_instances > PSR_MAX_INSTANCES)
		return psr_fail(err, PSR_ERR_LIMIT, "%u instances exceed the limit of %d", scene->n_instances,
		                PSR_MAX_INSTANCES);
	placed->instance = psr_alloc_array(placed->n, sizeof *placed->instance);
	if (placed->instance == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", placed->n);
	for (uint32_t i = 0; i < placed->n && rc == PSR_OK; i++)
		rc = place(&placed->instance[i], source, scene->n_instances > 0 ? &scene->instance[i] : &origin, i, err);
	return rc;
}

void placed_fini(struct placed *placed)
{
	psr_free(placed->instance);
}

void placed_ray(const struct placed_instance *instance, const struct ray *world, struct ray *inner)
{
	double from[3];

	v3d_sub(from, world->origin, instance->center);
	m3d_apply_transposed(inner->origin, (const double(*)[3])instance->turn, from);
	v3d_scale(inner->origin, inner->origin, 1 / instance->unit);
	m3d_apply_transposed(inner->direction, (const double(*)[3])instance->turn, world->direction);
}

void placed_trace(const struct placed *placed, const struct ray *ray, int n, double near_z, struct placed_hit *hit)
{
	struct ray inner[RUN];
	struct ray_hit found[RUN];

	for (int i = 0; i < n; i++)
		hit[i] = (struct placed_hit){ .z = INFINITY };
	for (uint32_t k = 0; k < placed->n; k++) {
		const struct placed_instance *instance = &placed->instance[k];

		for (int first = 0; first < n; first += RUN) {
			const int part = n - first < RUN ? n - first : RUN;

			for (int i = 0; i < part; i++)
				placed_ray(instance, &ray[first + i], &inner[i]);
			ray_scene_trace(placed->source->scene, inner, part, near_z / instance->unit, found);
			for (int i = 0; i < part; i++)
				if (found[i].prim != RAY_NONE && found[i].t * instance->unit < hit[first + i].z)
					hit[first + i] = (struct placed_hit){ found[i].t * instance->unit, instance, found[i] };
		}
	}
}

static int by_z(const void *a, const void *b)
{
	const double l = ((const struct placed_hit *)a)->z, r = ((const struct placed_hit *)b)->z;

	return (l > r) - (l < r);
}

int placed_trace_all(const struct placed *placed, const struct ray *ray, double near_z, struct placed_hit *hit)
{
	struct placed_hit all[2 * PLACED_MOST];
	struct ray_hit found[RAY_MOST_HITS];
	int n = 0;

	for (uint32_t k = 0; k < placed->n; k++) {
		const struct placed_instance *instance = &placed->instance[k];
		struct ray inner;
		int n_found;

		placed_ray(instance, ray, &inner);
		ray_scene_trace_all(placed->source->scene, &inner, 1, RAY_MOST_HITS, found, &n_found);
		for (int i = 0; i < n_found; i++)
			if (found[i].t * instance->unit >= near_z)
				all[n++] = (struct placed_hit){ found[i].t * instance->unit, instance, found[i] };
		if (placed->n > 1)
			qsort(all, (size_t)n, sizeof *all, by_z);
		n = n < PLACED_MOST ? n : PLACED_MOST;
	}
	memcpy(hit, all, (size_t)n * sizeof *hit);
	return n;
}

/* Of a ray of inner coordinates, from t = 0 to `length`: opaque surfaces alone. */
static int is_stopped(const struct psr_source *source, const struct ray *ray, double length)
{
	struct ray back = *ray;
	struct ray_hit hit;

	ray_scene_trace_near(source->scene, ray, 1, 0, length, &hit);
	if (hit.prim != RAY_NONE)
		return 1;
	/* Rays pass faces from behind. */
	v3d_add_scaled(back.origin, ray->origin, length, ray->direction);
	v3d_scale(back.direction, ray->direction, -1);
	ray_scene_trace_near(source->scene, &back, 1, 0, length, &hit);
	return hit.prim != RAY_NONE;
}

static int is_two_sided(const struct psr_mesh *mesh, uint32_t prim)
{
	const uint32_t m = prim < mesh->n_triangles ? mesh->triangle_material[prim]
	                                            : mesh->point_material[prim - mesh->n_triangles];

	return mesh->material[m].two_sided;
}

/* Of the same ray: what surfaces of any opacity let through. */
static double remains(const struct psr_source *source, const struct ray *ray, double length)
{
	struct ray_hit hit[RAY_MOST_HITS];
	struct ray back = *ray;
	double share = 1;
	int n;

	ray_scene_trace_all(source->scene, ray, 1, RAY_MOST_HITS, hit, &n);
	for (int i = 0; i < n && hit[i].t <= length && share > 0; i++)
		share *= 1 - source_opacity(source, &hit[i]);
	v3d_add_scaled(back.origin, ray->origin, length, ray->direction);
	v3d_scale(back.direction, ray->direction, -1);
	if (share > 0)
		ray_scene_trace_all(source->scene, &back, 1, RAY_MOST_HITS, hit, &n);
	for (int i = 0; i < n && hit[i].t <= length && share > 0; i++)
		if (!is_two_sided(source->mesh, hit[i].prim))
			share *= 1 - source_opacity(source, &hit[i]);
	return share;
}

double placed_passes(const struct placed *placed, const struct placed_point *point, const double to_light[3],
                     double length)
{
	double share = 1;

	if (!(v3d_dot(point->face, to_light) > 0))
		return 0;
	for (uint32_t k = 0; k < placed->n && share > 0; k++) {
		const struct placed_instance *instance = &placed->instance[k];
		const struct ray world = { { point->at[0], point->at[1], point->at[2] },
			                       { to_light[0], to_light[1], to_light[2] } };
		double face[3], far;
		struct ray inner;

		placed_ray(instance, &world, &inner);
		m3d_apply_transposed(face, (const double(*)[3])instance->turn, point->face);
		v3d_add_scaled(inner.origin, inner.origin, OFF, face);
		v3d_add_scaled(inner.origin, inner.origin, OFF, inner.direction);
		/* Directional lights lie beyond everything. */
		far = fmin(length / instance->unit, v3d_length(inner.origin) + 2) - 2 * OFF;
		if (far <= 0)
			continue;
		if (placed->source->is_layered)
			share *= remains(placed->source, &inner, far);
		else if (is_stopped(placed->source, &inner, far))
			share = 0;
	}
	return share;
}
