/* Depth pictures as PFM: "Pf", width and height, a scale whose sign is the byte order, rows of floats from the bottom
 * up. */
#ifndef MODELS_PFM_H
#define MODELS_PFM_H

#include <stdint.h>
#include "psr/error.h"

/* Reads a picture of one channel; rows come top-down, in memory of malloc(). NOT_FOUND, IO, FORMAT, LIMIT, MEMORY. */
int pfm_read(float **out, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err);

#endif
