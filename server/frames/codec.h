/* Frames to messages: each plane is hashed, cut into strips of 128 rows, coded, and put into RECT messages.
 *
 * JPEG has 4:4:4 chroma from quality 90 on, else 4:2:0, a whole file each strip. zstd works at level 1 after the row
 * filter. A strip that its codec does not make smaller travels raw. Strips of nothing but background are left out. The
 * bytes are a function of the pixels alone, whatever the threads. */
#ifndef PSRD_CODEC_H
#define PSRD_CODEC_H

#include <stdint.h>
#include "server/net/outq.h"
#include "psr/error.h"
#include "base/pool.h"
#include "proto/proto.h"
#include "psr/render.h"

#define CODEC_STRIP_ROWS 128
#define CODEC_CHROMA_QUALITY 90 /* from here on JPEG keeps all chroma */

struct codec; /* encoder contexts that are kept from strip to strip; used by any number of threads at once */

int codec_create(struct codec **out);
void codec_destroy(struct codec *codec); /* NULL is fine */

struct codec_result {
	struct outq_chunk *first; /* RECT messages in order; the caller's; NULL if everything is background */
	uint64_t rect_bytes;      /* of RECT data */
	uint64_t hash[PSR_N_PLANES];
	double depth_min, depth_max; /* of the finite depths, both 0 if there are none */
};

/* Encodes the planes that `request` asks for, all of which the frame has, as answers to `id`. On failure (MEMORY,
 * INTERNAL) nothing is kept. */
int codec_encode(struct codec_result *out, struct codec *codec, struct psr_pool *pool, uint32_t id, uint16_t view,
                 const struct psr_msg_frame *request, const struct psr_frame *frame, const uint8_t background[3],
                 struct psr_error *err);

#endif
