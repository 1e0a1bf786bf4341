#include <assert.h>
#include <embree3/rtcore.h>
#include <math.h>
#include <stdlib.h>
#include "../base/mem.h"
#include "../base/vec.h"
#include "ray.h"
#include "triangle.h"
#include "texture.h"

#define PACKET 8

struct ray_scene {
	const struct psr_mesh *mesh;
	double origin[3], scale;
	float (*normal)[3];
	RTCDevice device;
	RTCScene scene;
};

/* What the filter needs of the packet under way, in double. The context comes first: Embree hands it back. */
struct packet {
	struct RTCIntersectContext context;
	const struct ray_scene *scene;
	const struct ray *ray;
};

void ray_scene_corners(const struct ray_scene *scene, uint32_t prim, double corner[3][3])
{
	const uint32_t *index = scene->mesh->triangle[prim];

	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			corner[i][k] = (scene->mesh->position[index[i]][k] - scene->origin[k]) / scene->scale;
}

void ray_scene_center(const struct ray_scene *scene, uint32_t prim, double center[3])
{
	for (int k = 0; k < 3; k++)
		center[k] = (scene->mesh->point[prim - scene->mesh->n_triangles][k] - scene->origin[k]) / scene->scale;
}

const float *ray_scene_normal(const struct ray_scene *scene, uint32_t prim)
{
	return scene->normal[prim];
}

/* Where the ray meets the primitive that the tree found: in its plane, drawn into the triangle, as the tree rounds its
 * edges outwards. An edge-on triangle has no such point; it keeps what the tree says. */
static void locate(const struct ray_scene *scene, const struct ray *ray, struct ray_hit *hit)
{
	double corner[3][3], e1[3], e2[3], s[3], p[3], q[3], point[3], det, sum;

	ray_scene_corners(scene, hit->prim, corner);
	v3d_sub(e1, corner[1], corner[0]);
	v3d_sub(e2, corner[2], corner[0]);
	v3d_sub(s, ray->origin, corner[0]);
	v3d_cross(p, ray->direction, e2);
	v3d_cross(q, s, e1);
	det = v3d_dot(e1, p);
	hit->is_back = det < 0;
	if (det != 0) {
		hit->u = v3d_dot(s, p) / det;
		hit->v = v3d_dot(ray->direction, q) / det;
	}
	hit->u = hit->u > 0 ? hit->u : 0;
	hit->v = hit->v > 0 ? hit->v : 0;
	sum = hit->u + hit->v;
	if (sum > 1) {
		hit->u /= sum;
		hit->v = 1 - hit->u;
	}
	for (int k = 0; k < 3; k++)
		point[k] = s[k] - (hit->u * e1[k] + hit->v * e2[k]);
	hit->t = -v3d_dot(point, ray->direction) / v3d_dot(ray->direction, ray->direction);
}

void ray_locate(const struct ray_scene *scene, const struct ray *ray, uint32_t prim, double *u, double *v)
{
	struct ray_hit hit = { .prim = prim, .u = 1.0 / 3, .v = 1.0 / 3 };

	locate(scene, ray, &hit);
	*u = hit.u;
	*v = hit.v;
}

static int lets_through(const struct ray_scene *scene, const struct ray *ray, struct ray_hit *hit)
{
	const struct psr_material *material = &scene->mesh->material[scene->mesh->triangle_material[hit->prim]];

	if (material->two_sided && material->alpha == PSR_ALPHA_OPAQUE)
		return 0;
	locate(scene, ray, hit);
	return (hit->is_back && !material->two_sided) || texture_is_absent(scene->mesh, hit->prim, hit->u, hit->v);
}

/* Rays and hits come as N-wide columns, for which Embree's header has names in C++ only. */
enum { RAY_ID_COLUMN = 10, HIT_U_COLUMN = 3, HIT_V_COLUMN = 4, HIT_PRIM_COLUMN = 5 };

static void filter(const struct RTCFilterFunctionNArguments *args)
{
	const struct packet *packet = (const struct packet *)(const void *)args->context;
	const unsigned *ray_id = (const unsigned *)(const void *)args->ray + RAY_ID_COLUMN * args->N;
	const float *u = (const float *)(const void *)args->hit + HIT_U_COLUMN * args->N;
	const float *v = (const float *)(const void *)args->hit + HIT_V_COLUMN * args->N;
	const unsigned *prim = (const unsigned *)(const void *)args->hit + HIT_PRIM_COLUMN * args->N;

	for (unsigned i = 0; i < args->N; i++) {
		struct ray_hit hit;

		if (args->valid[i] == 0)
			continue;
		hit.prim = prim[i];
		hit.u = (double)u[i];
		hit.v = (double)v[i];
		if (lets_through(packet->scene, &packet->ray[ray_id[i]], &hit))
			args->valid[i] = 0;
	}
}

