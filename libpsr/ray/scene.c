#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "tree.h"

void ray_scene_center(const struct ray_scene *scene, uint32_t prim, double center[3])
{
	for (int k = 0; k < 3; k++)
		center[k] = (scene->mesh->point[prim - scene->mesh->n_triangles][k] - scene->origin[k]) * scene->shrink;
}

void ray_scene_corners(const struct ray_scene *scene, uint32_t prim, double corner[3][3])
{
	memcpy(corner, scene->corner[prim], sizeof scene->corner[prim]);
}

double ray_disc(const struct ray_scene *scene, uint32_t prim, double center[3], double normal[3])
{
	uint32_t i = prim - scene->mesh->n_triangles;

	for (int k = 0; k < 3; k++) {
		center[k] = (scene->mesh->point[i][k] - scene->origin[k]) * scene->shrink;
		normal[k] = (double)scene->mesh->point_normal[i][k];
	}
	return (double)scene->mesh->point_radius[i] * scene->shrink;
}

const float *ray_scene_normal(const struct ray_scene *scene, uint32_t prim)
{
	return ray_is_disc(scene, prim) ? scene->mesh->point_normal[prim - scene->mesh->n_triangles] : scene->normal[prim];
}

static int needs_filter(const struct psr_mesh *mesh)
{
	for (uint32_t i = 0; i < mesh->n_materials; i++)
		if (!mesh->material[i].two_sided || mesh->material[i].alpha != PSR_ALPHA_OPAQUE)
			return 1;
	return 0;
}

static void attach(struct ray_scene *scene, RTCGeometry geometry, unsigned id)
{
	rtcCommitGeometry(geometry);
	rtcAttachGeometryByID(scene->scene, geometry, id);
}

/* The tree's own floats are relative to the origin and scaled: far coordinates lose nothing. */
static int attach_triangles(struct ray_scene *scene)
{
	const struct psr_mesh *mesh = scene->mesh;
	RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
	float (*vertex)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
	                                             sizeof *vertex, mesh->n_vertices);
	uint32_t (*index)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
	                                               sizeof *index, mesh->n_triangles);
	int rc = vertex != NULL && index != NULL ? PSR_OK : PSR_ERR_MEMORY;

	if (rc == PSR_OK) {
		for (uint32_t i = 0; i < mesh->n_vertices; i++)
			for (int k = 0; k < 3; k++)
				vertex[i][k] = (float)((mesh->position[i][k] - scene->origin[k]) * scene->shrink);
		for (uint32_t i = 0; i < mesh->n_triangles; i++)
			for (int k = 0; k < 3; k++)
				index[i][k] = mesh->triangle[i][k];
		attach(scene, geometry, RAY_TRIANGLES);
	}
	rtcReleaseGeometry(geometry);
	return rc;
}

static int attach_discs(struct ray_scene *scene)
{
	const struct psr_mesh *mesh = scene->mesh;
	RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
	float (*vertex)[4] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
	                                             sizeof *vertex, mesh->n_points);
	float (*normal)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3,
	                                             sizeof *normal, mesh->n_points);
	int rc = vertex != NULL && normal != NULL ? PSR_OK : PSR_ERR_MEMORY;

	if (rc == PSR_OK) {
		for (uint32_t i = 0; i < mesh->n_points; i++) {
			double center[3], axis[3];

			vertex[i][3] = (float)ray_disc(scene, mesh->n_triangles + i, center, axis);
			for (int k = 0; k < 3; k++) {
				vertex[i][k] = (float)center[k];
				normal[i][k] = mesh->point_normal[i][k];
			}
		}
		attach(scene, geometry, RAY_DISCS);
	}
	rtcReleaseGeometry(geometry);
	return rc;
}

/* A hit reads all corners: from the vertices that would be four cache misses. */
static int make_triangles(struct ray_scene *scene)
{
	const struct psr_mesh *mesh = scene->mesh;

	scene->corner = psr_alloc_array(mesh->n_triangles, sizeof *scene->corner);
	scene->normal = psr_alloc_array(mesh->n_triangles, sizeof *scene->normal);
	if (scene->corner == NULL || scene->normal == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < mesh->n_triangles; i++) {
		double (*corner)[3] = scene->corner[i], e1[3], e2[3], n[3];

		for (int c = 0; c < 3; c++)
			for (int k = 0; k < 3; k++)
				corner[c][k] = (mesh->position[mesh->triangle[i][c]][k] - scene->origin[k]) * scene->shrink;
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
	int rc = PSR_OK;

	/* One thread and one instruction set: always the same tree. */
	scene->device = rtcNewDevice(__builtin_cpu_supports("avx2") ? "isa=avx2,threads=1,set_affinity=0"
	                                                            : "threads=1,set_affinity=0");
	if (scene->device == NULL)
		return PSR_ERR_INTERNAL;
	scene->scene = rtcNewScene(scene->device);
	if (scene->scene == NULL)
		return PSR_ERR_MEMORY;
	rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
	if (scene->mesh->n_triangles > 0)
		rc = attach_triangles(scene);
	if (rc == PSR_OK && scene->mesh->n_points > 0)
		rc = attach_discs(scene);
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
	uint64_t n = (uint64_t)mesh->n_triangles + mesh->n_points;
	int rc;

	if (scene == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a mesh of %llu primitives", (unsigned long long)n);
	scene->mesh = mesh;
	v3d_set(scene->origin, origin[0], origin[1], origin[2]);
	scene->shrink = 1 / scale;
	scene->lets_through = needs_filter(mesh);
	rc = make_triangles(scene);
	if (rc == PSR_OK)
		rc = build_tree(scene);
	if (rc != PSR_OK) {
		ray_scene_destroy(scene);
		return rc == PSR_ERR_MEMORY
		           ? psr_fail(err, rc, "no memory for the ray tracer's tree of %llu primitives", (unsigned long long)n)
		           : psr_fail(err, rc, "the ray tracer does not start: Embree error %d", (int)rtcGetDeviceError(NULL));
	}
	*out = scene;
	return PSR_OK;
}

void ray_scene_destroy(struct ray_scene *scene)
{
	if (scene == NULL)
		return;
	if (scene->discs != NULL)
		rtcReleaseScene(scene->discs);
	if (scene->scene != NULL)
		rtcReleaseScene(scene->scene);
	if (scene->device != NULL)
		rtcReleaseDevice(scene->device);
	psr_free(scene->corner);
	psr_free(scene->normal);
	free(scene);
}
