/* Differential points for psr-model build. */
#ifndef MODELS_POINTS_H
#define MODELS_POINTS_H

#include "sample/dpoint/of_mesh.h"

struct points_wish {
	double eps, delta;   /* 0: as dpoint_build_options_default() */
	uint32_t resolution;
	int n_threads;
	double up[3];        /* 0,0,0: the mesh's */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata);
	void *userdata;
};

/* Makes a model of a mesh's differential points. ARG, FORMAT, LIMIT, MEMORY. */
int points_make(struct psr_model **out, struct dpoint_build_report *report, const struct psr_mesh *mesh,
                const struct points_wish *wish, struct psr_error *err);

#endif
