/* Stills, pass by pass, beside the ray-traced truth ([G] 9.1.1). */
#ifndef MODELS_ACCURACY_PASSES_H
#define MODELS_ACCURACY_PASSES_H

#include "psr/error.h"

/* Draws passes 0..n_passes of the model in a view of all of it, whose samples are `magnification` pixels apart, and
 * prints for each the noise of the pixels that show the mesh, in dB, and the quickest of some times. */
int accuracy_passes(const char *source, const char *model, double magnification, unsigned n_passes,
                    struct psr_error *err);

#endif
