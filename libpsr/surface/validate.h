/* Checks of a mesh that is to be sampled or traced. */
#ifndef PSR_SURFACE_VALIDATE_H
#define PSR_SURFACE_VALIDATE_H

#include "psr/error.h"
#include "psr/mesh.h"

/* Checks the promises of psr/mesh.h on which memory and arithmetic depend. ARG, LIMIT. */
int validate_mesh(const struct psr_mesh *mesh, struct psr_error *err);

/* Middle of the bounding box of all vertices in use, and the radius of the smallest sphere about it that holds them,
 * grown by 2^-20 for rounding: origin and scale of the inner coordinates. ARG if the mesh has no extent. */
int validate_bound_mesh(const struct psr_mesh *mesh, double center[3], double *radius, struct psr_error *err);

#endif
