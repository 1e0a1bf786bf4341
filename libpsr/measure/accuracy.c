#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/stats.h"
#include "base/vec.h"
#include "base/pool.h"
#include "truth.h"

/* Rays a side over the nine pixels of a neighbourhood: 4x4 in each, and where they meet nothing 20x20, since samples
 * find slivers of a tenth of a pixel (the rim of a cut-out) as well as anything else. */
#define OUTSIDE_SIDE 12
#define OUTSIDE_FINE_SIDE 60

/* A frame's depth is that of some sample in the pixel, up to 0.71 pixels from its centre, and the truth's may be that
 * of a diagonal neighbour's centre, 1.42 away: on a slope they may differ by this many pixels times its tangent. */
#define SLOPE_PIXELS 2.2
/* 85 degrees: surfaces seen flatter have no usable slope. */
#define LEAST_COSINE 0.087

/* [G] 7.2: within three sample spacings two depths are on one surface. */
#define HOLE_SPACINGS 3

/* A point's truth may lie this many footprints of a pixel to the side. */
#define NEAR_FOOTPRINTS 1.5

/* Points further than this from the planes of their neighbours are compared with the whole mesh. */
#define WALL_SPACINGS 0.5

struct measure {
	const struct psr_truth *truth;
	struct view view;
	double spacing;
	uint32_t width, height;
	const float *depth;      /* of the frame */
	float *truth_depth;
	float (*truth_normal)[3];
	double *distance;        /* by pixel; -1: not compared */
	struct psr_accuracy *row; /* counts of each row */
};

/* Centre rays of the 3x3 neighbourhood that meet the object. */
struct neighbor {
	double point[3], normal[3], z;
	double cosine; /* between normal and ray */
};

static int find_neighbors(const struct measure *m, uint32_t x, uint32_t y, struct neighbor neighbor[9])
{
	int n = 0;
	for (uint32_t j = y == 0 ? 0 : y - 1; j <= y + 1 && j < m->height; j++) {
		for (uint32_t i = x == 0 ? 0 : x - 1; i <= x + 1 && i < m->width; i++) {
			size_t at = (size_t)j * m->width + i;
			double origin[3], direction[3];
			if (!isfinite(m->truth_depth[at]))
				continue;
			view_ray(&m->view, i + 0.5, j + 0.5, origin, direction);
			neighbor[n].z = (double)m->truth_depth[at];
			v3d_add_scaled(neighbor[n].point, origin, neighbor[n].z, direction);
			for (int k = 0; k < 3; k++)
				neighbor[n].normal[k] = (double)m->truth_normal[at][k];
			v3d_normalize(direction, direction);
			neighbor[n].cosine = fmax(LEAST_COSINE, -v3d_dot(neighbor[n].normal, direction));
			n++;
		}
	}
	return n;
}

static int is_behind(const struct measure *m, double z, const struct neighbor *neighbor, int n)
{
	for (int i = 0; i < n; i++) {
		double cosine = fmin(1, neighbor[i].cosine), slope = sqrt(1 - cosine * cosine) / cosine;
		double pixel = view_pixel(&m->view, neighbor[i].z);
		if (z <= neighbor[i].z + HOLE_SPACINGS * m->spacing + SLOPE_PIXELS * pixel * slope)
			return 0;
	}
	return 1;
}

/* Nine rays tell most pixels. An outline may pass between them, and what is drawn there is what lies beside it: so rays
 * all over the neighbourhood look for it. */
static int is_hole(const struct measure *m, uint32_t x, uint32_t y, const struct neighbor neighbor[9])
{
	const double z = (double)m->depth[(size_t)y * m->width + x];
	return is_behind(m, z, neighbor, 9) &&
	       !truth_reaches(m->truth, &m->view, x - 1.0, y - 1.0, 3, z - HOLE_SPACINGS * m->spacing);
}

/* Returns the distance along the truth's normal to the nearest truth beside the point, else to the nearest of all. */
static double distance_to(const struct measure *m, const double point[3], const struct neighbor *neighbor, int n)
{
	double nearest[2] = { INFINITY, INFINITY };
	for (int i = 0; i < n; i++) {
		double d[3], along, aside, footprint = view_pixel(&m->view, neighbor[i].z) / neighbor[i].cosine;
		v3d_sub(d, point, neighbor[i].point);
		along = fabs(v3d_dot(d, neighbor[i].normal));
		aside = sqrt(fmax(0, v3d_dot(d, d) - along * along));
		if (aside <= NEAR_FOOTPRINTS * footprint)
			nearest[0] = fmin(nearest[0], along);
		nearest[1] = fmin(nearest[1], along);
	}
	return isfinite(nearest[0]) ? nearest[0] : nearest[1];
}

