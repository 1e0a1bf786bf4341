/* The writers behind psr/picture.h. */
#ifndef PSR_CLIENT_PICTURE_H
#define PSR_CLIENT_PICTURE_H

#include "outfile.h"
#include "psr/picture.h"

int picture_write_png(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);
int picture_write_ppm(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);
int picture_write_pfm(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);

/* The module psr-image-oiio.so: its one function, with C linkage. `path` is written in place, the format is that of its
 * ending. 0, or 1 with a sentence in message. is_depth: pixels are floats of one channel Z, else 8-bit sRGB. */
typedef int picture_module_write(const char *path, unsigned width, unsigned height, int is_depth, const void *pixels,
                                 char *message, unsigned message_size);
/* 0 if the ending is one that it can write for such pixels, or 1 with a sentence. */
typedef int picture_module_check(const char *ending, int is_depth, char *message, unsigned message_size);

int picture_module_load(picture_module_write **write, picture_module_check **check, struct psr_error *err);

#endif