static int needs_filter(const struct psr_mesh *mesh)
{
	for (uint32_t i = 0; i < mesh->n_materials; i++)
		if (!mesh->material[i].two_sided || mesh->material[i].alpha != PSR_ALPHA_OPAQUE)
			return 1;
	return 0;
}

/* The tree keeps its own arrays: floats, relative to the origin and scaled, so that far coordinates lose nothing. */
static int attach_mesh(struct ray_scene *scene)
{
	const struct psr_mesh *mesh = scene->mesh;
	RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
	float (*vertex)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
	                                             sizeof *vertex, mesh->n_vertices);
	uint32_t (*index)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
	                                               sizeof *index, mesh->n_triangles);

	if (vertex == NULL || index == NULL) {
		rtcReleaseGeometry(geometry);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int k = 0; k < 3; k++)
			vertex[i][k] = (float)((mesh->position[i][k] - scene->origin[k]) / scene->scale);
	for (uint32_t i = 0; i < mesh->n_triangles; i++)
		for (int k = 0; k < 3; k++)
			index[i][k] = mesh->triangle[i][k];
	if (needs_filter(mesh))
		rtcSetGeometryIntersectFilterFunction(geometry, filter);
	rtcCommitGeometry(geometry);
	rtcAttachGeometry(scene->scene, geometry);
	rtcReleaseGeometry(geometry);
	return PSR_OK;
}

static int make_normals(struct ray_scene *scene)
{
	scene->normal = psr_alloc_array(scene->mesh->n_triangles, sizeof *scene->normal);
	if (scene->normal == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < scene->mesh->n_triangles; i++) {
		double corner[3][3], e1[3], e2[3], n[3];

		ray_scene_corners(scene, i, corner);
		v3d_sub(e1, corner[1], corner[0]);
		v3d_sub(e2, corner[2], corner[0]);
		v3d_cross(n, e1, e2);
		if (v3d_normalize(n, n) == 0)
			v3d_set(n, 0, 0, 0);
		for (int k = 0; k < 3; k++)
			scene->normal[i][k] = (float)n[k];
	}
	return PSR_OK;
}

static int build_tree(struct ray_scene *scene)
{
	int rc;

	/* One thread, so that the tree does not depend on how many there are; one instruction set for the same reason. */
	scene->device = rtcNewDevice(__builtin_cpu_supports("avx2") ? "isa=avx2,threads=1,set_affinity=0"
	                                                            : "threads=1,set_affinity=0");
	if (scene->device == NULL)
		return PSR_ERR_INTERNAL;
	scene->scene = rtcNewScene(scene->device);
	if (scene->scene == NULL)
		return PSR_ERR_MEMORY;
	rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST);
	rc = attach_mesh(scene);
	if (rc != PSR_OK)
		return rc;
	rtcCommitScene(scene->scene);
	switch (rtcGetDeviceError(scene->device)) {
	case RTC_ERROR_NONE:
		return PSR_OK;
	case RTC_ERROR_OUT_OF_MEMORY:
		return PSR_ERR_MEMORY;
	default:
		return PSR_ERR_INTERNAL;
	}
}

int ray_scene_create(struct ray_scene **out, const struct psr_mesh *mesh, const double origin[3], double scale,
                     struct psr_error *err)
{
	struct ray_scene *scene = calloc(1, sizeof *scene);
	int rc;

