#include <float.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "base/srgb.h"
#include "cloud.h"

#define EMPTY UINT32_MAX
#define LONE_RADIUS 1.0f     /* of a cloud that is one point, in units of the file */
#define BRIGHT 0.99          /* share of a cloud's points with an intensity below white */
#define LEAST_RADIUS 1e-9f   /* of the model's size */

float cloud_linear(double code)
{
	int below;
	if (!(code > 0.0))
		return psr_srgb_to_linear[0];
	if (!(code < 255.0))
		return psr_srgb_to_linear[255];
	below = (int)code;
	return (float)(psr_srgb_to_linear[below] +
	               (code - below) * ((double)psr_srgb_to_linear[below + 1] - psr_srgb_to_linear[below]));
}

double cloud_white(const uint64_t histogram[CLOUD_BINS])
{
	uint64_t n = 0, below = 0;

	for (uint32_t i = 0; i < CLOUD_BINS; i++)
		n += histogram[i];
	for (uint32_t i = 0; i < CLOUD_BINS; i++) {
		below += histogram[i];
		if ((double)below >= BRIGHT * (double)n)
			return i;
	}
	return CLOUD_BINS - 1;
}

static int same_place(const double a[3], const double b[3])
{
	return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Adding 0 turns -0 into 0. */
static uint64_t hash_of(const double p[3])
{
	const double key[3] = { p[0] + 0.0, p[1] + 0.0, p[2] + 0.0 };
	return XXH64(key, sizeof key, 0);
}

/* Keeps the first of points at one position. */
static int drop_duplicates(struct import_mesh *im)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;
	const int n_columns = import_point_columns(column, mesh);
	uint64_t n_slots = 16;
	uint32_t *slot, kept = 0, n_dropped;
	while (n_slots < 2 * (uint64_t)mesh->n_points)
		n_slots *= 2;
	slot = malloc(n_slots * sizeof *slot);
	if (slot == NULL)
		return PSR_ERR_MEMORY;
	memset(slot, 0xff, n_slots * sizeof *slot);
	for (uint32_t p = 0; p < mesh->n_points; p++) {
		uint64_t at = hash_of(mesh->point[p]) & (n_slots - 1);
		while (slot[at] != EMPTY && !same_place(mesh->point[slot[at]], mesh->point[p]))
			at = (at + 1) & (n_slots - 1);
		if (slot[at] != EMPTY)
			continue;
		slot[at] = kept;
		for (int i = 0; kept != p && i < n_columns; i++)
			memcpy(import_column_at(&column[i], kept), import_column_at(&column[i], p), column[i].size);
		kept++;
	}
	free(slot);
	n_dropped = mesh->n_points - kept;
	mesh->n_points = kept;
	mesh->n_dropped_primitives += n_dropped;
	if (n_dropped > 0)
		import_mesh_warn(im, "duplicate points were left out: %u", n_dropped);
	return PSR_OK;
}

static void cloud_fini(struct cloud *cloud)
{
	psr_pool_destroy(cloud->pool);
	free(cloud->point);
	free(cloud->near);
	free(cloud->normal);
	free(cloud->is_given);
	free(cloud->radius);
	free(cloud->open_radius);
	free(cloud->node);
}

static int cloud_init(struct cloud *cloud, const struct psr_mesh *mesh, int n_threads)
{
	int rc;
	memset(cloud, 0, sizeof *cloud);
	cloud->n = mesh->n_points;
	cloud->normal = malloc(cloud->n * sizeof *cloud->normal);
	cloud->is_given = malloc(cloud->n);
	cloud->radius = malloc(cloud->n * sizeof *cloud->radius);
	cloud->open_radius = malloc(cloud->n * sizeof *cloud->open_radius);
	if (cloud->normal == NULL || cloud->is_given == NULL || cloud->radius == NULL || cloud->open_radius == NULL)
		return PSR_ERR_MEMORY;
	rc = cloud_tree_build(cloud, (const double(*)[3])mesh->point);
	if (rc != PSR_OK)
		return rc;
	return psr_pool_create(&cloud->pool, n_threads, NULL);
}

/* Copies normals from the mesh; returns how many are missing. */
static uint32_t take_normals(struct cloud *cloud, const struct psr_mesh *mesh)
{
	uint32_t n_missing = 0;
	for (uint32_t i = 0; i < cloud->n; i++) {
		const float *n = mesh->point_normal[cloud->point[i].id];
		memcpy(cloud->normal[i], n, sizeof cloud->normal[i]);
		cloud->is_given[i] = n[0] != 0.0f || n[1] != 0.0f || n[2] != 0.0f;
		n_missing += !cloud->is_given[i];
	}
	return n_missing;
}

static void put_results(struct psr_mesh *mesh, const struct cloud *cloud)
{
	for (uint32_t i = 0; i < cloud->n; i++) {
		const uint32_t to = cloud->point[i].id;
		const float least = LEAST_RADIUS;
		double radius = (double)(cloud->radius[i] > least ? cloud->radius[i] : least) * cloud->unit;
		memcpy(mesh->point_normal[to], cloud->normal[i], sizeof cloud->normal[i]);
		if (!(mesh->point_radius[to] > 0.0f && mesh->point_radius[to] <= FLT_MAX))
			mesh->point_radius[to] = radius < FLT_MIN ? FLT_MIN : radius > FLT_MAX ? FLT_MAX : (float)radius;
	}
}

static void finish_one(struct psr_mesh *mesh)
{
	float *n = mesh->point_normal[0];
	if (n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f)
		n[2] = 1.0f;
	if (!(mesh->point_radius[0] > 0.0f && mesh->point_radius[0] <= FLT_MAX))
		mesh->point_radius[0] = LONE_RADIUS;
}

int import_cloud_finish(struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	struct cloud cloud;
	uint32_t n_missing;
	int rc = drop_duplicates(im);
	memset(&cloud, 0, sizeof cloud);
	if (rc == PSR_OK && mesh->n_points == 1) {
		finish_one(mesh);
		return PSR_OK;
	}
	if (rc == PSR_OK)
		rc = cloud_init(&cloud, mesh, im->options.n_threads);
	if (rc == PSR_OK) {
		n_missing = take_normals(&cloud, mesh);
		cloud_tree_nearest(&cloud);
		cloud_planes(&cloud);
		if (n_missing > 0)
			rc = cloud_orient(&cloud);
	}
	if (rc == PSR_OK)
		put_results(mesh, &cloud);
	cloud_fini(&cloud);
	return rc == PSR_OK ? PSR_OK
	                    : psr_fail(err, rc, "%s: no memory for the normals of %u points", im->path, mesh->n_points);
}
