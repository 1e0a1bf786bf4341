#include <assert.h>
#include <math.h>
#include "base/vec.h"
#include "tree.h"
#include "triangle.h"

/* Embree can query points against a user's geometry, given its boxes, but not against discs. */
static void bound_disc(const struct RTCBoundsFunctionArguments *args)
{
	const struct ray_scene *scene = args->geometryUserPtr;
	double center[3], normal[3], radius = ray_disc(scene, scene->mesh->n_triangles + args->primID, center, normal);
	float low[3], high[3];

	for (int k = 0; k < 3; k++) {
		double reach = radius * sqrt(fmax(0, 1 - normal[k] * normal[k])) + 0x1p-20;

		low[k] = (float)(center[k] - reach);
		high[k] = (float)(center[k] + reach);
	}
	*args->bounds_o = (struct RTCBounds){ .lower_x = low[0], .lower_y = low[1], .lower_z = low[2], .upper_x = high[0],
		                                  .upper_y = high[1], .upper_z = high[2] };
}

int ray_scene_index_distances(struct ray_scene *scene, struct psr_error *err)
{
	RTCGeometry geometry;

	if (scene->mesh->n_points == 0 || scene->discs != NULL)
		return PSR_OK;
	geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_USER);
	scene->discs = rtcNewScene(scene->device);
	rtcSetGeometryUserPrimitiveCount(geometry, scene->mesh->n_points);
	rtcSetGeometryUserData(geometry, scene);
	rtcSetGeometryBoundsFunction(geometry, bound_disc, NULL);
	rtcCommitGeometry(geometry);
	rtcAttachGeometryByID(scene->discs, geometry, RAY_DISCS);
	rtcReleaseGeometry(geometry);
	rtcCommitScene(scene->discs);
	if (rtcGetDeviceError(scene->device) != RTC_ERROR_NONE)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to find distances to %u points", scene->mesh->n_points);
	return PSR_OK;
}

struct nearest {
	const struct ray_scene *scene;
	const double *point;
	double distance2;
};

static double disc_distance2(const struct ray_scene *scene, uint32_t prim, const double p[3])
{
	double center[3], normal[3], d[3], height, beyond, radius = ray_disc(scene, prim, center, normal);

	v3d_sub(d, p, center);
	height = v3d_dot(d, normal) / v3d_dot(normal, normal);
	v3d_add_scaled(d, d, -height, normal);
	beyond = v3d_length(d) - radius;
	beyond = beyond > 0 ? beyond : 0;
	return height * height * v3d_dot(normal, normal) + beyond * beyond;
}

/* The tree proposes primitives; their distances are computed in double. */
static bool visit_nearest(struct RTCPointQueryFunctionArguments *args)
{
	struct nearest *nearest = args->userPtr;
	uint32_t prim = ray_prim(nearest->scene, args->geomID, args->primID);
	double corner[3][3], distance2;

	if (ray_is_disc(nearest->scene, prim)) {
		distance2 = disc_distance2(nearest->scene, prim, nearest->point);
	} else {
		ray_scene_corners(nearest->scene, prim, corner);
		distance2 = triangle_distance2((const double(*)[3])corner, nearest->point);
	}
	if (!(distance2 < nearest->distance2))
		return false;
	nearest->distance2 = distance2;
	/* A little more, so that rounding loses no primitive that is as near. */
	args->query->radius = (float)(sqrt(distance2) * (1 + 0x1p-20) + 0x1p-20);
	return true;
}

double ray_scene_distance(const struct ray_scene *scene, const double point[3], double most)
{
	struct nearest nearest = { scene, point, most * most };
	struct RTCPointQuery query = { .x = (float)point[0], .y = (float)point[1], .z = (float)point[2], .time = 0,
		                           .radius = (float)most + 0x1p-20f };
	struct RTCPointQueryContext context;

	assert(scene->mesh->n_points == 0 || scene->discs != NULL);
	rtcInitPointQueryContext(&context);
	rtcPointQuery(scene->scene, &query, &context, visit_nearest, &nearest);
	if (scene->discs != NULL)
		rtcPointQuery(scene->discs, &query, &context, visit_nearest, &nearest);
	return nearest.distance2 < most * most ? sqrt(nearest.distance2) : INFINITY;
}
