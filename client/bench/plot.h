/* Plots of loads by gnuplot, as .svg or .png by the file's ending. */
#ifndef PSR_CLIENT_BENCH_PLOT_H
#define PSR_CLIENT_BENCH_PLOT_H

#include "sweep.h"

/* Finds what is wrong with a file's name before anything runs. ARG. */
int plot_check(const char *path, struct psr_error *err);

/* Latency over time, and its distribution. NOT_FOUND: gnuplot is not installed; IO. */
int plot_load(const struct bench_result *result, const char *what, const char *path, struct psr_error *err);

/* Frames a second and latency by load, the knee marked. Errors as above. */
int plot_sweep(const struct sweep *sweep, const struct sweep_points *points, const char *what, const char *path,
               struct psr_error *err);

#endif
