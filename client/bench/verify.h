/* Are the pictures right? Hashes of kept answers against pictures drawn here, or against a recording. */
#ifndef PSR_CLIENT_BENCH_VERIFY_H
#define PSR_CLIENT_BENCH_VERIFY_H

#include "bench.h"

struct verify_result { uint64_t n_right, n_wrong; };

/* Compares all kept answers with those of the plan's recording. Names the first wrong one on standard error. */
void verify_with_recording(struct verify_result *out, const struct bench_plan *plan, const struct bench_result *result);

/* Draws all kept answers with this program's library from the models in `folder` (.psr files, found by content id), and
 * compares. NOT_FOUND: a model is not there; IO, MEMORY, and the errors of psr_render(). */
int verify_by_drawing(struct verify_result *out, const struct bench_plan *plan, const struct bench_result *result,
                      const char *folder, struct psr_error *err);

#endif
