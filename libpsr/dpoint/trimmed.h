/* Patches of exact surfaces, as far as they are there, to candidates and cells. */
#ifndef PSR_DPOINT_TRIMMED_H
#define PSR_DPOINT_TRIMMED_H

#include "psr/mesh.h"
#include "surface.h"

struct dpoint_trimmed_options {
	double origin[3], scale; /* inner units are (place - origin) * scale */
	double cell;             /* sides of cells, inner units: at most about this */
	double turn;             /* and normals turn by at most about this along a side, radians; both > 0 */
	double hem;              /* cells reach so far beyond rims, inner units */
	double facet;            /* above 0: there are facets, whose sides are off the surface by so much at most, inner
	                          * units */
	float delta;             /* the most that a rectangle may reach */
	uint64_t attr;           /* of all points, without a normal */
};

/* Adds a cell for each piece of the patch, and a candidate; beside rims three, along them. Lines of a grid, knots among
 * them, divide the plane of parameters; in cells of the grid that rims run through, pieces are what the patch's triangles
 * have in common with them. So places, normals and curvatures are the surface's own, and a crease at a knot of full
 * multiplicity runs along cells.
 *
 * Two patches end at straight sides between the same places, each in its own parameters: what is between these sides is
 * covered by hems, cells on the tangent plane beyond the rim. Beyond rims beside which nothing goes on smoothly there is a
 * strip as well, which no rectangle may be over. MEMORY; LIMIT: more than 2^22 cells, or as many of the grid. */
int dpoint_sample_trimmed(struct dpoint_surface *surface, const struct psr_patch *patch,
                          const struct dpoint_trimmed_options *options, struct psr_error *err);

/* Fails with the error of too many cells, for patches that have them together. Returns LIMIT. */
int dpoint_trimmed_refuse(double cell, struct psr_error *err);

#endif
