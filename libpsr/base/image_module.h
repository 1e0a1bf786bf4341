/* The image module psr-image-oiio.so: the formats that OpenImageIO reads and writes. It is opened on demand, because
 * linking OpenImageIO costs hundreds of libraries and a quarter of a second at every start. */
#ifndef PSR_BASE_IMAGE_MODULE_H
#define PSR_BASE_IMAGE_MODULE_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

/* The functions of the module, with C linkage: psr_image_module_read, _write, _check,
 * _animation_check, _animation_open, _animation_add, _animation_close. They put a sentence into
 * message where they fail. */

/* Decodes bytes of a format, as OpenImageIO calls it, from the top left, into *rgba (free): 8 bits a channel.
 * Integers are taken as sRGB-coded, whatever the file says, and floats as linear light; alpha is not multiplied in.
 * FORMAT, UNSUPPORTED, LIMIT (more than max_pixels, or a side that is too long), MEMORY. */
typedef int image_module_read(uint8_t **rgba, uint32_t size[2], const uint8_t *bytes, size_t n_bytes,
                              const char *format, uint64_t max_pixels, char *message, unsigned message_size);

/* `path` is written in place, the format is that of its ending. 0, or 1. is_depth: pixels are floats of one channel
 * Z, else 8-bit sRGB. */
typedef int image_module_write(const char *path, unsigned width, unsigned height, int is_depth, const void *pixels,
                               char *message, unsigned message_size);

/* 0 if the ending is one that it can write for such pixels, or 1. */
typedef int image_module_check(const char *ending, int is_depth, char *message, unsigned message_size);

/* Pictures that follow each other in one file: open, add n times (8-bit sRGB), close, which frees it in any case. */
typedef int image_module_animation_check(const char *ending, char *message, unsigned message_size);
typedef int image_module_animation_open(void **animation, const char *path, unsigned width, unsigned height, unsigned n,
                                        double seconds, char *message, unsigned message_size);
typedef int image_module_animation_add(void *animation, const void *pixels, char *message, unsigned message_size);
typedef int image_module_animation_close(void *animation, char *message, unsigned message_size);

struct image_module {
	image_module_read *read;
	image_module_write *write;
	image_module_check *check;
	image_module_animation_check *animation_check;
	image_module_animation_open *animation_open;
	image_module_animation_add *animation_add;
	image_module_animation_close *animation_close;
};

/* Opens the file that PSR_IMAGE_MODULE names; or else the module of this installation (../lib/psr beside the
 * program's folder) or build folder (../lib); or else the one that the dynamic linker finds (the program's run path,
 * the system's folders). *out stays, and later calls return the same. UNSUPPORTED where there is none or it cannot
 * be loaded, VERSION if it lacks a function; the text says what, and goes behind a colon. From any thread. */
int image_module_open(const struct image_module **out, struct psr_error *err);

#endif
