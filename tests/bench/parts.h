/* The parts of `make bench`. Each prints its tables, adds to the JSON, and remembers its targets. */
#ifndef TESTS_BENCH_PARTS_H
#define TESTS_BENCH_PARTS_H

#include "scene.h"

struct part {
	const char *psr_model, *models; /* the program, and the folder of what it builds */
	const char *out;                /* folder of pictures and plots */
	int n_threads;
};

/* A model of the benchmark. source: its mesh. It is built for each picture, so that magnification is about 1 as far as
 * building takes minutes only. */
#define N_PICTURES 4
struct subject {
	const char *name, *file, *source;
	int resolution[N_PICTURES]; /* the last is the finest */
	double aim[3];         /* of the pictures that it is to cover, see scene.h */
	int is_of_the_targets; /* whether the targets that name the dragon hold for it */
};

void pictures_run(const struct part *part, const struct subject *subject);
void thesis_table(const struct part *part);
void thesis_figure(const struct part *part);
void growth_run(const struct part *part, const struct subject *subject);
void warp_run(const struct part *part, const struct subject *subject);
void plot_all(const struct part *part);

#endif
