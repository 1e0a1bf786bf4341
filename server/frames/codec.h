/* Frames to messages: hashes each plane, cuts it into strips of 128 rows, codes them, puts them into RECT messages.
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
#include "psr/proto.h"
#include "psr/render.h"

#define CODEC_STRIP_ROWS 128
#define CODEC_CHROMA_QUALITY 90 /* JPEG keeps full chroma from this quality on */

struct codec; /* encoder contexts, reused from strip to strip; any number of threads */

int codec_create(struct codec **out);
void codec_destroy(struct codec *codec); /* NULL is fine */

struct codec_result {
	struct outq_chunk *first; /* RECT messages in order; the caller's; NULL: all background */
	uint64_t rect_bytes;      /* of RECT data */
	uint64_t hash[PSR_N_PLANES];
	double depth_min, depth_max; /* of the finite depths; both 0: there are none */
};

struct codec_answer {
	uint32_t id; /* of the request, */
	uint16_t view;
	const struct psr_msg_frame *request; /* whose planes the frame has */
	const uint8_t *background;           /* RGB */
};

/* Encodes the planes of the request as its answer. MEMORY, INTERNAL: nothing is kept. */
int codec_encode(struct codec_result *out, struct codec *codec, struct psr_pool *pool,
                 const struct codec_answer *answer, const struct psr_frame *frame, struct psr_error *err);

#endif
