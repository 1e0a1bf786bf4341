#include "triangles.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <BRepAdaptor_Surface.hxx>
#include <BRep_Tool.hxx>
#include <Poly_Triangulation.hxx>
#include <gp_Pnt2d.hxx>

namespace {

constexpr double SAME_NORMAL = 0.99996; // cosine of half a degree
constexpr double NUDGE = 1e-3; // from a pole towards the middle of its triangles

bool normal_at(cad_vertex &vertex, const BRepAdaptor_Surface &surface, const gp_Pnt2d &uv, bool is_turned)
{
	gp_Pnt at;
	gp_Vec u, v;
	surface.D1(uv.X(), uv.Y(), at, u, v);
	const gp_Vec n = is_turned ? v.Crossed(u) : u.Crossed(v);
	const double lengths = u.Magnitude() * v.Magnitude();
	if (!(n.Magnitude() > 1e-9 * lengths) || !std::isfinite(lengths))
		return false;
	for (int k = 0; k < 3; k++)
		vertex.normal[k] = static_cast<float>(n.Coord(k + 1) / n.Magnitude());
	return true;
}

bool has_area(const Poly_Triangulation &mesh, int t)
{
	int corner[3];
	mesh.Triangle(t).Get(corner[0], corner[1], corner[2]);
	const gp_Vec a(mesh.Node(corner[0]), mesh.Node(corner[1])), b(mesh.Node(corner[0]), mesh.Node(corner[2]));
	return !(a.Crossed(b).Magnitude() <= 0); // one that is not finite is told elsewhere
}

double dot(const std::array<float, 3> &a, const std::array<float, 3> &b)
{
	return static_cast<double>(a[0]) * b[0] + static_cast<double>(a[1]) * b[1] + static_cast<double>(a[2]) * b[2];
}

} // namespace

bool cad_triangles::add(const TopoDS_Face &face, uint32_t color)
{
	TopLoc_Location location;
	const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
	int first_there = 1;
	while (!mesh.IsNull() && first_there <= mesh->NbTriangles() && !has_area(*mesh, first_there))
		first_there++;
	if (mesh.IsNull() || first_there > mesh->NbTriangles())
		return false;
	if (static_cast<uint64_t>(mesh->NbTriangles()) + triangle.size() > max_triangles)
		throw cad_failure(PSR_ERR_LIMIT, "more than " + std::to_string(max_triangles) + " triangles");
	const bool is_turned = face.Orientation() == TopAbs_REVERSED;
	const bool is_mirrored = location.Transformation().IsNegative();
	const BRepAdaptor_Surface surface(face, Standard_False);
	const uint32_t first = static_cast<uint32_t>(vertex.size());
	const int n = mesh->NbNodes();
	std::vector<gp_Pnt2d> middle(n + 1, gp_Pnt2d(0, 0));
	std::vector<int> uses(n + 1, 0);
	for (int t = 1; t <= mesh->NbTriangles(); t++) {
		int corner[3];
		mesh->Triangle(t).Get(corner[0], corner[1], corner[2]);
		if (is_turned != is_mirrored)
			std::swap(corner[1], corner[2]);
		triangle.push_back({ first + corner[0] - 1, first + corner[1] - 1, first + corner[2] - 1 });
		color_of.push_back(color);
		for (int i = 0; i < 3 && mesh->HasUVNodes(); i++)
			for (int j = 0; j < 3; j++) {
				middle[corner[i]].ChangeCoord() += mesh->UVNode(corner[j]).Coord() / 3;
				uses[corner[i]] += j == 0;
			}
	}
	for (int i = 1; i <= n; i++) {
		const gp_Pnt at = mesh->Node(i).Transformed(location.Transformation());
		cad_vertex v = { { at.X(), at.Y(), at.Z() }, { 0, 0, 0 } };
		const bool is_there = mesh->HasUVNodes() && normal_at(v, surface, mesh->UVNode(i), is_turned);
		if (!is_there && uses[i] > 0) {
			const gp_XY away = middle[i].Coord() / uses[i] - mesh->UVNode(i).Coord();
			normal_at(v, surface, gp_Pnt2d(mesh->UVNode(i).Coord() + NUDGE * away), is_turned);
		}
		vertex.push_back(v);
	}
	return true;
}

void cad_triangles::join()
{
	std::vector<uint32_t> order(vertex.size());
	std::iota(order.begin(), order.end(), 0u);
	std::sort(order.begin(), order.end(), [this](uint32_t a, uint32_t b) {
		return vertex[a].at != vertex[b].at ? vertex[a].at < vertex[b].at : a < b;
	});
	for (size_t begin = 0, end; begin < order.size(); begin = end) {
		for (end = begin + 1; end < order.size() && vertex[order[end]].at == vertex[order[begin]].at; end++) {
			cad_vertex &here = vertex[order[end]];
			for (size_t i = begin; i < end; i++) {
				const cad_vertex &other = vertex[order[i]];
				if (dot(here.normal, other.normal) < SAME_NORMAL)
					continue;
				here.normal = other.normal;
				break;
			}
		}
	}
}
