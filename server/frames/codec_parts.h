/* The parts of a picture that a client holds: a grid of 128x32 pixels. Each part of each plane has the hash of its
 * pixels as drawn, and the quality that the client has.
 *
 * The hash of a part is XXH64; each row is hashed with the hash of the rows above as its seed. Two different parts have
 * the same hash in at most 32 of 2^64 cases; then the client shows the older part until it changes again, and a
 * lossless frame fails by its hash. A viewer of 60 frames/s at 1080p, colour and depth, compares 61,000 parts a second:
 * this happens to it once in 300,000 years. */
#ifndef PSRD_CODEC_PARTS_H
#define PSRD_CODEC_PARTS_H

#include <stdint.h>
#include "proto/proto.h"

#define PARTS_A_STRIP 4  /* rows of parts */
#define PART_LOSSLESS 255 /* JPEG has 1..100; depth as u16 at half size has 1, whole 2 */

struct codec_parts {
	uint32_t width, height, planes, scale; /* the frame's */
	uint32_t n_columns, n_rows;
	uint8_t depth_format;
	struct psr_depth_range range; /* range of depth as u16 */
	uint8_t *quality; /* lies behind the hashes */
	uint64_t hash[];  /* by plane, row, column */
};

uint64_t codec_parts_bytes(uint32_t width, uint32_t height, uint32_t planes); /* memory that codec_parts_create()
                                                                               * takes */

/* Makes the parts for a frame of this size; codec_encode() fills them in. NULL without memory. The caller frees
 * them. */
struct codec_parts *codec_parts_create(uint32_t width, uint32_t height, uint32_t planes);

/* Returns whether a frame can be sent as changes to `base`: size, planes, scale and the range of depth are the same. */
int codec_parts_fit(const struct codec_parts *base, const struct psr_msg_frame *request, uint32_t scale);

/* ---- for the codec ---- */

struct part_area { /* an area of parts, from the first to behind the last */
	uint8_t x0, x1, y0, y1; /* rows count from the strip's first row */
};

/* Hashes the parts of a strip of n rows of `width` pixels. */
void codec_parts_hash(struct codec_parts *parts, unsigned plane, uint32_t strip, const uint8_t *pixels, uint32_t n);

/* Finds the parts of the strip that `base` does not have as well as `quality`, as rectangles; the others keep the
 * base's quality. Returns how many rectangles there are. */
#define PART_AREAS (PARTS_A_STRIP * 64)
unsigned codec_parts_changed(struct part_area area[PART_AREAS], struct codec_parts *parts,
                             const struct codec_parts *base, unsigned plane, uint32_t strip, unsigned quality);

/* Records that the client gets the area of the strip with this quality. */
void codec_parts_sent(struct codec_parts *parts, unsigned plane, uint32_t strip, const struct part_area *area,
                      unsigned quality);

/* Returns the area of the whole strip. */
struct part_area codec_parts_all(const struct codec_parts *parts, uint32_t strip);

#endif
