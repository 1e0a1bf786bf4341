/* Small analytic models for the renderer's tests: adequately sampled by construction, with known truth. */
#ifndef TESTS_SHAPES_H
#define TESTS_SHAPES_H

#include "psr/model.h"

struct shape_options {
	uint32_t resolution;   /* pixels across the unit sphere */
	uint32_t diffuse;      /* base colour, r | g << 8 | b << 16 */
	uint32_t metallic, reflectance, shut, roughness; /* as in PSR_ATTR_*; 0: matt */
	int two_sided, unlit;
	int cones;             /* with [G] 6.4's visibility cones */
	double origin[3], scale;
	double tilt; /* radians about y, of the square's normals, as a map of normals does; its samples stay in the plane */
};

/* A sphere of the given radius (at most 1) about the inner origin, seen from outside; or, with radius 0, the square of
 * half side 0.7 in the plane z = 0 whose front is +z. Aborts on failure: this is a test's fixture. */
struct psr_model *shape_build(const struct shape_options *options, double radius);

#endif
