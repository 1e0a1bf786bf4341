#include "nurbs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>
#include <GeomConvert.hxx>
#include <Geom_ConicalSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Geom_ToroidalSurface.hxx>
#include <Standard_DomainError.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_Array2OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>

namespace {

constexpr int STEPS = 50; // of Newton's method

// A plane curve: a line, or rational arcs of a right angle at most.
struct curve {
	int degree;
	std::vector<std::array<double, 3>> pole; // x, y, weight
	std::vector<double> knot;                // each of multiplicity degree, the first and the last of one more
};

curve line(double x0, double y0, double x1, double y1, const double from[2])
{
	return { 1, { { x0, y0, 1 }, { x1, y1, 1 } }, { from[0], from[1] } };
}

curve arcs(double middle_x, double radius, const double from[2])
{
	const int n = std::max(1, static_cast<int>(std::ceil((from[1] - from[0]) / (M_PI / 2) - 1e-9)));
	const double half = (from[1] - from[0]) / n / 2;
	curve c = { 2, {}, {} };
	for (int i = 0; i <= 2 * n; i++) {
		const double angle = from[0] + i * half, weight = i % 2 == 1 ? std::cos(half) : 1;
		c.pole.push_back({ middle_x + radius * std::cos(angle) / weight, radius * std::sin(angle) / weight, weight });
		if (i % 2 == 0)
			c.knot.push_back(i < 2 * n ? angle : from[1]);
	}
	return c;
}

// A curve of distances from an axis and of heights along it, turned around it.
Handle(Geom_BSplineSurface) turned(const gp_Ax3 &axis, const curve &u, const curve &v)
{
	TColgp_Array2OfPnt pole(1, u.pole.size(), 1, v.pole.size());
	TColStd_Array2OfReal weight(1, u.pole.size(), 1, v.pole.size());
	TColStd_Array1OfReal u_knot(1, u.knot.size()), v_knot(1, v.knot.size());
	TColStd_Array1OfInteger u_times(1, u.knot.size()), v_times(1, v.knot.size());
	for (size_t i = 0; i < u.pole.size(); i++)
		for (size_t j = 0; j < v.pole.size(); j++) {
			const gp_XYZ away = axis.XDirection().XYZ() * (u.pole[i][0] * v.pole[j][0]) +
			                    axis.YDirection().XYZ() * (u.pole[i][1] * v.pole[j][0]) +
			                    axis.Direction().XYZ() * v.pole[j][1];
			pole(i + 1, j + 1) = gp_Pnt(axis.Location().XYZ() + away);
			weight(i + 1, j + 1) = u.pole[i][2] * v.pole[j][2];
		}
	for (size_t i = 1; i <= u.knot.size(); i++) {
		u_knot(i) = u.knot[i - 1];
		u_times(i) = u.degree + (i == 1 || i == u.knot.size());
	}
	for (size_t i = 1; i <= v.knot.size(); i++) {
		v_knot(i) = v.knot[i - 1];
		v_times(i) = v.degree + (i == 1 || i == v.knot.size());
	}
	return new Geom_BSplineSurface(pole, weight, u_knot, v_knot, u_times, v_times, u.degree, v.degree);
}

} // namespace

// Of bodies that are turned, by our own arcs: GeomConvert refuses spheres that end at a pole but for a rounding, and
// whole cones.
Handle(Geom_BSplineSurface) cad_nurbs(const Handle(Geom_Surface) &surface, const double from[2][2])
{
	Handle(Geom_Surface) basis = surface;
	const Handle(Geom_RectangularTrimmedSurface) trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface);
	if (!trimmed.IsNull())
		basis = trimmed->BasisSurface();
	const double *v = from[1];
	if (!(from[0][1] > from[0][0]) || !(from[1][1] > from[1][0]))
		throw Standard_DomainError("a surface without an extent");
	if (const auto s = Handle(Geom_CylindricalSurface)::DownCast(basis); !s.IsNull())
		return turned(s->Position(), arcs(0, 1, from[0]), line(s->Radius(), v[0], s->Radius(), v[1], v));
	if (const auto s = Handle(Geom_ConicalSurface)::DownCast(basis); !s.IsNull()) {
		const double out = std::sin(s->SemiAngle()), up = std::cos(s->SemiAngle()), r = s->RefRadius();
		return turned(s->Position(), arcs(0, 1, from[0]), line(r + v[0] * out, v[0] * up, r + v[1] * out, v[1] * up, v));
	}
	if (const auto s = Handle(Geom_SphericalSurface)::DownCast(basis); !s.IsNull())
		return turned(s->Position(), arcs(0, 1, from[0]), arcs(0, s->Radius(), v));
	if (const auto s = Handle(Geom_ToroidalSurface)::DownCast(basis); !s.IsNull())
		return turned(s->Position(), arcs(0, 1, from[0]), arcs(s->MajorRadius(), s->MinorRadius(), v));
	const Handle(Geom_BSplineSurface) nurbs = GeomConvert::SurfaceToBSplineSurface(
		new Geom_RectangularTrimmedSurface(basis, from[0][0], from[0][1], v[0], v[1]));
	if (nurbs->IsUPeriodic())
		nurbs->SetUNotPeriodic();
	if (nurbs->IsVPeriodic())
		nurbs->SetVNotPeriodic();
	return nurbs;
}

double cad_nurbs_parameter(double x, int axis, const Geom_Surface &surface, const Geom_BSplineSurface &nurbs,
                           const double from[2][2])
{
	const double middle_from = (from[1 - axis][0] + from[1 - axis][1]) / 2;
	const gp_Pnt wanted = axis == 0 ? surface.Value(x, middle_from) : surface.Value(middle_from, x);
	double to[2][2];
	nurbs.Bounds(to[0][0], to[0][1], to[1][0], to[1][1]);
	const double middle_to = (to[1 - axis][0] + to[1 - axis][1]) / 2, width = to[axis][1] - to[axis][0];
	double s = to[axis][0] + (x - from[axis][0]) / (from[axis][1] - from[axis][0]) * width;
	if (x <= from[axis][0] || x >= from[axis][1])
		return x <= from[axis][0] ? to[axis][0] : to[axis][1];
	for (int i = 0; i < STEPS; i++) {
		gp_Pnt at;
		gp_Vec d[2];
		nurbs.D1(axis == 0 ? s : middle_to, axis == 0 ? middle_to : s, at, d[0], d[1]);
		const double square = d[axis].SquareMagnitude();
		const double step = square > 0 ? gp_Vec(at, wanted).Dot(d[axis]) / square : 0;
		const double next = std::min(std::max(s + step, to[axis][0]), to[axis][1]);
		const bool is_there = std::abs(next - s) <= 1e-15 * width;
		s = next;
		if (is_there)
			break;
	}
	return s;
}
