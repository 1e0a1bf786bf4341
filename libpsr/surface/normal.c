#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "normal.h"

int normal_plane(const struct psr_mesh *mesh, uint32_t triangle, struct plane *plane)
{
	const uint32_t *index = mesh->triangle[triangle];
	double e[2][3];

	memset(plane, 0, sizeof *plane);
	for (int i = 0; i < 2; i++)
		v3d_sub(e[i], mesh->position[index[i + 1]], mesh->position[index[0]]);
	plane->x[0] = v3d_normalize(plane->axis[0], e[0]);
	v3d_cross(plane->axis[2], plane->axis[0], e[1]);
	plane->y[1] = v3d_normalize(plane->axis[2], plane->axis[2]);
	if (!(plane->x[0] > 0 && plane->y[1] > 0)) {
		v3d_set(plane->axis[2], 0, 0, 0);
		return 0;
	}
	plane->x[1] = v3d_dot(plane->axis[0], e[1]);
	v3d_cross(plane->axis[1], plane->axis[2], plane->axis[0]);
	return 1;
}

void normal_jacobian(const struct plane *plane, const double side[2][2], double jacobian[2][2])
{
	for (int k = 0; k < 2; k++) {
		jacobian[k][0] = side[0][k] / plane->x[0];
		jacobian[k][1] = (side[1][k] - jacobian[k][0] * plane->x[1]) / plane->y[1];
	}
}

/* Interpolates the vertices' normals; 0 if there are none. */
static int interpolate(const struct psr_mesh *mesh, uint32_t triangle, double u, double v, float normal[3])
{
	const uint32_t *index = mesh->triangle[triangle];
	const float weight[3] = { (float)(1 - u - v), (float)u, (float)v };

	v3f_set(normal, 0, 0, 0);
	for (int i = 0; i < 3; i++)
		v3f_add_scaled(normal, normal, weight[i], mesh->normal[index[i]]);
	return v3f_normalize(normal, normal) > 0;
}

static void face_normal(const struct psr_mesh *mesh, uint32_t triangle, float normal[3])
{
	const uint32_t *index = mesh->triangle[triangle];
	double e1[3], e2[3], n[3];

	v3d_sub(e1, mesh->position[index[1]], mesh->position[index[0]]);
	v3d_sub(e2, mesh->position[index[2]], mesh->position[index[0]]);
	v3d_cross(n, e1, e2);
	if (v3d_normalize(n, n) == 0)
		v3d_set(n, 0, 0, 0);
	v3f_set(normal, (float)n[0], (float)n[1], (float)n[2]);
}

void normal_interpolate(const struct psr_mesh *mesh, uint32_t triangle, double u, double v, float normal[3])
{
	float face[3];

	face_normal(mesh, triangle, face);
	if (!interpolate(mesh, triangle, u, v, normal))
		v3f_set(normal, face[0], face[1], face[2]);
	else if (v3f_dot(normal, face) < 0)
		v3f_scale(normal, normal, -1);
	if (v3f_dot(normal, normal) == 0)
		v3f_set(normal, 0, 0, 1);
}

/* Finds the mesh's tangent at a place, and on which side of the vertices' own normal the bitangent lies; 0 if the mesh
 * has none. */
static float given_tangent(const struct psr_mesh *mesh, uint32_t triangle, double u, double v, float tangent[3])
{
	const uint32_t *index = mesh->triangle[triangle];
	const float weight[3] = { (float)(1 - u - v), (float)u, (float)v };

	v3f_set(tangent, 0, 0, 0);
	if (mesh->tangent == NULL)
		return 0;
	for (int i = 0; i < 3; i++)
		v3f_add_scaled(tangent, tangent, weight[i], mesh->tangent[index[i]]);
	return v3f_dot(tangent, tangent) > 0 ? mesh->tangent[index[0]][3] : 0;
}

/* Finds the direction in which s grows and t does not, and the side on which t falls. */
static float made_tangent(const struct plane *plane, const double jacobian[2][2], float tangent[3])
{
	double det = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0];
	double sign = det > 0 ? 1 : -1, x = jacobian[1][1], y = -jacobian[1][0], length = sign * sqrt(x * x + y * y);

	if (!(det < 0 || det > 0) || !(fabs(length) > 0 && fabs(length) < INFINITY))
		return 0;
	for (int k = 0; k < 3; k++)
		tangent[k] = (float)(x / length * plane->axis[0][k] + y / length * plane->axis[1][k]);
	return (float)-sign;
}

void normal_map(const struct psr_mesh *mesh, const struct surface_place *place, const struct plane *plane,
                const double jacobian[2][2], const float mapped[3], float normal[3])
{
	float tangent[3], bitangent[3], own[3], out[3];
	float side = given_tangent(mesh, place->prim, place->u, place->v, tangent);

	if (side == 0) {
		side = made_tangent(plane, jacobian, tangent);
	} else if (interpolate(mesh, place->prim, place->u, place->v, own) && v3f_dot(own, normal) < 0) {
		side = -side;
	}
	v3f_add_scaled(tangent, tangent, -v3f_dot(tangent, normal), normal);
	if (side == 0 || v3f_normalize(tangent, tangent) == 0)
		return;
	v3f_cross(bitangent, normal, tangent);
	v3f_scale(out, normal, mapped[2]);
	v3f_add_scaled(out, out, mapped[0], tangent);
	v3f_add_scaled(out, out, mapped[1] * side, bitangent);
	if (v3f_normalize(out, out) > 0)
		v3f_set(normal, out[0], out[1], out[2]);
}
