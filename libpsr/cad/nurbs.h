// Surfaces of Open CASCADE as one NURBS each.
#ifndef PSR_CAD_NURBS_H
#define PSR_CAD_NURBS_H

#include <Geom_BSplineSurface.hxx>

// What the surface is between bounds of u and v, from[axis][0] < from[axis][1]. Its parameters rise with the surface's,
// each with one of them, whatever the other is; bounds have the same places, and so have their middles. Throws
// Standard_Failure where there is none.
Handle(Geom_BSplineSurface) cad_nurbs(const Handle(Geom_Surface) &surface, const double from[2][2]);

// The parameter of the NURBS, along u or v, for x of the surface.
double cad_nurbs_parameter(double x, int axis, const Geom_Surface &surface, const Geom_BSplineSurface &nurbs,
                           const double from[2][2]);

#endif
