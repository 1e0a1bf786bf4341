/* The control points of Newell's teapot, for its generator and its test. */
#ifndef MODELS_TEAPOT_H
#define MODELS_TEAPOT_H

#include <stdint.h>

#define TEAPOT_PATCHES 32

/* Patch i < TEAPOT_PATCHES, in object space with +Y up, outside as in surface_patch. Returns the part's name: "rim",
 * "body", "lid", "bottom", "handle" or "spout". */
const char *teapot_patch(uint32_t i, double control[4][4][3]);

#endif
