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
#define PSR_MAX_PIXELS (64u << 20)  /* in one frame */

enum psr_plane {
	PSR_PLANE_COLOR, PSR_PLANE_DEPTH, PSR_PLANE_NORMAL, PSR_PLANE_ID, PSR_PLANE_WEIGHT, PSR_PLANE_WORDS,
	PSR_PLANE_BLOCK, PSR_PLANE_BOUND,
	PSR_N_PLANES
};

/* How a drawn block faces the eye, as far as the cull found out ([G] 6.4, 7.3.2). */
enum psr_facing {
	PSR_FACING_EYE,       /* its cone faces the eye, and with it all samples; or the block is bent, and a part may
	                       * face the eye */
	PSR_FACING_MIXED,     /* some samples may face away: the renderer tested each */
	PSR_FACING_TWO_SIDED, /* faces both ways: the renderer tested no sample */
};

#define PSR_BOUND_ONE 256

/* Rows run from the top down, without gaps. A NULL plane is left out. Depth, normal, id and block describe the sample
 * that a pixel shows: of the nearest translucent surface where translucent surfaces hold back at least half of the
 * light, else of the opaque surface behind them. A pixel of weight 0 shows no sample, even if the fill gave it colour
 * and depth. */
struct psr_frame {
	uint32_t width, height; /* pixels, 1..PSR_MAX_SIDE */
	uint8_t *rgb;     /* 3 * width * height, sRGB; NULL: the renderer computes no light */
	float *depth;     /* width * height, z' in world units along the view, +inf in an empty pixel */
	int16_t *normal;  /* 3 * width * height, world space, round(32767 * n), turned to the eye where the block is
	                   * two-sided; 0, 0, 0 without a sample */
	uint32_t *id;     /* width * height, index of the instance; UINT32_MAX without a sample */
	uint8_t *block;   /* 3 * width * height: level in the model, level of the depth buffer, enum psr_facing; 255, 255,
	                   * 255 without a sample */
	uint16_t *bound;  /* width * height: how far the pixel's centre, at its depth, may be from the surface, in steps of
	                   * PSR_BOUND_ONE a pixel, rounded up; UINT16_MAX: more than that. Of pixels that take their depth
	                   * from cells of the fill, the frame's bound (report.error_px). 0 where nothing is */
	uint8_t *weight;  /* width * height, round(255 * weight) before the fill ([G] 4.6); 255 where the pixel is empty
	                   * and no cell covers it, and where the sample's surface is translucent */
	uint64_t *words;  /* width * height, as warped, of opaque surfaces alone: bits of the float z' in world units
	                   * << 32 | sample id, which is 64 * (block, counted over all instances' models) + place in the
	                   * block; 7F800000FFFFFFFF without a sample */
	struct psr_report report; /* filled in by psr_render(); a client leaves it 0, and gets the daemon's report in
	                           * psr_event.end */
};

/* Allocates planes, a set of bits 1 << enum psr_plane, at least one. Leaves their pixels unset. ARG, LIMIT, MEMORY;
 * after a failure there is nothing to free. */
int psr_frame_alloc(struct psr_frame *frame, uint32_t width, uint32_t height, unsigned planes, struct psr_error *err);

/* Frees the planes of psr_frame_alloc() or psr_client_draw() and zeroes the frame. A frame of zeros is fine. */
void psr_frame_free(struct psr_frame *frame);

void *psr_frame_plane(const struct psr_frame *frame, unsigned plane); /* the plane's pixels; NULL if it is left out */
const char *psr_plane_name(unsigned plane); /* "color", "depth", "normal", "id", "weight", "words", "block", "bound" */
size_t psr_plane_bytes(unsigned plane);     /* a pixel */

/* Computes the hash of a plane, which the frame must have: XXH64, seed 0, of the little-endian XXH64s of its strips of
 * 128 rows from the top; the last strip may be shorter. `psr shot --hash` prints it. */
uint64_t psr_frame_hash(const struct psr_frame *frame, unsigned plane);

/* Writes the colours as a PNG of 8 bits a channel with an sRGB chunk. A file at `path` keeps its old content unless the
 * whole picture could be written; "-" is standard output. ARG: the frame has no colour; NOT_FOUND: no such folder; IO,
 * MEMORY. */
int psr_image_write(const struct psr_frame *frame, const char *path, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
