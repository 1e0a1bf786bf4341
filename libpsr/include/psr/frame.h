/* A frame: the planes of a picture. The renderer draws them, the daemon sends them, the client gets them. */
#ifndef PSR_FRAME_H
#define PSR_FRAME_H

#include <stddef.h>
#include <stdint.h>
#include "error.h"
#include "report.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_MAX_SIDE 16384          /* pixels */
#define PSR_MAX_PIXELS (64u << 20)  /* of a frame */

enum psr_plane {
	PSR_PLANE_COLOR, PSR_PLANE_DEPTH, PSR_PLANE_NORMAL, PSR_PLANE_ID, PSR_PLANE_WEIGHT, PSR_PLANE_WORDS,
	PSR_PLANE_BLOCK,
	PSR_N_PLANES
};

/* What the cull knew of a block that is drawn ([G] 6.4, 7.3.2). */
enum psr_facing {
	PSR_FACING_EYE,       /* its cone faces the eye, and so do all of its samples; or it is bent, and part of it may */
	PSR_FACING_MIXED,     /* some samples may face away: each was asked */
	PSR_FACING_TWO_SIDED, /* none was asked */
};

/* Rows run from the top down, without gaps. A plane that is NULL is left out. Normal, id and block tell of the sample
 * that a pixel shows behind all surfaces that let light through; a pixel of weight 0 shows none, though the fill may have given it colour and depth. */
struct psr_frame {
	uint32_t width, height; /* pixels, 1..PSR_MAX_SIDE */
	uint8_t *rgb;     /* 3 * width * height, sRGB; without it nothing is lit */
	float *depth;     /* width * height, z' in world units along the view, +inf where nothing is. A surface that lets
	                   * light through has its depth here where it keeps back half of it or more */
	int16_t *normal;  /* 3 * width * height, world space, round(32767 * n), turned to the eye where the block is
	                   * two-sided; 0, 0, 0 without a sample */
	uint32_t *id;     /* width * height, index of the instance; UINT32_MAX without a sample */
	uint8_t *block;   /* 3 * width * height: level in the model, level of the depth buffer, enum psr_facing; 255, 255,
	                   * 255 without a sample */
	uint8_t *weight;  /* width * height, round(255 * weight) before the fill ([G] 4.6); 255 where nothing is and nothing
	                   * covers */
	uint64_t *words;  /* width * height, as warped: bits of the float z' in world units << 32 | sample id, which is
	                   * 64 * (block, counted over all instances' models) + place in the block;
	                   * 7F800000FFFFFFFF without a sample */
	struct psr_report report; /* psr_render() fills it; a client leaves it 0: the daemon's stands in psr_event.end */
};

/* Gives the frame memory for the planes: 1 << enum psr_plane, OR-ed, at least one. The pixels are not set. ARG, LIMIT,
 * MEMORY; then there is nothing to free. */
int psr_frame_alloc(struct psr_frame *frame, uint32_t width, uint32_t height, unsigned planes, struct psr_error *err);

/* Frees the planes of psr_frame_alloc() or psr_client_draw() and zeroes the frame. A frame of zeros is fine. */
void psr_frame_free(struct psr_frame *frame);

void *psr_frame_plane(const struct psr_frame *frame, unsigned plane); /* its pixels; NULL if it is left out */
const char *psr_plane_name(unsigned plane); /* "color", "depth", "normal", "id", "weight", "words", "block" */
size_t psr_plane_bytes(unsigned plane);     /* of a pixel */

/* XXH64 of a plane's bytes, seed 0: what `psr shot --hash` prints. The frame has the plane. */
uint64_t psr_frame_hash(const struct psr_frame *frame, unsigned plane);

/* Writes the colours as a PNG of 8 bits a channel with an sRGB chunk. `path` holds either its old content or the whole
 * picture; "-" is standard output. ARG: the frame has no colour; NOT_FOUND: no such folder; IO, MEMORY. */
int psr_image_write(const struct psr_frame *frame, const char *path, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
