#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "cell_tree.h"

#define CHUNK 1024 /* candidates */

struct sums {
	double normal2, height2, normal_worst, height_worst;
	uint64_t n;
};

struct measuring {
	const struct dpoint_surface *surface;
	const struct dpoint_cover *cover;
	const struct dpoint_choice *choice;
	struct sums *of_chunk;
};

/* The angle between vectors by its tangent's half, in double: exact for small ones, too. */
static double angle_between(const double a[3], const double b[3])
{
	double x[3], y[3], across[3], along[3];

	v3d_normalize(x, a);
	v3d_normalize(y, b);
	v3d_sub(across, x, y);
	v3d_add(along, x, y);
	return 2 * atan2(v3d_length(across), v3d_length(along));
}

static void add(struct sums *sums, const struct dpoint *p, const struct dpoint_cell *cell)
{
	double away[3] = { 0, 0, 0 }, normal[3], n[3], v[3], at[3], u[3], pn[3], angle, height;
	float local[3];

	for (int k = 0; k < 3; k++) {
		for (int c = 0; c < 4; c++)
			away[k] += 0.25 * cell->corner[c][k];
		away[k] -= p->at[k];
		normal[k] = cell->normal[k];
		u[k] = p->u[k];
		pn[k] = p->normal[k];
	}
	if (v3d_dot(normal, normal) == 0)
		return;
	v3d_cross(v, pn, u);
	v3d_set(at, v3d_dot(away, u), v3d_dot(away, v), v3d_dot(away, pn));
	dpoint_normal_at(local, p->lambda_u, p->rho, (float)at[0], (float)at[1]);
	for (int k = 0; k < 3; k++)
		n[k] = local[0] * u[k] + local[1] * v[k] + local[2] * pn[k];
	angle = angle_between(n, normal);
	height = fabs(at[2] - dpoint_height_at(p->lambda_u, p->rho, (float)at[0], (float)at[1]));
	sums->n++;
	sums->normal2 += angle * angle;
	sums->height2 += height * height;
	sums->normal_worst = fmax(sums->normal_worst, angle);
	sums->height_worst = fmax(sums->height_worst, height);
}

static void measure_chunk(int chunk, void *userdata)
{
	const struct measuring *m = userdata;
	const struct dpoint_cover *cover = m->cover;
	const size_t begin = (size_t)chunk * CHUNK;

	for (size_t i = begin; i < cover->n_candidates && i < begin + CHUNK; i++)
		for (uint32_t k = 0; k < cover->n[i] && m->choice->is_kept[i]; k++) {
			const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

			for (uint32_t e = node->begin; e < node->end; e++)
				add(&m->of_chunk[chunk], &m->surface->candidate[i].point, &m->surface->cell[cover->tree->order[e]]);
		}
}

int dpoint_measure(struct dpoint_errors *errors, const struct dpoint_surface *surface, const struct dpoint_cover *cover,
                   const struct dpoint_choice *choice, struct psr_pool *pool)
{
	const int n_chunks = (int)((cover->n_candidates + CHUNK - 1) / CHUNK);
	struct measuring m = { surface, cover, choice, calloc((size_t)n_chunks + 1, sizeof *m.of_chunk) };
	struct sums all = { 0 };

	memset(errors, 0, sizeof *errors);
	if (m.of_chunk == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(pool, n_chunks, measure_chunk, &m);
	for (int i = 0; i < n_chunks; i++) {
		const struct sums *sums = &m.of_chunk[i];

		all.n += sums->n;
		all.normal2 += sums->normal2;
		all.height2 += sums->height2;
		errors->normal_worst = fmax(errors->normal_worst, sums->normal_worst);
		errors->height_worst = fmax(errors->height_worst, sums->height_worst);
	}
	free(m.of_chunk);
	if (all.n == 0)
		return PSR_OK;
	errors->normal_rms = sqrt(all.normal2 / (double)all.n);
	errors->height_rms = sqrt(all.height2 / (double)all.n);
	errors->overlap = (double)all.n / (double)(cover->n_cells - choice->n_holes);
	return PSR_OK;
}
