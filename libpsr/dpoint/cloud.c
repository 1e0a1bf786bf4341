#include "cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "cloud_fit.h"

#define FACETS 1.25    /* of a radius: a rectangle around a cell is of a class, and up to 2^(1/4) wider */
#define STRIP_FROM 1.5 /* of a radius, from the point: cells reach beyond a border by one */
#define STRIP_TO 3.0
#define NEXT 8         /* neighbours that have to face the same side, if the surface is closed */

static void corner_at(float out[3], const struct dpoint_local *local, const double at[3], double x, double y, double z)
{
	for (int k = 0; k < 3; k++)
		out[k] = (float)(at[k] + x * local->axis[0][k] + y * local->axis[1][k] + z * local->axis[2][k]);
}

/* Around where the point was, as bent as its surface if that is known. */
static int put_facets(struct dpoint_surface *surface, const struct cloud_fit *fit, const double at[3], double radius)
{
	static const int side[4][2] = { { -1, -1 }, { 1, -1 }, { 1, 1 }, { -1, 1 } };
	const struct dpoint_local *local = &fit->local;
	const double r = FACETS * radius, bend = fit->state == CLOUD_FINE ? r * r : 0;
	const double even = 0.5 * bend * (local->shape[0] + local->shape[2]), odd = bend * local->shape[1];
	float corner[4][3], middle[3];
	int rc = PSR_OK;

	corner_at(middle, local, at, 0, 0, 0);
	for (int i = 0; i < 4; i++)
		corner_at(corner[i], local, at, side[i][0] * r, side[i][1] * r, even + side[i][0] * side[i][1] * odd);
	for (int i = 0; i < 4 && rc == PSR_OK; i++)
		rc = facets_add(&surface->facets, corner[i], corner[(i + 1) % 4], middle);
	return rc;
}

/* A rectangle of the tangent plane, from x0, y0 along `along` and across it. */
static int put_cell(struct dpoint_surface *surface, const struct dpoint_local *local, const double from[2],
                    const double along[2], const double size[2])
{
	struct dpoint_cell *cell = dpoint_surface_cell(surface);
	const double across[2] = { -along[1], along[0] };

	if (cell == NULL)
		return PSR_ERR_MEMORY;
	memset(cell, 0, sizeof *cell);
	for (int i = 0; i < 4; i++) {
		const double a = (i == 1 || i == 2) * size[0], b = (i / 2) * size[1];

		corner_at(cell->corner[i], local, local->at, from[0] + a * along[0] + b * across[0],
		          from[1] + a * along[1] + b * across[1], 0);
	}
	for (int k = 0; k < 3; k++)
		cell->normal[k] = (float)local->axis[2][k];
	return PSR_OK;
}

/* Towards the middle of where no neighbour is. */
static int put_strip(struct dpoint_surface *surface, const struct cloud_fit *fit, double r)
{
	const double out[2] = { fit->border[0], fit->border[1] };
	const double from[2] = { STRIP_FROM * r * out[0] + r * out[1], STRIP_FROM * r * out[1] - r * out[0] };
	int rc = put_cell(surface, &fit->local, from, out, (const double[2]){ (STRIP_TO - STRIP_FROM) * r, 2 * r });

	if (rc == PSR_OK)
		surface->cell[surface->n_cells - 1].part = DPOINT_BEYOND;
	return rc;
}

static int put_point(struct dpoint_surface *surface, const struct dpoint_cloud *cloud, uint32_t i,
                     const struct cloud_fit *fit, float delta)
{
	const double r = (double)cloud->radius[i];
	const struct dpoint_candidate like = { .delta = { delta, delta }, .part = cloud->part[i], .point.attr = cloud->attr[i],
		                                   .cell = (uint32_t)surface->n_cells };
	int rc = put_cell(surface, &fit->local, (const double[2]){ -r, -r }, (const double[2]){ 1, 0 },
	                  (const double[2]){ 2 * r, 2 * r });

	if (rc != PSR_OK)
		return rc;
	surface->cell[like.cell].part = cloud->part[i];
	surface->cell[like.cell].attr = cloud->attr[i];
	rc = dpoint_surface_put(surface, &fit->local, &like);
	if (rc == PSR_OK)
		rc = put_facets(surface, fit, cloud->at[i], r);
	if (rc == PSR_OK && fit->has_border)
		rc = put_strip(surface, fit, r);
	return rc;
}

static int is_opposed(const struct dpoint_cloud *cloud, const struct cloud_fit *fit, uint32_t i)
{
	for (uint32_t j = 0; j < cloud->k && j < NEXT; j++)
		if (v3d_dot(fit[i].local.axis[2], fit[cloud->near[(size_t)i * cloud->k + j]].local.axis[2]) < 0)
			return 1;
	return 0;
}

int dpoint_sample_cloud(struct dpoint_surface *surface, struct dpoint_cloud_report *report,
                        const struct dpoint_cloud *cloud, const struct dpoint_cover_options *cover, float delta,
                        struct psr_pool *pool)
{
	struct cloud_fit *fit = malloc(((size_t)cloud->n + 1) * sizeof *fit);
	int rc = fit != NULL ? PSR_OK : PSR_ERR_MEMORY;

	*report = (struct dpoint_cloud_report){ .is_closed = 1 };
	if (rc == PSR_OK)
		rc = cloud_fit_all(fit, cloud, cover, delta, pool);
	for (uint32_t i = 0; i < cloud->n && rc == PSR_OK; i++) {
		report->n_flat += fit[i].state == CLOUD_FLAT;
		report->is_closed &= !fit[i].has_border && fit[i].state != CLOUD_FLAT && !is_opposed(cloud, fit, i);
		rc = put_point(surface, cloud, i, &fit[i], delta);
	}
	if (rc == PSR_OK)
		rc = facets_sort(&surface->facets);
	surface->n_bad += report->n_flat;
	surface->is_cloud = 1;
	free(fit);
	return rc;
}
