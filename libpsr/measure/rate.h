/* The speed of ray tracing, compared with Embree alone. */
#ifndef PSR_MEASURE_RATE_H
#define PSR_MEASURE_RATE_H

#include "psr/error.h"
#include "psr/mesh.h"

/* Counts first hits of the same parallel rays (a lattice of 512 across the unit sphere, from four directions) on the
 * same mesh, by one thread, in millions of rays a second of its CPU time. `ours`: ray_scene_trace() on doubles with
 * cut-outs, backs and hits in double; the other: Embree's plain packets of eight floats, without filters, on the same
 * tree. Takes the best of three alternating rounds each. ARG for a mesh that the sampler refuses, MEMORY, INTERNAL. */
int psr_ray_rate(const struct psr_mesh *mesh, double *ours, double *embree, struct psr_error *err);

#endif
