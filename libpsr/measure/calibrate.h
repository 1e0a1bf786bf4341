/* The ladder of settings, measured on a model: views of a seed, drawn with each rung and held against the source. */
#ifndef PSR_MEASURE_CALIBRATE_H
#define PSR_MEASURE_CALIBRATE_H

#include "model/calibration.h"
#include "psr/mesh.h"

#define CALIBRATE_VIEWS 32

struct calibrate_options {
	uint32_t n_views;  /* 1..PSR_MAX_CALIBRATED */
	uint64_t seed;     /* of the views */
	int n_threads;     /* 1..256, of rays and of frames */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata); /* "calibrate"; or NULL */
	void *userdata;
};

/* Measures a model with blocks that was built from the mesh. view, fine: n_views each. Errors are those of 1 thread or many; times
 * are this machine's. ARG, MEMORY. */
int calibrate(struct psr_calibrated *view, struct psr_calibrated_fine *fine, const struct psr_model *model,
              const struct psr_mesh *mesh, const struct calibrate_options *options, struct psr_error *err);

#endif
