/* From one rectangle of a plane to RECT messages: packs, filters, compresses, cuts into pieces. */
#ifndef PSRD_CODEC_RECT_H
#define PSRD_CODEC_RECT_H

#include <stddef.h>
#include <stdint.h>
#include "server/net/outq.h"

struct codec;
struct encoder; /* contexts and scratch memory for one thread at a time */

struct encoder *codec_take_encoder(struct codec *codec); /* NULL without memory */
void codec_put_encoder(struct codec *codec, struct encoder *encoder);

/* Returns n bytes of scratch memory, valid until the next call with this encoder. NULL without memory. */
uint8_t *encoder_scratch(struct encoder *encoder, size_t n);

/* The pixels to code, and their place. */
struct coded_rect {
	uint32_t id; /* the request's */
	uint16_t view;
	unsigned plane, codec, quality; /* codec becomes RAW if the requested one makes the data no smaller */
	unsigned pixel_bytes, component_bytes;
	const uint8_t *pixels; /* first pixel of the first row */
	size_t pitch;          /* bytes from row to row */
	uint32_t width, height; /* data pixels */
	uint32_t x, y, w, h, scale; /* in the picture */
	size_t bytes; /* out: bytes of RECT data */
};

/* Codes the rectangle. The caller owns the RECTs, which are in one chunk. MEMORY, INTERNAL. */
int encoder_code(struct outq_chunk **out, struct encoder *encoder, struct coded_rect *rect);

#endif
