/* Colour pictures as binary PPM ("P6", 8 bits a channel). */
#ifndef MODELS_PPM_H
#define MODELS_PPM_H

#include <stdint.h>
#include "psr/error.h"

/* Reads a picture; 3 bytes a pixel, rows top-down, in memory of malloc(). NOT_FOUND, IO, FORMAT, LIMIT, MEMORY. */
int ppm_read(uint8_t **out, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err);

#endif
