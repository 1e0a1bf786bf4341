/* Differential points for psr-model build. */
#ifndef MODELS_POINTS_H
#define MODELS_POINTS_H

#include "sample/dpoint/of_mesh.h"

struct points_wish {
	double eps, delta;   /* 0: as dpoint_build_options_default() */
	double error;        /* pixels of the resolution; 0: none. Not with the others */
	uint32_t resolution;
	int n_threads;
	double up[3];        /* 0,0,0: the mesh's */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata);
	void *userdata;
};

/* Makes a model of a mesh's, or a cloud's, differential points. ARG, FORMAT, LIMIT, MEMORY. */
int points_make(struct psr_model **out, struct dpoint_build_report *report, const struct psr_mesh *mesh,
                const struct points_wish *wish, struct psr_error *err);

/* Takes --error; userdata is a struct points_wish. ARG. */
int points_take_error(const char *text, void *userdata, struct psr_error *err);

/* Whether the wishes go together, and with the representation. ARG. */
int points_check(const struct points_wish *wish, int is_points, struct psr_error *err);

/* Print what was built, and what is further off than `error`, which was asked for. */
void points_summarize(const struct dpoint_build_report *report, const char *out, uint64_t file_bytes,
                      const struct psr_mesh *mesh);
void points_warn(const struct dpoint_build_report *report, double error);

#endif
