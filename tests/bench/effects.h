/* The parts of `make bench-effects`. */
#ifndef TESTS_BENCH_EFFECTS_H
#define TESTS_BENCH_EFFECTS_H

#include "psr/model.h"

struct effects {
	struct psr_model *model;
	const char *name, *source; /* of the model, and its mesh */
	double aim[3];             /* of a picture that it half covers, see scene.h */
	const char *out;           /* folder of the picture and the JSON */
	int n_threads;
};

void effects_prices(const struct effects *effects);
void effects_spacing(const struct effects *effects);
void effects_gaps(const struct effects *effects);

#endif
