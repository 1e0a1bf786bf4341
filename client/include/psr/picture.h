/* Pictures in the client's memory, and the files that they are written to. */
#ifndef PSR_PICTURE_H
#define PSR_PICTURE_H

#include <stdint.h>
#include "psr/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rows top-down, packed. */
struct psr_picture {
	uint32_t width, height;
	uint8_t *rgb; /* 3 * width * height, sRGB */
	float *depth; /* width * height, z' in world units, +inf where nothing is; NULL if it was not asked for */
};

/* The file's ending, in lower case or not, chooses the format. Colour: .png (libpng, 8 bits, with an sRGB chunk) and
 * .ppm. Depth: .pfm (little-endian, bottom-up as the format has it, +inf kept). All other endings that OpenImageIO
 * writes come from the module psr-image-oiio.so, which is loaded on the first such call: colour as 8-bit sRGB, or
 * linear where the format holds light (.exr, .hdr), depth as one channel `Z` of floats (.exr, .tif).
 *
 * A regular file is written under a temporary name beside `path` and renamed: `path` is either what it was or the whole
 * new picture. Devices and pipes are written in place. Both sides are at least 1 pixel.
 * ARG: no or an unfit ending; NOT_FOUND: no such folder; UNSUPPORTED: the module is missing, or does not know the
 * ending; IO: the system refused (disk full, permission); MEMORY. */
int psr_picture_write_color(const struct psr_picture *picture, const char *path, struct psr_error *err);
int psr_picture_write_depth(const struct psr_picture *picture, const char *path, struct psr_error *err);

/* What the two calls above would refuse at once: the ending, and a missing module. */
int psr_picture_check_color(const char *path, struct psr_error *err);
int psr_picture_check_depth(const char *path, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
