/* LAS, what its two readers share: a whole file in memory (las.c), and points as they come (las_source.c). */
#ifndef PSR_IMPORT_CLOUD_LAS_H
#define PSR_IMPORT_CLOUD_LAS_H

#include <string.h>
#include "cloud.h"

/* LAS 1.2 to 1.4 in the terms of the ASPRS specifications. */
struct las {
	const char *path;
	const uint8_t *bytes;            /* all, or those before the points, once las_read_header() knows how many */
	uint64_t n_bytes, first, n_points; /* first: the offset of the points */
	unsigned minor, format, record;    /* record: bytes of a point */
	double scale[3], offset[3];
};

/* Finds the colours of points: their own, of 16 bits or of 8 in 16, or intensity. */
struct las_tint {
	unsigned color;     /* its offset in a point; 0: intensity */
	double scale;       /* to codes of 0..255, or of intensity to linear light */
	int is_none;
	uint64_t most, *histogram; /* until las_tint_end() */
};

static inline uint64_t las_get(const uint8_t *p, int n)
{
	uint64_t x = 0;

	for (int i = 0; i < n; i++)
		x |= (uint64_t)p[i] << 8 * i;
	return x;
}

static inline double las_get_double(const uint8_t *p)
{
	uint64_t bits = las_get(p, 8);
	double x;

	memcpy(&x, &bits, sizeof x);
	return x;
}

/* Returns whether points have a GPS time. */
static inline int las_has_time(const struct las *las)
{
	return las->format != 0 && las->format != 2;
}

/* Reads the header; path, bytes and n_bytes are set. Ensures that the file has room for all points. FORMAT,
 * UNSUPPORTED. */
int las_read_header(struct las *las, struct psr_error *err);

/* Returns whether a point is classified as low or high noise, or marked as withheld. */
int las_is_left_out(const struct las *las, const uint8_t *p);

/* Looks at all points, one after the other, for what their colours mean. MEMORY. */
int las_tint_begin(struct las_tint *tint, const struct las *las, struct psr_error *err);
void las_tint_note(struct las_tint *tint, const struct las *las, const uint8_t *p);
void las_tint_end(struct las_tint *tint);

#endif
