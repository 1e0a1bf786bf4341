#include <math.h>
#include "base/vec.h"
#include "surface/stipple.h"
#include "surface/texture.h"
#include "tree.h"

#define LEAST_OPACITY (0.5f / 255) /* less counts as nothing in a model */

/* Where a ray meets the triangle that the tree found: in its plane, clamped to it, as the tree rounds edges outwards.
 * An edge-on triangle keeps the tree's u and v. */
static void locate_triangle(const struct ray_scene *scene, const struct ray *ray, struct ray_hit *hit)
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

/* In the plane of the disc, clamped to its rim. */
static void locate_disc(const struct ray_scene *scene, const struct ray *ray, struct ray_hit *hit)
{
	double center[3], normal[3], s[3], reach[3], length, radius = ray_disc(scene, hit->prim, center, normal);
	double slope = v3d_dot(normal, ray->direction);

	hit->u = hit->v = 0;
	hit->is_back = slope > 0;
	v3d_sub(s, center, ray->origin);
	v3d_set(reach, 0, 0, 0);
	if (slope != 0) {
		v3d_scale(reach, ray->direction, v3d_dot(normal, s) / slope);
		v3d_sub(reach, reach, s);
		length = v3d_length(reach);
		if (length > radius)
			v3d_scale(reach, reach, radius / length);
	}
	v3d_add(s, s, reach);
	hit->t = v3d_dot(s, ray->direction) / v3d_dot(ray->direction, ray->direction);
}

void ray_hit_locate(const struct ray_scene *scene, const struct ray *ray, struct ray_hit *hit)
{
	if (ray_is_disc(scene, hit->prim))
		locate_disc(scene, ray, hit);
	else
		locate_triangle(scene, ray, hit);
}

void ray_locate(const struct ray_scene *scene, const struct ray *ray, uint32_t prim, double *u, double *v)
{
	struct ray_hit hit = { .prim = prim, .u = 1.0 / 3, .v = 1.0 / 3 };

	ray_hit_locate(scene, ray, &hit);
	*u = hit.u;
	*v = hit.v;
}

static const struct psr_material *material_of(const struct psr_mesh *mesh, uint32_t prim)
{
	return &mesh->material[texture_material(mesh, prim)];
}

void ray_scene_stipple(struct ray_scene *scene, double cell)
{
	scene->cell = cell;
}

