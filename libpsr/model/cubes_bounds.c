/* Bounds of runs of cubes, so that a frame leaves 64 of them out at once, and of bunches of clusters, so that it
 * chooses the level of 64 at once. */
#include <math.h>
#include "cubes_make.h"

#define LEAST_COSINE 0.05 /* as of cubes' own cones */

static void bound_sphere(struct psr_cube_bound *bound, const struct psr_cubes *cubes,
                         const struct psr_cube_level *level, uint32_t first, uint32_t end)
{
	double low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY }, square = 0;

	for (uint32_t i = first; i < end; i++) {
		double center[3];

		psr_cubes_center(cubes, level, i, center);
		for (int a = 0; a < 3; a++) {
			low[a] = fmin(low[a], center[a]);
			high[a] = fmax(high[a], center[a]);
		}
	}
	for (int a = 0; a < 3; a++) {
		bound->center[a] = (float)((low[a] + high[a]) / 2);
		const double reach = fmax(high[a] - (double)bound->center[a], (double)bound->center[a] - low[a]);
		square += reach * reach;
	}
	bound->radius = (float)((sqrt(square) + CUBES_RADIUS * level->edge) * (1 + 1e-6));
}

static void axis_of(double axis[3], const struct psr_blocks *b, uint32_t i)
{
	const double x = b->cone_x[i], y = b->cone_y[i], z = b->cone_z[i], length = sqrt(x * x + y * y + z * z);

	axis[0] = x / length;
	axis[1] = y / length;
	axis[2] = z / length;
}

/* Of directions at an angle from the axis, each with a cone around it: the angles add up. */
static void bound_cone(struct psr_cube_bound *bound, const struct psr_blocks *b, uint32_t first, uint32_t end)
{
	double sum[3] = { 0, 0, 0 }, axis[3], own[3], most = 0, length = 0, least = 1;

	for (uint32_t i = first; i < end; i++) {
		if (b->cone_sine[i] == PSR_CONE_ANY)
			return;
		axis_of(own, b, i);
		for (int a = 0; a < 3; a++)
			sum[a] += own[a];
	}
	for (int a = 0; a < 3; a++)
		most = fmax(most, fabs(sum[a]));
	for (int a = 0; a < 3; a++) {
		axis[a] = most > 1e-9 ? floor(sum[a] / most * 127 + 0.5) : 0;
		length += axis[a] * axis[a];
	}
	if (length < 1)
		return;
	for (uint32_t i = first; i < end; i++) {
		const double sine = b->cone_sine[i] / 255.0;

		axis_of(own, b, i);
		const double cosine = fmin((axis[0] * own[0] + axis[1] * own[1] + axis[2] * own[2]) / sqrt(length), 1);
		least = fmin(least, cosine * sqrt(1 - sine * sine) - sqrt(1 - cosine * cosine) * sine);
	}
	const double sine = ceil(sqrt(1 - least * least) * 255 + 1e-3);
	if (!(least >= LEAST_COSINE && sine < PSR_CONE_ANY))
		return;
	for (int a = 0; a < 3; a++)
		bound->axis[a] = (int8_t)axis[a];
	bound->sine = (uint8_t)sine;
}

static void bound_bunch(const struct cubes_making *m, uint64_t bunch)
{
	const uint64_t n_groups = m->tree->n_skips, first = bunch * CUBES_BUNCH;
	const uint64_t end = n_groups - first < CUBES_BUNCH ? n_groups : first + CUBES_BUNCH;
	struct psr_cube_bunch *to = &m->bunch[bunch];
	double low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY }, radius = 0;

	for (uint64_t i = first; i < end; i++)
		for (int a = 0; a < 3; a++) {
			low[a] = fmin(low[a], (double)m->cluster[i].center[a]);
			high[a] = fmax(high[a], (double)m->cluster[i].center[a]);
		}
	for (int a = 0; a < 3; a++)
		to->center[a] = (float)((low[a] + high[a]) / 2);
	for (int l = 0; l < m->n_levels; l++)
		for (uint64_t i = first; i < end; i++) {
			const struct psr_cluster *k = &m->cluster[(uint64_t)l * n_groups + i];
			double square = 0;

			for (int a = 0; a < 3; a++) {
				const double off = (double)k->center[a] - (double)to->center[a];

				square += off * off;
			}
			radius = fmax(radius, sqrt(square) + (double)k->radius);
		}
	to->radius = (float)(radius * (1 + 1e-6));
}

void cubes_bound_task(int task, void *userdata)
{
	const struct cubes_making *m = userdata;
	const uint64_t bunches = cubes_n_bunches(m->tree), end_bunch = bunches * ((uint64_t)task + 1) / OCTREE_TASKS;

	for (uint64_t i = bunches * (uint64_t)task / OCTREE_TASKS; i < end_bunch; i++)
		bound_bunch(m, i);
	for (int l = 0; l < m->n_levels; l++) {
		const struct psr_cube_level *level = &m->cubes->level[l];
		const uint64_t runs = cubes_n_runs(level), last = runs * ((uint64_t)task + 1) / OCTREE_TASKS;

		for (uint64_t r = runs * (uint64_t)task / OCTREE_TASKS; r < last; r++) {
			const uint32_t in_level = (uint32_t)r * CUBES_RUN, left = level->n - in_level;
			const uint32_t first = level->first + in_level, end = first + (left < CUBES_RUN ? left : CUBES_RUN);

			struct psr_cube_bound *bound = &m->bound[l][r];

			*bound = (struct psr_cube_bound){ .sine = PSR_CONE_ANY };
			bound_sphere(bound, m->cubes, level, first, end);
			if (m->sine != NULL)
				bound_cone(bound, &m->cubes->groups, first, end);
		}
	}
}
