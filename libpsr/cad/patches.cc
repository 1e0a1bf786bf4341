#include "patches.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <BRep_Tool.hxx>
#include <Poly_Triangulation.hxx>
#include <Standard_Failure.hxx>
#include <gp_Pnt2d.hxx>
#include "nurbs.h"

namespace {

double turn_of(const cad_patch &p, const std::array<uint32_t, 3> &t)
{
	const auto &a = p.corner[t[0]], &b = p.corner[t[1]], &c = p.corner[t[2]];
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Corners of the face's triangulation in parameters of the NURBS. Returns false where these are not of the same places.
bool take_corners(cad_patch &p, const Poly_Triangulation &mesh, const Geom_Surface &surface,
                  const Geom_BSplineSurface &nurbs, const double from[2][2], double tolerance)
{
	std::map<double, double> found[2];
	for (int i = 1; i <= mesh.NbNodes(); i++) {
		std::array<double, 2> uv;
		for (int k = 0; k < 2; k++) {
			const double x = mesh.UVNode(i).Coord(k + 1);
			const auto known = found[k].find(x);
			uv[k] = known != found[k].end() ? known->second
			                                : found[k][x] = cad_nurbs_parameter(x, k, surface, nurbs, from);
		}
		const gp_Pnt there = surface.Value(mesh.UVNode(i).X(), mesh.UVNode(i).Y());
		if (!(there.Distance(nurbs.Value(uv[0], uv[1])) <= tolerance))
			return false;
		p.corner.push_back(uv);
	}
	return true;
}

void take_surface(cad_patch &p, const Geom_BSplineSurface &nurbs)
{
	p.degree[0] = nurbs.UDegree();
	p.degree[1] = nurbs.VDegree();
	p.n = { static_cast<uint32_t>(nurbs.NbUPoles()), static_cast<uint32_t>(nurbs.NbVPoles()) };
	for (int i = nurbs.UKnotSequence().Lower(); i <= nurbs.UKnotSequence().Upper(); i++)
		p.knot[0].push_back(nurbs.UKnotSequence().Value(i));
	for (int i = nurbs.VKnotSequence().Lower(); i <= nurbs.VKnotSequence().Upper(); i++)
		p.knot[1].push_back(nurbs.VKnotSequence().Value(i));
	for (int i = 1; i <= nurbs.NbUPoles(); i++)
		for (int j = 1; j <= nurbs.NbVPoles(); j++) {
			const gp_Pnt at = nurbs.Pole(i, j);
			p.control.push_back({ at.X(), at.Y(), at.Z(), nurbs.Weight(i, j) });
		}
}

bool convert(cad_patch &p, const TopoDS_Face &face, int most_degree, double tolerance)
{
	TopLoc_Location location, ignored;
	double from[2][2] = { { HUGE_VAL, -HUGE_VAL }, { HUGE_VAL, -HUGE_VAL } };
	const Handle(Geom_Surface) surface = BRep_Tool::Surface(face, location);
	const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, ignored);
	if (surface.IsNull() || !mesh->HasUVNodes())
		return false;
	for (int i = 1; i <= mesh->NbNodes(); i++)
		for (int k = 0; k < 2; k++) {
			from[k][0] = std::min(from[k][0], mesh->UVNode(i).Coord(k + 1));
			from[k][1] = std::max(from[k][1], mesh->UVNode(i).Coord(k + 1));
		}
	const Handle(Geom_BSplineSurface) nurbs = cad_nurbs(surface, from);
	if (nurbs->UDegree() > most_degree || nurbs->VDegree() > most_degree ||
	    !take_corners(p, *mesh, *surface, *nurbs, from, tolerance))
		return false;
	// Triangles are counter-clockwise from the outside; so is the surface, once they are in its parameters.
	double turn = 0;
	for (const auto &t : p.triangle)
		turn += turn_of(p, t);
	nurbs->Transform(location.Transformation());
	if (turn < 0) {
		nurbs->ExchangeUV();
		for (auto &uv : p.corner)
			std::swap(uv[0], uv[1]);
	}
	for (auto &t : p.triangle)
		if (turn_of(p, t) < 0)
			std::swap(t[1], t[2]);
	take_surface(p, *nurbs);
	return true;
}

// Sides that one triangle has.
std::vector<std::pair<uint32_t, int>> find_rims(const std::vector<std::array<uint32_t, 3>> &triangle)
{
	struct side {
		uint32_t low, high, triangle;
		int i;
	};
	std::vector<side> sides;
	std::vector<std::pair<uint32_t, int>> rims;
	for (uint32_t t = 0; t < triangle.size(); t++)
		for (int i = 0; i < 3; i++) {
			const uint32_t a = triangle[t][i], b = triangle[t][(i + 1) % 3];
			sides.push_back({ std::min(a, b), std::max(a, b), t, i });
		}
	const auto is_same = [](const side &a, const side &b) { return a.low == b.low && a.high == b.high; };
	std::sort(sides.begin(), sides.end(), [](const side &a, const side &b) {
		return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
	});
	for (size_t i = 0; i < sides.size(); i++)
		if ((i == 0 || !is_same(sides[i - 1], sides[i])) && (i + 1 == sides.size() || !is_same(sides[i], sides[i + 1])))
			rims.push_back({ sides[i].triangle, sides[i].i });
	return rims;
}

} // namespace

void cad_patches::add(const cad_triangles &triangles, const TopoDS_Face &face, uint32_t color, size_t first_triangle,
                      size_t first_vertex)
{
	cad_patch p;
	bool is_like = false;
	p.color = color;
	p.first_vertex = static_cast<uint32_t>(first_vertex);
	for (size_t t = first_triangle; t < triangles.triangle.size(); t++) {
		p.triangle.push_back(triangles.triangle[t]);
		for (uint32_t &corner : p.triangle.back())
			corner -= p.first_vertex;
	}
	try {
		is_like = convert(p, face, most_degree, tolerance);
	} catch (const Standard_Failure &) { // of this surface alone
	}
	const uint32_t number = is_like ? static_cast<uint32_t>(patch.size()) : UINT32_MAX;
	p.rim.assign(p.triangle.size(), 0);
	for (const auto &[t, side] : find_rims(p.triangle)) {
		p.rim[t] |= static_cast<uint8_t>(1 << side);
		rim.push_back({ { p.first_vertex + p.triangle[t][side], p.first_vertex + p.triangle[t][(side + 1) % 3] },
		                number, t, side });
	}
	patch_of.resize(triangles.triangle.size(), number);
	n_unlike += !is_like;
	if (is_like)
		patch.push_back(std::move(p));
}

void cad_patches::find_ends(const cad_triangles &triangles)
{
	using corner = std::pair<std::array<double, 3>, std::array<float, 3>>;
	const auto key_of = [&triangles](const cad_rim &r) {
		const cad_vertex &a = triangles.vertex[r.vertex[0]], &b = triangles.vertex[r.vertex[1]];
		const corner x = { a.at, a.normal }, y = { b.at, b.normal };
		return x < y ? std::make_pair(x, y) : std::make_pair(y, x);
	};
	std::map<std::pair<corner, corner>, int> uses;
	for (const cad_rim &r : rim)
		uses[key_of(r)]++;
	for (const cad_rim &r : rim)
		if (r.patch != UINT32_MAX && uses[key_of(r)] < 2)
			patch[r.patch].rim[r.triangle] |= static_cast<uint8_t>(8 << r.side);
}
