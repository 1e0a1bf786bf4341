/* Intensities of scans, which have no unit: what is black, and what is white. */
#ifndef PSR_IMPORT_POINTS_GRAY_H
#define PSR_IMPORT_POINTS_GRAY_H

#include <stddef.h>
#include <stdint.h>

struct gray {
	double *value;          /* every `stride`-th one noted */
	size_t n;
	uint64_t seen, stride;
	double black, scale;    /* scale: 1 / (white - black); 0: all are alike */
};

int gray_begin(struct gray *gray); /* returns 0 without memory */
void gray_note(struct gray *gray, double intensity);
/* White is where one value of a hundred is above at most, black is 0 or the least value below it. */
void gray_end(struct gray *gray);
void gray_fini(struct gray *gray);

/* Returns the sRGB code; 0 for what is not a number. */
uint8_t gray_code(const struct gray *gray, double intensity);

#endif
