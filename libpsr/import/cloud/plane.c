#include <math.h>
#include <string.h>
#include "base/axes.h"
#include "base/vec.h"
#include "cloud.h"

#define CHUNK 4096
#define MAX_CORNERS (4 + CLOUD_NEIGHBOURS)
#define OVERLAP 1.05 /* of radii: discs of neighbours lie in different planes */
#define MAX_RATIO 2.0f /* ratio of a radius to the median of the radii around it */
#define WIRE 0.01    /* least ratio of second to first extent, squared, of points that are not on a line */

/* Gathers the neighbours relative to the point, in units of the farthest one's distance, so that no later step
 * overflows or underflows. Returns that distance. */
static double gather(double offset[CLOUD_NEIGHBOURS][3], const struct cloud *cloud, uint32_t i)
{
	double largest = 0.0, length;
	for (uint32_t j = 0; j < cloud->k; j++) {
		v3d_sub(offset[j], cloud->point[cloud->near[(size_t)i * cloud->k + j]].at, cloud->point[i].at);
		for (int c = 0; c < 3; c++)
			largest = fmax(largest, fabs(offset[j][c]));
	}
	if (!(largest > 0.0))
		return 0.0;
	for (uint32_t j = 0; j < cloud->k; j++)
		for (int c = 0; c < 3; c++)
			offset[j][c] /= largest;
	length = v3d_length(offset[cloud->k - 1]);
	if (!(length > 0.0))
		return largest;
	for (uint32_t j = 0; j < cloud->k; j++)
		v3d_scale(offset[j], offset[j], 1.0 / length);
	return largest * length;
}

/* Fits a normal to the point and its neighbours; returns whether they lie on a line. */
static int fit_plane(float normal[3], double offset[CLOUD_NEIGHBOURS][3], uint32_t k)
{
	double mean[3] = { 0.0, 0.0, 0.0 }, m[3][3] = { { 0.0 } }, v[3][3], value[3], n[3];
	int least = 0, most = 0;
	for (uint32_t j = 0; j < k; j++)
		v3d_add(mean, mean, offset[j]);
	v3d_scale(mean, mean, 1.0 / (k + 1.0));
	for (uint32_t j = 0; j <= k; j++) {
		double d[3] = { 0.0, 0.0, 0.0 };
		if (j < k)
			memcpy(d, offset[j], sizeof d);
		v3d_sub(d, d, mean);
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++)
				m[a][b] += d[a] * d[b];
	}
	axes_find(m, v);
	for (int c = 0; c < 3; c++)
		value[c] = m[c][c];
	for (int c = 1; c < 3; c++) {
		if (value[c] < value[least])
			least = c;
		if (value[c] >= value[most])
			most = c;
	}
	if (normal != NULL) {
		if (most == least) /* no extent at all */
			v3d_set(n, 0.0, 0.0, 1.0);
		else
			v3d_normalize(n, v[least]);
		v3f_set(normal, (float)n[0], (float)n[1], (float)n[2]);
	}
	return most == least || value[3 - most - least] < WIRE * value[most];
}

/* A corner of the cell, and the edge that leaves it; -1: of the initial square. */
struct corner {
	double at[2];
	int edge;
};

/* Clips the cell to the half plane nearer to the origin than to `site`. */
static int clip(struct corner *out, const struct corner *in, int n, const double site[2], int edge)
{
	const double half = 0.5 * (site[0] * site[0] + site[1] * site[1]);
	int n_out = 0;
	for (int i = 0; i < n; i++) {
		const struct corner *a = &in[i], *b = &in[(i + 1) % n];
		double da = a->at[0] * site[0] + a->at[1] * site[1] - half, db = b->at[0] * site[0] + b->at[1] * site[1] - half;
		double t;
		if (da <= 0.0)
			out[n_out++] = *a;
		if ((da <= 0.0) == (db <= 0.0))
			continue;
		t = da / (da - db);
		/* Where the outline leaves the half plane the new edge begins; where it returns the old one goes on. */
		out[n_out].edge = da <= 0.0 ? edge : a->edge;
		for (int c = 0; c < 2; c++)
			out[n_out].at[c] = a->at[c] + t * (b->at[c] - a->at[c]);
		n_out++;
	}
	return n_out;
}

