#include <cmath>
#include <cstring>
#include "gltf.h"

namespace gltf {

namespace {

/* A transform, and the matrix of normals: the inverse transpose, which is the cofactors over the determinant; only the
 * determinant's sign matters. */
struct motion {
	double m[16], cofactor[9], sign;
};

motion motion_of(const transform &t)
{
	const double *m = t.m;
	double determinant, largest = 0.0;
	motion f = { {}, { m[5] * m[10] - m[6] * m[9], m[6] * m[8] - m[4] * m[10], m[4] * m[9] - m[5] * m[8],
		          m[9] * m[2] - m[10] * m[1], m[10] * m[0] - m[8] * m[2], m[8] * m[1] - m[9] * m[0],
		          m[1] * m[6] - m[2] * m[5], m[2] * m[4] - m[0] * m[6], m[0] * m[5] - m[1] * m[4] }, 1.0 };
	std::memcpy(f.m, m, sizeof f.m);
	determinant = m[0] * f.cofactor[0] + m[1] * f.cofactor[1] + m[2] * f.cofactor[2];
	f.sign = determinant < 0.0 ? -1.0 : 1.0;
	for (double c : f.cofactor)
		largest = std::fmax(largest, std::fabs(c));
	for (double &c : f.cofactor)
		c = largest > 0.0 ? f.sign * c / largest : 0.0;
	return f;
}

void put_position(double out[3], const motion &f, const float *p)
{
	for (int row = 0; row < 3; row++)
		out[row] = f.m[row] * p[0] + f.m[4 + row] * p[1] + f.m[8 + row] * p[2] + f.m[12 + row];
}

void put_normal(float out[3], const motion &f, const float *n)
{
	for (int row = 0; row < 3; row++)
		out[row] = (float)(f.cofactor[row] * n[0] + f.cofactor[3 + row] * n[1] + f.cofactor[6 + row] * n[2]);
}

/* A mirror reverses the handedness: it mirrors tangent and bitangent, but the normal stays on the face's front. */
void put_tangent(float out[4], const motion &f, const float *t)
{
	double largest = 0.0, x[3];
	for (int row = 0; row < 3; row++) {
		x[row] = f.m[row] * t[0] + f.m[4 + row] * t[1] + f.m[8 + row] * t[2];
		largest = std::fmax(largest, std::fabs(x[row]));
	}
	for (int row = 0; row < 3; row++)
		out[row] = largest > 0.0 ? (float)(x[row] / largest) : 0.0f;
	out[3] = (float)f.sign * t[3];
}

/* Returns true if most vertices are mirrored. */
bool add_vertices(reader &r, const primitive &p, const motion &rigid, const std::vector<transform> *joints,
                  const std::string &place)
{
	struct psr_mesh *mesh = r.im.mesh;
	const size_t first = mesh->n_vertices - p.n_vertices();
	size_t n_mirrored = 0;
	for (size_t i = 0; i < p.n_vertices(); i++) {
		const motion f = joints == nullptr ? rigid : motion_of(blend(p, *joints, i, place));
		n_mirrored += f.sign < 0.0;
		put_position(mesh->position[first + i], f, &p.position[3 * i]);
		if (!p.normal.empty())
			put_normal(mesh->normal[first + i], f, &p.normal[3 * i]);
		if (!p.tangent.empty())
			put_tangent(mesh->tangent[first + i], f, &p.tangent[4 * i]);
	}
	for (int set = 0; set < PSR_UV_SETS; set++)
		if (!p.uv[set].empty())
			std::memcpy(mesh->uv[set] + first, p.uv[set].data(), p.uv[set].size() * sizeof(float));
	if (!p.color.empty())
		std::memcpy(mesh->color + first, p.color.data(), p.color.size() * sizeof(float));
	return n_mirrored > p.n_vertices() / 2;
}

void add_triangles(reader &r, const primitive &p, const material_use &use, const motion &rigid,
                   const std::vector<transform> *joints, const std::string &place)
{
	struct psr_mesh *mesh = r.im.mesh;
	struct psr_error error = {};
	const uint32_t first_v = mesh->n_vertices, first_t = mesh->n_triangles;
	unsigned has = (p.color.empty() ? 0 : IMPORT_HAS_COLOR) | (p.tangent.empty() ? 0 : IMPORT_HAS_TANGENT);
	for (unsigned set = 0; set < PSR_UV_SETS; set++)
		has |= p.uv[set].empty() ? 0 : (unsigned)IMPORT_HAS_UV0 << set;
	if (import_mesh_grow(&r.im, p.n_vertices(), p.triangle.size() / 3, has, &error) != PSR_OK)
		throw reported{ error };

	const bool is_mirrored = add_vertices(r, p, rigid, joints, place);

	for (size_t t = 0; t < p.triangle.size() / 3; t++) {
		uint32_t *v = mesh->triangle[first_t + t];
		v[0] = first_v + p.triangle[3 * t];
		v[1] = first_v + p.triangle[3 * t + (is_mirrored ? 2 : 1)];
		v[2] = first_v + p.triangle[3 * t + (is_mirrored ? 1 : 2)];
		mesh->triangle_material[first_t + t] = (uint32_t)use.index;
	}
}

void add_points(reader &r, const primitive &p, const material_use &use, const motion &rigid,
                const std::vector<transform> *joints, const std::string &place)
{
	struct psr_mesh *mesh = r.im.mesh;
	struct psr_error error = {};
	const size_t first = mesh->n_points;
	if (import_mesh_grow_points(&r.im, p.point.size(), !p.color.empty(), &error) != PSR_OK)
		throw reported{ error };
	for (size_t i = 0; i < p.point.size(); i++) {
		const size_t v = p.point[i];
		const motion f = joints == nullptr ? rigid : motion_of(blend(p, *joints, v, place));
		put_position(mesh->point[first + i], f, &p.position[3 * v]);
		if (!p.normal.empty())
			put_normal(mesh->point_normal[first + i], f, &p.normal[3 * v]);
		if (!p.color.empty())
			std::memcpy(mesh->point_color[first + i], &p.color[4 * v], sizeof mesh->point_color[0]);
		mesh->point_material[first + i] = (uint32_t)use.point_index;
	}
}

} // namespace

void add_instance(reader &r, const primitive &p, const material_use &use, const transform &world,
                  const std::vector<transform> *joints, const std::string &place)
{
	const motion rigid = motion_of(world);
	if (!p.triangle.empty())
		add_triangles(r, p, use, rigid, joints, place);
	if (!p.point.empty())
		add_points(r, p, use, rigid, joints, place);
}

} // namespace gltf
