/* The writers behind psr/picture.h. */
#ifndef PSR_CLIENT_PICTURE_H
#define PSR_CLIENT_PICTURE_H

#include "outfile.h"
#include "psr/picture.h"

int picture_write_png(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);
int picture_write_ppm(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);
int picture_write_pfm(struct outfile *file, const struct psr_picture *picture, struct psr_error *err);

#endif