/* Returns the radius in units of the farthest neighbour's distance; 0 if all corners belong to the initial square. */
static double cell_radius(double offset[CLOUD_NEIGHBOURS][3], uint32_t k, const float normal[3])
{
	struct corner corner[2][MAX_CORNERS] = {
		{ { { -1, -1 }, -1 }, { { 1, -1 }, -1 }, { { 1, 1 }, -1 }, { { -1, 1 }, -1 } },
	};
	const double n[3] = { normal[0], normal[1], normal[2] };
	const double other[3] = { fabs(n[0]) < 0.6, fabs(n[0]) >= 0.6, 0.0 };
	double u[3], v[3], farthest = 0.0, reach = 2.0; /* reach: the farthest corner, squared, of the square too */
	int count = 4, now = 0;
	v3d_cross(u, n, other);
	v3d_normalize(u, u);
	v3d_cross(v, n, u);
	for (uint32_t j = 0; j < k && count > 0; j++) {
		const double site[2] = { v3d_dot(offset[j], u), v3d_dot(offset[j], v) };
		const double squared = site[0] * site[0] + site[1] * site[1];

		if (squared == 0.0 || squared >= 4.0 * reach)
			continue;
		count = clip(corner[1 - now], corner[now], count, site, (int)j);
		now = 1 - now;
		reach = 0.0;
		for (int i = 0; i < count; i++) {
			const double *at = corner[now][i].at;
			reach = fmax(reach, at[0] * at[0] + at[1] * at[1]);
		}
	}
	for (int i = 0; i < count; i++) {
		const struct corner *c = &corner[now][i];
		if (c->edge >= 0 && corner[now][(i + count - 1) % count].edge >= 0)
			farthest = fmax(farthest, c->at[0] * c->at[0] + c->at[1] * c->at[1]);
	}
	return sqrt(farthest);
}

static void planes_of_chunk(int chunk, void *userdata)
{
	struct cloud *cloud = userdata;
	const uint64_t first = (uint64_t)chunk * CHUNK, end = first + CHUNK < cloud->n ? first + CHUNK : cloud->n;
	for (uint64_t i = first; i < end; i++) {
		double offset[CLOUD_NEIGHBOURS][3], unit = gather(offset, cloud, (uint32_t)i), radius = 0.0;
		int is_wire = fit_plane(cloud->is_given[i] ? NULL : cloud->normal[i], offset, cloud->k);
		if (!is_wire)
			radius = cell_radius(offset, cloud->k, cloud->normal[i]);
		if (!(radius > 0.0)) /* the second neighbour: along a wire there is one on each side */
			radius = v3d_length(offset[cloud->k > 1 ? 1 : 0]);
		cloud->open_radius[i] = (float)(OVERLAP * radius * unit);
	}
}

static void hold_chunk(int chunk, void *userdata)
{
	struct cloud *cloud = userdata;
	const uint64_t first = (uint64_t)chunk * CHUNK, end = first + CHUNK < cloud->n ? first + CHUNK : cloud->n;
	for (uint64_t i = first; i < end; i++) {
		float around[CLOUD_NEIGHBOURS], limit;
		for (uint32_t j = 0; j < cloud->k; j++) {
			float r = cloud->open_radius[cloud->near[i * cloud->k + j]];
			uint32_t at = j;
			for (; at > 0 && around[at - 1] > r; at--)
				around[at] = around[at - 1];
			around[at] = r;
		}
		limit = MAX_RATIO * around[cloud->k / 2];
		cloud->radius[i] = cloud->open_radius[i] < limit ? cloud->open_radius[i] : limit;
	}
}

void cloud_planes(struct cloud *cloud)
{
	const int n_chunks = (int)((cloud->n + CHUNK - 1) / CHUNK);
	psr_pool_for(cloud->pool, n_chunks, planes_of_chunk, cloud);
	psr_pool_for(cloud->pool, n_chunks, hold_chunk, cloud);
}
