/* From a mesh to a point-sample model ([G] 4.4, 5): projections, lattice, rays, selection of blocks. */
#ifndef PSR_BUILD_H
#define PSR_BUILD_H

#include <stdint.h>
#include "error.h"
#include "mesh.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

struct psr_build_options {
	uint32_t resolution; /* target resolution in pixels across the unit sphere ([G] 5.1), 8..8192 */
	double tolerance;    /* angle of [G] 4.4, radians, in (0, 60 degrees] */
	int n_threads;       /* 1..256 */
	double up[3];        /* the object's way up, of any length; 0, 0, 0: the mesh's own */
	/* psr_model_build() calls it now and then in its caller's thread; stage is "sample"; done <= total. May be
	 * NULL. */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata);
	void *userdata;
};
void psr_build_options_default(struct psr_build_options *options); /* 512, 25 degrees, all cores, the mesh's up */

struct psr_build_report {
	uint64_t n_rays, n_candidates; /* over all levels; a candidate is a piece of the surface that may become a
	                                * block */
	double seconds_rays, seconds_select, seconds_total; /* select: choosing which samples to keep, and measuring
	                                                     * adequacy */
};

/* Builds a model, which the caller owns. The same mesh and options give the same bytes, whatever the number of threads
 * and the CPU. report may be NULL. ARG, MEMORY, LIMIT. */
int psr_model_build(struct psr_model **out, const struct psr_mesh *mesh, const struct psr_build_options *options,
                    struct psr_build_report *report, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
