/* Pictures in the formats of the Netpbm family: colour as PPM ("P6", 8 bits a channel), depth as PFM ("Pf", floats,
 * rows from the bottom up, a scale whose sign is the byte order). In memory, rows are top-down and packed. */
#ifndef PSR_BASE_NETPBM_H
#define PSR_BASE_NETPBM_H

#include <stdint.h>
#include "outfile.h"
#include "psr/frame.h"

/* Reads colours, 3 bytes a pixel, into memory of malloc(). NOT_FOUND, IO, FORMAT, LIMIT (sides and pixels of
 * psr/frame.h), MEMORY. */
int ppm_read(uint8_t **rgb, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err);

/* Reads a picture of one channel into memory of malloc(), with the same errors. */
int pfm_read(float **depth, uint32_t *width, uint32_t *height, const char *path, struct psr_error *err);

/* Write the frame's colour, and its depth (little-endian). outfile_close() reports failures; these return PSR_OK. */
int ppm_write_frame(struct outfile *file, const struct psr_frame *frame, struct psr_error *err);
int pfm_write_frame(struct outfile *file, const struct psr_frame *frame, struct psr_error *err);

#endif
