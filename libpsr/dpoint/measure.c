#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "cell_tree.h"

struct sums {
	struct dpoint_errors *errors;
	double normal2, height2;
	uint64_t n;
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
	sums->errors->normal_worst = fmax(sums->errors->normal_worst, angle);
	sums->errors->height_worst = fmax(sums->errors->height_worst, height);
}

void dpoint_measure(struct dpoint_errors *errors, const struct dpoint_surface *surface,
                    const struct dpoint_cover *cover, const struct dpoint_choice *choice)
{
	struct sums sums = { .errors = errors };

	memset(errors, 0, sizeof *errors);
	for (uint32_t i = 0; i < cover->n_candidates; i++) {
		for (uint32_t k = 0; k < cover->n[i] && choice->is_kept[i]; k++) {
			const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

			for (uint32_t e = node->begin; e < node->end; e++)
				add(&sums, &surface->candidate[i].point, &surface->cell[cover->tree->order[e]]);
		}
	}
	if (sums.n == 0)
		return;
	errors->normal_rms = sqrt(sums.normal2 / (double)sums.n);
	errors->height_rms = sqrt(sums.height2 / (double)sums.n);
	errors->overlap = (double)sums.n / (double)(cover->n_cells - choice->n_holes);
}