static int is_outside(const struct measure *m, uint32_t x, uint32_t y)
{
	return !truth_is_met(m->truth, &m->view, x - 1.0, y - 1.0, 3, OUTSIDE_SIDE) &&
	       !truth_is_met(m->truth, &m->view, x - 1.0, y - 1.0, 3, OUTSIDE_FINE_SIDE);
}

static void measure_pixel(const struct measure *m, uint32_t x, uint32_t y, struct psr_accuracy *count)
{
	size_t at = (size_t)y * m->width + x;
	int is_drawn = isfinite(m->depth[at]), n, is_inside;
	struct neighbor neighbor[9];
	m->distance[at] = -1;
	n = find_neighbors(m, x, y, neighbor);
	is_inside = n == 9;
	count->n_truth += isfinite(m->truth_depth[at]) != 0;
	count->n_inside += (uint64_t)is_inside;
	count->n_inside_empty += (uint64_t)(is_inside && !is_drawn);
	count->n_holes += (uint64_t)(is_inside && is_hole(m, x, y, neighbor));
	if (is_drawn && n == 0)
		count->n_outside_drawn += (uint64_t)is_outside(m, x, y);
	if (is_drawn && n != 0) {
		double origin[3], direction[3], point[3];
		view_ray(&m->view, x + 0.5, y + 0.5, origin, direction);
		v3d_add_scaled(point, origin, (double)m->depth[at], direction);
		m->distance[at] = distance_to(m, point, neighbor, n) / m->spacing;
		/* No centre ray meets a wall along the line of sight, yet its samples show at steps in depth. */
		if (m->distance[at] > WALL_SPACINGS)
			m->distance[at] = truth_distance(m->truth, point, m->distance[at] * m->spacing) / m->spacing;
		count->n_compared++;
	}
}

static void measure_row(int y, void *userdata)
{
	const struct measure *m = userdata;
	memset(&m->row[y], 0, sizeof m->row[y]);
	for (uint32_t x = 0; x < m->width; x++)
		measure_pixel(m, x, (uint32_t)y, &m->row[y]);
}

static void add_up(struct psr_accuracy *out, const struct measure *m)
{
	uint64_t n = 0;
	memset(out, 0, sizeof *out);
	for (uint32_t y = 0; y < m->height; y++) {
		out->n_truth += m->row[y].n_truth;
		out->n_inside += m->row[y].n_inside;
		out->n_outside_drawn += m->row[y].n_outside_drawn;
		out->n_inside_empty += m->row[y].n_inside_empty;
		out->n_holes += m->row[y].n_holes;
		out->n_compared += m->row[y].n_compared;
	}
	for (size_t i = 0; i < (size_t)m->width * m->height; i++)
		if (m->distance[i] >= 0)
			m->distance[n++] = m->distance[i];
	stats_sort(m->distance, n);
	out->distance_p50 = stats_percentile(m->distance, n, 0.5);
	out->distance_p99 = stats_percentile(m->distance, n, 0.99);
	out->distance_p999 = stats_percentile(m->distance, n, 0.999);
	out->distance_max = stats_percentile(m->distance, n, 1);
}

static int measure(struct psr_accuracy *out, struct measure *m, const struct psr_truth_shot *shot,
                   struct psr_error *err)
{
	size_t n = (size_t)m->width * m->height;
	struct psr_pool *pool;
	int rc;
	m->truth_depth = psr_alloc_array(n, sizeof *m->truth_depth);
	m->truth_normal = psr_alloc_array(n, sizeof *m->truth_normal);
	m->distance = psr_alloc_array(n, sizeof *m->distance);
	m->row = psr_alloc_array(m->height, sizeof *m->row);
	if (m->truth_depth == NULL || m->truth_normal == NULL || m->distance == NULL || m->row == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to measure %ux%u pixels", m->width, m->height);
	rc = psr_truth_draw(shot, 1, m->truth_depth, m->truth_normal, NULL, err);
	if (rc != PSR_OK)
		return rc;
	rc = psr_pool_create(&pool, shot->n_threads, NULL);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "cannot start %d threads", shot->n_threads);
	psr_pool_for(pool, (int)m->height, measure_row, m);
	psr_pool_destroy(pool);
	add_up(out, m);
	return PSR_OK;
}

int psr_accuracy_measure(struct psr_accuracy *out, const struct psr_truth_shot *shot, const float *depth,
                         double spacing, struct psr_error *err)
{
	struct measure m = { .truth = shot->truth, .spacing = spacing, .width = shot->width, .height = shot->height,
		                 .depth = depth };
	int rc = view_init(&m.view, shot->camera, shot->width, shot->height, err);
	if (rc != PSR_OK)
		return rc;
	if (!(spacing > 0 && isfinite(spacing)))
		return psr_fail(err, PSR_ERR_ARG, "a sample spacing of %g is not a positive length", spacing);
	rc = measure(out, &m, shot, err);
	psr_free(m.truth_depth);
	psr_free(m.truth_normal);
	psr_free(m.distance);
	psr_free(m.row);
	return rc;
}
