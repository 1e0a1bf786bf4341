#include <string.h>
#include "base/direction.h"
#include "base/maths.h"
#include "base/vec.h"
#include "plan_warp.h"

void plan_lattice(struct warp_lattice *out, const struct psr_projection *projection, double to_camera[3][3],
                  const double center[3], const struct plan *plan, double focal)
{
	const double dx = projection->spacing, dy = dx * 0.86602540378443864676;
	const double half[3] = { plan->center[0], plan->center[1], 0 };
	double column[4][3]; /* in camera space: a unit of projection space's x, y, z, and its origin */
	double *to[4] = { out->step, out->down, out->along, out->origin };

	psr_placing_make(&out->placing, projection);
	for (int k = 0; k < 3; k++)
		m3d_apply(column[k], (const double(*)[3])to_camera,
		          (const double[3]){ projection->axis[k][0], projection->axis[k][1], projection->axis[k][2] });
	memcpy(column[3], center, sizeof column[3]);
	const double length[4] = { dx, dy, 1, 1 };
	for (int a = 0; a < 3; a++) {
		for (int k = 0; k < 4; k++) {
			const double sideways = (a < 2 ? focal : 1) * column[k][a];

			to[k][a] = length[k] * (sideways + (plan->perspective ? half[a] * column[k][2] : k == 3 ? half[a] : 0));
		}
		for (int i = 0; i < 8; i++) {
			out->row[a][i] = i * out->down[a] + (i & 1) * 0.5 * out->step[a];
			out->col[a][i] = (float)(i * out->step[a]);
		}
	}
}

/* What EWA splats need of the axes of cubes. */
static void plan_ewa(struct ewa_view *out, const double axis[3][3], double depth)
{
	double dual[3][3];

	for (int i = 0; i < 3; i++)
		v3d_cross(dual[i], axis[(i + 1) % 3], axis[(i + 2) % 3]);
	const double unit = 1 / v3d_dot(axis[0], dual[0]);
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			out->axis[i][k] = (float)axis[i][k];
			out->square[i][k] = (float)v3d_dot(axis[i], axis[k]);
			out->dual[i][k] = (float)(dual[i][k] * unit);
		}
	out->depth = (float)depth;
}

void plan_cubes(struct warp_cubes *out, double to_camera[3][3], const double center[3], const struct plan *plan,
                double focal)
{
	const double half[3] = { plan->center[0], plan->center[1], 0 };

	for (int a = 0; a < 3; a++) {
		for (int k = 0; k < 3; k++)
			out->axis[a][k] = (a < 2 ? focal : 1) * to_camera[a][k] + (plan->perspective ? half[a] * to_camera[2][k] : 0);
		out->origin[a] = (a < 2 ? focal : 1) * center[a] + (plan->perspective ? half[a] * center[2] : half[a]);
	}
	if (plan->with_ewa)
		plan_ewa(&out->ewa, (const double(*)[3])out->axis, v3d_length(to_camera[2]));
	for (uint32_t l = 0; l < out->model->groups.n_levels; l++) {
		struct warp_octants *to = &out->level[l];
		const double edge = out->model->level[l].edge, offset = edge * (CUBES_DIAGONAL / (2 * OCTREE_OFFSETS) / 511);

		for (int a = 0; a < 3; a++) {
			const double *axis = out->axis[a];

			for (int j = 0; j < 8; j++) {
				const double sum = ((j & 1 ? axis[0] : -axis[0]) + (j & 2 ? axis[1] : -axis[1]))
				                   + (j & 4 ? axis[2] : -axis[2]);

				to->row[a][j] = edge * sum;
				to->col[a][j] = (float)(0.5 * edge * sum);
			}
			for (int k = 0; k < 3; k++)
				to->along[a][k] = (float)(offset * axis[k]);
		}
	}
}

void plan_points(struct warp_points *out, double to_camera[3][3], double turn[3][3], const double center[3],
                 const struct plan *plan, double focal)
{
	const double scale = v3d_length(to_camera[0]);

	out->tables = dpoint_tables();
	out->graze = out->model->graze;
	out->direction = psr_direction_table();
	for (int a = 0; a < 3; a++) {
		out->origin[a] = (a < 2 ? focal : 1) * center[a];
		for (int k = 0; k < 3; k++)
			out->axis[a][k] = (a < 2 ? focal : 1) * to_camera[a][k];
	}
	for (int k = 0; k < 3; k++) {
		out->eye[k] = -(turn[0][k] * center[0] + turn[1][k] * center[1] + turn[2][k] * center[2]) / scale;
		out->right[k] = (float)(turn[0][k] / (focal * scale));
		out->down[k] = (float)(turn[1][k] / (focal * scale));
		out->forward[k] = (float)(turn[2][k] / scale);
	}
	out->center[0] = (float)plan->center[0];
	out->center[1] = (float)plan->center[1];
}

void plan_sight(struct warp_instance *out, double turn[3][3], const struct plan *plan, double focal)
{
	for (int k = 0; k < 3; k++) {
		const double across = turn[0][k] / focal, down = turn[1][k] / focal, forward = turn[2][k];

		out->du[k] = (float)(plan->perspective ? across : 0);
		out->dv[k] = (float)(plan->perspective ? down : 0);
		out->d0[k] = (float)(plan->perspective ? forward - across * plan->center[0] - down * plan->center[1] : forward);
	}
}