	if (scene == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a mesh of %u triangles", mesh->n_triangles);
	scene->mesh = mesh;
	v3d_set(scene->origin, origin[0], origin[1], origin[2]);
	scene->scale = scale;
	rc = make_normals(scene);
	if (rc == PSR_OK)
		rc = build_tree(scene);
	if (rc != PSR_OK) {
		ray_scene_destroy(scene);
		return rc == PSR_ERR_MEMORY ? psr_fail(err, rc, "no memory for the ray tracer's tree of %u triangles",
		                                       mesh->n_triangles)
		                            : psr_fail(err, rc, "the ray tracer does not start: Embree error %d",
		                                       (int)rtcGetDeviceError(NULL));
	}
	*out = scene;
	return PSR_OK;
}

void ray_scene_destroy(struct ray_scene *scene)
{
	if (scene == NULL)
		return;
	if (scene->scene != NULL)
		rtcReleaseScene(scene->scene);
	if (scene->device != NULL)
		rtcReleaseDevice(scene->device);
	psr_free(scene->normal);
	free(scene);
}

/* A ray that starts far away would round to another ray: it starts just outside of the unit sphere instead. */
static double first_t(const struct ray *ray, double t_min)
{
	double squared = v3d_dot(ray->direction, ray->direction);
	double near_t = -v3d_dot(ray->origin, ray->direction) / squared - 2 / sqrt(squared);

	return near_t > t_min ? near_t : t_min;
}

static void trace_packet(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, struct ray_hit *hit)
{
	_Alignas(32) int valid[PACKET];
	struct RTCRayHit8 rays;
	struct packet packet = { .scene = scene, .ray = ray };

	rtcInitIntersectContext(&packet.context);
	packet.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
	for (int i = 0; i < PACKET; i++) {
		const struct ray *r = &ray[i < n ? i : 0];
		double start = first_t(r, t_min);

		valid[i] = i < n ? -1 : 0;
		rays.ray.org_x[i] = (float)(r->origin[0] + start * r->direction[0]);
		rays.ray.org_y[i] = (float)(r->origin[1] + start * r->direction[1]);
		rays.ray.org_z[i] = (float)(r->origin[2] + start * r->direction[2]);
		rays.ray.dir_x[i] = (float)r->direction[0];
		rays.ray.dir_y[i] = (float)r->direction[1];
		rays.ray.dir_z[i] = (float)r->direction[2];
		rays.ray.tnear[i] = 0;
		rays.ray.tfar[i] = INFINITY;
		rays.ray.time[i] = 0;
		rays.ray.mask[i] = ~0u;
		rays.ray.id[i] = (unsigned)i;
		rays.ray.flags[i] = 0;
		rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
		rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
	}
	rtcIntersect8(valid, scene->scene, &packet.context, &rays);
	for (int i = 0; i < n; i++) {
		if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
			hit[i].prim = RAY_NONE;
			continue;
		}
		hit[i].prim = rays.hit.primID[i];
		hit[i].u = (double)rays.hit.u[i];
		hit[i].v = (double)rays.hit.v[i];
		locate(scene, &ray[i], &hit[i]);
	}
}

void ray_scene_trace(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, struct ray_hit *hit)
{
	for (int i = 0; i < n; i += PACKET)
		trace_packet(scene, ray + i, n - i < PACKET ? n - i : PACKET, t_min, hit + i);
}

#define SAME_HIT 0x1p-20

void ray_scene_trace_all(const struct ray_scene *scene, const struct ray *ray, int n, int most, struct ray_hit *hit,
                         int *n_hits)
{
	for (int i = 0; i < n; i++) {
		struct ray_hit next;
		double t_min = 0;

		n_hits[i] = 0;
		while (n_hits[i] < most) {
			struct ray moved = ray[i];

			for (int k = 0; k < 3; k++)
				moved.origin[k] += t_min * moved.direction[k];
			ray_scene_trace(scene, &moved, 1, 0, &next);
			if (next.prim == RAY_NONE)
				break;
			next.t += t_min;
			t_min = next.t + SAME_HIT;
			hit[i * most + n_hits[i]++] = next;
		}
	}
}

void ray_scene_occluded(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, uint8_t *is_occluded)
{
	struct ray_hit hit[PACKET];

	for (int i = 0; i < n; i += PACKET) {
		int part = n - i < PACKET ? n - i : PACKET;

		ray_scene_trace(scene, ray + i, part, t_min, hit);
		for (int k = 0; k < part; k++)
			is_occluded[i + k] = hit[k].prim != RAY_NONE;
	}
}

struct nearest {
	const struct ray_scene *scene;
	const double *point;
	double distance2;
};

/* The tree only chooses candidates: distances are computed in double from the primitives. */
static bool visit_nearest(struct RTCPointQueryFunctionArguments *args)
{
	struct nearest *nearest = args->userPtr;
	double corner[3][3], distance2;

	ray_scene_corners(nearest->scene, args->primID, corner);
	distance2 = triangle_distance2((const double(*)[3])corner, nearest->point);
	if (!(distance2 < nearest->distance2))
		return false;
	nearest->distance2 = distance2;
	/* A little more than the distance, so that rounding does not lose an equally near one. */
	args->query->radius = (float)(sqrt(distance2) * (1 + 0x1p-20) + 0x1p-20);
	return true;
}

double ray_scene_distance(const struct ray_scene *scene, const double point[3], double most)
{
	struct nearest nearest = { scene, point, most * most };
	struct RTCPointQuery query = { .x = (float)point[0], .y = (float)point[1], .z = (float)point[2], .time = 0,
		                           .radius = (float)most + 0x1p-20f };
	struct RTCPointQueryContext context;

	rtcInitPointQueryContext(&context);
	rtcPointQuery(scene->scene, &query, &context, visit_nearest, &nearest);
	return nearest.distance2 < most * most ? sqrt(nearest.distance2) : INFINITY;
}
