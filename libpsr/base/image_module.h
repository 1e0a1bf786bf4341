/* The image module psr-image-oiio.so, for formats that OpenImageIO reads and writes. Loaded on demand: linking
 * OpenImageIO costs hundreds of libraries and a quarter of a second at every start. */
#ifndef PSR_BASE_IMAGE_MODULE_H
#define PSR_BASE_IMAGE_MODULE_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

/* The types of the module's functions. On failure they write a sentence to `message`. */

/* An encoded image in memory, which the caller owns. format: OpenImageIO's name. */
struct image_module_source {
	const uint8_t *bytes;
	size_t n_bytes;
	const char *format;
	uint64_t max_pixels;
};

/* Decodes an image, from the top left, into *rgba (free): 8 bits a channel. Takes integers as sRGB codes, even if the
 * file says otherwise, floats as linear light, and alpha as unassociated. FORMAT, UNSUPPORTED, LIMIT (more than
 * max_pixels, or a side too long), MEMORY. */
typedef int image_module_read(uint8_t **rgba, uint32_t size[2], const struct image_module_source *source,
                              char *message, unsigned message_size);

/* A picture to write, which the caller owns. Sides in pixels. is_depth: pixels are floats of one channel Z, else 8-bit
 * sRGB. */
struct image_module_picture {
	unsigned width, height;
	int is_depth;
	const void *pixels;
};

/* Writes `path` in place, in the format of its ending. Returns 0, or 1 on failure. */
typedef int image_module_write(const char *path, const struct image_module_picture *picture, char *message,
                               unsigned message_size);

/* Returns 0 if the module can write such pixels with this ending, else 1. */
typedef int image_module_check(const char *ending, int is_depth, char *message, unsigned message_size);

/* n pictures, their sides in pixels, each shown for `seconds`. */
struct image_module_film {
	unsigned width, height, n;
	double seconds;
};

/* Animations: open one, add n pictures (8-bit sRGB), close it. Closing always frees it. */
typedef int image_module_animation_check(const char *ending, char *message, unsigned message_size);
typedef int image_module_animation_open(void **animation, const char *path, const struct image_module_film *film,
                                        char *message, unsigned message_size);
typedef int image_module_animation_add(void *animation, const void *pixels, char *message, unsigned message_size);
typedef int image_module_animation_close(void *animation, char *message, unsigned message_size);

/* The module exports one of these, named psr_image_module. Raise the version with every change of this file. */
#define IMAGE_MODULE_VERSION 1
struct image_module {
	uint32_t version; /* IMAGE_MODULE_VERSION of the module's own build; first in every version */
	image_module_read *read;
	image_module_write *write;
	image_module_check *check;
	image_module_animation_check *animation_check;
	image_module_animation_open *animation_open;
	image_module_animation_add *animation_add;
	image_module_animation_close *animation_close;
};

/* Loads the module, from any thread: the file that PSR_IMAGE_MODULE names; else the one of this installation
 * (../lib/psr beside the program's folder) or build folder (../lib); else the one that the dynamic linker finds. *out
 * stays valid; later calls return the same. UNSUPPORTED if it is missing or cannot be loaded, VERSION if it is
 * another version's, or no image module. */
int image_module_open(const struct image_module **out, struct psr_error *err);

#endif