static int is_open(const struct ray_scene *scene, uint32_t prim, double u, double v, float opacity)
{
	double p[3], corner[3][3];

	if (ray_is_disc(scene, prim)) {
		ray_scene_center(scene, prim, p);
	} else {
		ray_scene_corners(scene, prim, corner);
		for (int k = 0; k < 3; k++)
			p[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
	}
	return stipple_is_open(opacity, p, scene->cell);
}

/* Returns the opacity of a place that lets light through in proportion; else 1, or 0 where the surface is absent. */
static float opacity_of(const struct ray_scene *scene, uint32_t prim, double u, double v)
{
	const struct psr_material *material = material_of(scene->mesh, prim);
	float rgba[4];

	if (material->alpha != PSR_ALPHA_BLEND || !(scene->cell > 0))
		return texture_is_absent(scene->mesh, prim, u, v) ? 0 : 1;
	texture_base_color(scene->mesh, prim, u, v, rgba);
	return rgba[3];
}

int ray_scene_is_absent(const struct ray_scene *scene, uint32_t prim, double u, double v)
{
	return opacity_of(scene, prim, u, v) < LEAST_OPACITY;
}

int ray_scene_is_sheer(const struct ray_scene *scene, uint32_t prim, double u, double v)
{
	return material_of(scene->mesh, prim)->alpha == PSR_ALPHA_BLEND && opacity_of(scene, prim, u, v) < 1;
}

/* The side alone decides whether an opaque triangle stops a ray; the rounded normal tells the side unless the ray
 * nearly grazes the triangle. */
enum verdict { STOPS, GOES_ON, MUST_LOOK };

static enum verdict judge(const struct ray_scene *scene, const struct ray *ray, uint32_t prim)
{
	const struct psr_material *material = material_of(scene->mesh, prim);
	const float *normal = ray_scene_normal(scene, prim);
	double slope = 0, least = 0;

	if (material->alpha != PSR_ALPHA_OPAQUE)
		return MUST_LOOK;
	if (material->two_sided)
		return STOPS;
	for (int k = 0; k < 3; k++) {
		slope += (double)normal[k] * ray->direction[k];
		least += fabs(ray->direction[k]);
	}
	least *= 0x1p-20;
	return slope < -least ? STOPS : slope > least ? GOES_ON : MUST_LOOK;
}

int ray_hit_is_absent(const struct ray_scene *scene, const struct ray_hit *hit)
{
	if (hit->is_back && !ray_is_two_sided(scene, hit->prim))
		return 1;
	return ray_scene_is_absent(scene, hit->prim, hit->u, hit->v);
}

static int lets_through(const struct ray_scene *scene, const struct ray_hit *hit)
{
	if (ray_hit_is_absent(scene, hit))
		return 1;
	return ray_scene_is_sheer(scene, hit->prim, hit->u, hit->v)
	       && is_open(scene, hit->prim, hit->u, hit->v, opacity_of(scene, hit->prim, hit->u, hit->v));
}

static void filter(const struct RTCFilterFunctionNArguments *args)
{
	const struct ray_packet *packet = (const struct ray_packet *)(const void *)args->context;
	const struct ray_columns column = ray_columns_of(args);

	for (unsigned i = 0; i < args->N; i++) {
		enum verdict verdict;
		struct ray_hit hit;

		if (args->valid[i] == 0)
			continue;
		hit.prim = ray_prim(packet->scene, column.geometry[i], column.prim[i]);
		verdict = judge(packet->scene, &packet->ray[column.id[i]], hit.prim);
		if (verdict == MUST_LOOK) {
			hit.u = (double)column.u[i];
			hit.v = (double)column.v[i];
			ray_hit_locate(packet->scene, &packet->ray[column.id[i]], &hit);
			verdict = lets_through(packet->scene, &hit) ? GOES_ON : STOPS;
		}
		if (verdict == GOES_ON)
			args->valid[i] = 0;
	}
}

void ray_packet_init(struct ray_packet *packet, const struct ray_scene *scene, const struct ray *ray)
{
	rtcInitIntersectContext(&packet->context);
	packet->context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
	packet->context.filter = scene->lets_through ? filter : NULL;
	packet->scene = scene;
	packet->ray = ray;
	packet->list = NULL;
}

/* Far origins lose bits as floats: a ray starts just outside of the unit sphere instead. */
static double first_t(const struct ray *ray, double t_min)
{
	double squared = v3d_dot(ray->direction, ray->direction);
	double near_t = -(v3d_dot(ray->origin, ray->direction) + 2 * sqrt(squared)) / squared;

	return near_t > t_min ? near_t : t_min;
}

void ray_packet_fill(struct RTCRay8 *rays, int valid[RAY_PACKET], const struct ray *ray, int n, double t_min)
{
	for (int i = 0; i < RAY_PACKET; i++) {
		const struct ray *r = &ray[i < n ? i : 0];
		double start = first_t(r, t_min);

		valid[i] = i < n ? -1 : 0;
		rays->org_x[i] = (float)(r->origin[0] + start * r->direction[0]);
		rays->org_y[i] = (float)(r->origin[1] + start * r->direction[1]);
		rays->org_z[i] = (float)(r->origin[2] + start * r->direction[2]);
		rays->dir_x[i] = (float)r->direction[0];
		rays->dir_y[i] = (float)r->direction[1];
		rays->dir_z[i] = (float)r->direction[2];
		rays->tnear[i] = 0;
		rays->tfar[i] = INFINITY;
		rays->time[i] = 0;
		rays->mask[i] = ~0u;
		rays->id[i] = (unsigned)i;
		rays->flags[i] = 0;
	}
}

static void trace_packet(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, double t_max,
                         struct ray_hit *hit)
{
	_Alignas(32) int valid[RAY_PACKET];
	struct RTCRayHit8 rays;
	struct ray_packet packet;

	ray_packet_init(&packet, scene, ray);
	ray_packet_fill(&rays.ray, valid, ray, n, t_min);
	for (int i = 0; i < RAY_PACKET; i++) {
		rays.ray.tfar[i] = (float)(t_max - first_t(&ray[i < n ? i : 0], t_min));
		rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
		rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
	}
	rtcIntersect8(valid, scene->scene, &packet.context, &rays);
	for (int i = 0; i < n; i++) {
		hit[i].prim = RAY_NONE;
		if (rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) {
			hit[i].prim = ray_prim(scene, rays.hit.geomID[i], rays.hit.primID[i]);
			ray_prefetch(scene, hit[i].prim);
		}
	}
	for (int i = 0; i < n; i++) {
		if (hit[i].prim == RAY_NONE)
			continue;
		hit[i].u = (double)rays.hit.u[i];
		hit[i].v = (double)rays.hit.v[i];
		ray_hit_locate(scene, &ray[i], &hit[i]);
	}
}

void ray_scene_trace(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, struct ray_hit *hit)
{
	ray_scene_trace_near(scene, ray, n, t_min, INFINITY, hit);
}

void ray_scene_trace_near(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, double t_max,
                          struct ray_hit *hit)
{
	for (int i = 0; i < n; i += RAY_PACKET)
		trace_packet(scene, ray + i, n - i < RAY_PACKET ? n - i : RAY_PACKET, t_min, t_max, hit + i);
}

void ray_scene_occluded(const struct ray_scene *scene, const struct ray *ray, int n, double t_max, uint8_t *is_occluded)
{
	for (int i = 0; i < n; i += RAY_PACKET) {
		int part = n - i < RAY_PACKET ? n - i : RAY_PACKET;

		_Alignas(32) int valid[RAY_PACKET];
		struct RTCRay8 rays;
		struct ray_packet packet;

		ray_packet_init(&packet, scene, ray + i);
		packet.context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
		ray_packet_fill(&rays, valid, ray + i, part, 0);
		for (int k = 0; k < part; k++)
			rays.tfar[k] = (float)(t_max - first_t(&ray[i + k], 0));
		rtcOccluded8(valid, scene->scene, &packet.context, &rays);
		/* Embree sets tfar to minus infinity. */
		for (int k = 0; k < part; k++)
			is_occluded[i + k] = rays.tfar[k] == -INFINITY;
	}
}
