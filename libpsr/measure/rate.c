#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "base/vec.h"
#include "surface/validate.h"
#include "ray/tree.h"
#include "base/direction.h"
#include "rate.h"

#define ACROSS 512
#define DIRECTIONS 4
#define ROUNDS 3
#define SIDE 8 /* of a block */
#define RUN (SIDE * SIDE)

struct rays {
	int n;
	struct ray *ray;
	struct RTCRay8 *packet;
};

/* Blocks of lattices, in the order of the sampler. */
static int make_rays(struct rays *rays)
{
	const double step = 2.0 / ACROSS, row_height = step * sqrt(3.0) / 2;
	const int reach = (int)(1 / (SIDE * row_height)) + 1;
	int n = 0, valid[RAY_PACKET];
	rays->ray = psr_alloc_array((size_t)DIRECTIONS * 4 * (size_t)(reach * reach) * RUN, sizeof *rays->ray);
	if (rays->ray == NULL)
		return PSR_ERR_MEMORY;
	for (unsigned d = 0; d < DIRECTIONS; d++) {
		double z[3], frame[3][3];
		psr_direction_center(1, 9 * d, z);
		psr_direction_basis(z, frame);
		for (int b = 0; b < 4 * reach * reach; b++) {
			for (int s = 0; s < RUN; s++) {
				int row = SIDE * (b / (2 * reach) - reach) + s / SIDE,
					col = SIDE * (b % (2 * reach) - reach) + s % SIDE;
				double x = (col + (row & 1) / 2.0) * step, y = row * row_height;
				if (x * x + y * y > 1)
					continue;
				for (int k = 0; k < 3; k++) {
					rays->ray[n].origin[k] = x * frame[0][k] + y * frame[1][k] + 2 * frame[2][k];
					rays->ray[n].direction[k] = -frame[2][k];
				}
				n++;
			}
		}
	}
	rays->n = n - n % RAY_PACKET;
	rays->packet = psr_alloc_array((size_t)rays->n / RAY_PACKET, sizeof *rays->packet);
	if (rays->packet == NULL)
		return PSR_ERR_MEMORY;
	for (int i = 0; i < rays->n; i += RAY_PACKET)
		ray_packet_fill(&rays->packet[i / RAY_PACKET], valid, rays->ray + i, RAY_PACKET, 0);
	return PSR_OK;
}

static double time_ours(const struct ray_scene *scene, const struct rays *rays, uint64_t *n_hits)
{
	uint64_t started = clock_thread_ns();
	for (int i = 0; i < rays->n; i += RUN) {
		struct ray_hit hit[RUN];
		int n = rays->n - i < RUN ? rays->n - i : RUN;
		ray_scene_trace(scene, rays->ray + i, n, 0, hit);
		for (int k = 0; k < n; k++)
			*n_hits += hit[k].prim != RAY_NONE;
	}
	return (double)(clock_thread_ns() - started) * 1e-9;
}

static double time_embree(const struct ray_scene *scene, const struct rays *rays, uint64_t *n_hits)
{
	static const int all[RAY_PACKET] __attribute__((aligned(32))) = { -1, -1, -1, -1, -1, -1, -1, -1 };
	struct RTCIntersectContext context;
	uint64_t started = clock_thread_ns();
	rtcInitIntersectContext(&context);
	context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
	for (int i = 0; i < rays->n / RAY_PACKET; i++) {
		struct RTCRayHit8 rayhit;
		rayhit.ray = rays->packet[i];
		memset(rayhit.hit.geomID, -1, sizeof rayhit.hit.geomID);
		memset(rayhit.hit.instID, -1, sizeof rayhit.hit.instID);
		rtcIntersect8(all, scene->scene, &context, &rayhit);
		for (int k = 0; k < RAY_PACKET; k++)
			*n_hits += rayhit.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
	}
	return (double)(clock_thread_ns() - started) * 1e-9;
}

int psr_ray_rate(const struct psr_mesh *mesh, double *ours, double *embree, struct psr_error *err)
{
	struct rays rays = { 0 };
	struct ray_scene *scene = NULL;
	double center[3], radius, best[2] = { INFINITY, INFINITY };
	uint64_t n_hits = 0;
	int rc = validate_mesh(mesh, err);
	if (rc == PSR_OK)
		rc = validate_bound_mesh(mesh, center, &radius, err);
	if (rc == PSR_OK)
		rc = ray_scene_create(&scene, mesh, center, radius, err);
	if (rc == PSR_OK && make_rays(&rays) != PSR_OK)
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory for a million rays");
	for (int round = 0; round < ROUNDS && rc == PSR_OK; round++) {
		best[0] = fmin(best[0], time_ours(scene, &rays, &n_hits));
		best[1] = fmin(best[1], time_embree(scene, &rays, &n_hits));
	}
	if (rc == PSR_OK && n_hits == 0)
		rc = psr_fail(err, PSR_ERR_ARG, "no ray meets the mesh");
	if (rc == PSR_OK) {
		*ours = rays.n / best[0] * 1e-6;
		*embree = rays.n / best[1] * 1e-6;
	}
	psr_free(rays.ray);
	psr_free(rays.packet);
	ray_scene_destroy(scene);
	return rc;
}
