/* Frames to messages: cuts each plane into strips of 128 rows, codes them, puts them into RECT messages, which leave in
 * order while later strips are being coded.
 *
 * JPEG has 4:4:4 chroma from quality 90 on, else 4:2:0, a whole file each rectangle. zstd works at level 1 after the
 * row filter. A rectangle that its codec does not make smaller travels raw. Without a base a strip is one rectangle, and
 * left out if it is nothing but background. On a base the parts of a strip that changed are sent, joined to rectangles.
 * The bytes are a function of the pixels, the request and the base alone, whatever the threads. */
#ifndef PSRD_CODEC_H
#define PSRD_CODEC_H

#include <stdint.h>
#include "codec_parts.h"
#include "server/net/outq.h"
#include "psr/error.h"
#include "base/pool.h"
#include "proto/proto.h"
#include "psr/render.h"

#define CODEC_CHROMA_QUALITY 90 /* JPEG keeps full chroma from this quality on */

struct codec; /* encoder contexts, reused from strip to strip, for any number of threads */

int codec_create(struct codec **out);
void codec_destroy(struct codec *codec); /* NULL is fine */

struct codec_answer {
	uint32_t id; /* the request's */
	uint16_t view;
	const struct psr_msg_frame *request; /* the frame has its planes; the codecs may be better than those in the
	                                      * client's request */
	uint32_t scale;                      /* 1, 2, 4: the frame has 1 / scale of the request's width and height */
	const uint8_t *background;           /* RGB */
	const struct codec_parts *base;      /* the parts that the client holds, which codec_parts_fit() accepts; NULL:
	                                      * none */
	struct codec_parts *parts;           /* out: the parts that the client holds after this frame; not `base`; NULL: not
	                                      * wanted */
	/* Takes a list of RECT messages and owns it: from any thread, one call at a time, in order. */
	void (*emit)(struct outq_chunk *first, void *userdata);
	void *userdata;
	const struct psr_cancel *cancel;     /* asked before each strip; NULL: nobody stops the coding */
};

struct codec_result {
	uint64_t rect_bytes;         /* of RECT data */
	uint64_t hash[PSR_N_PLANES]; /* of FRAME_END; 0 if the request has no_hashes */
	double depth_min, depth_max; /* range of the finite depths; both 0: there are none */
};

/* Encodes the planes of the request as its answer. CANCELLED, MEMORY, INTERNAL: drop the frame and all that was
 * emitted; `parts` are then meaningless. */
int codec_encode(struct codec_result *out, struct codec *codec, struct psr_pool *pool,
                 const struct codec_answer *answer, const struct psr_frame *frame, struct psr_error *err);

#endif
