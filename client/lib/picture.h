/* The writers behind psr/picture.h. */
#ifndef PSR_CLIENT_PICTURE_H
#define PSR_CLIENT_PICTURE_H

#include "base/outfile.h"
#include "psr/picture.h"

int picture_write_png(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);
int picture_write_ppm(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);
int picture_write_pfm(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);

/* ---- apng.c: the file is the caller's, and stays open ---- */

struct apng;
int apng_open(struct apng **out, struct outfile *file, const struct psr_picture *first, uint32_t n_frames,
              double seconds, struct psr_error *err);
int apng_add(struct apng *apng, const struct psr_picture *picture, struct psr_error *err);
int apng_close(struct apng *apng, int is_whole, struct psr_error *err); /* not whole: nothing more is written */

#endif
