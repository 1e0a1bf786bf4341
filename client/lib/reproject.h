/* Late warping: a received picture with depth, drawn as the present camera would see it. A viewer shows such pictures
 * at display rate until the true one comes.
 *
 * The picture is a set of samples, one a pixel. Once a picture they are joined to cells: squares of up to 8x8 pixels in
 * which the inverse of depth (orthographic: depth) is a plane. A camera's picture of such a cell is an exact projective
 * map of it; the nearest one is kept a pixel. Gaps that open between surfaces are filled from the farther end. The
 * received background shows only where some of it was seen between what now borders it, or at the rim of the picture.
 *
 * Highlights, and light that moves with the camera, stick to surfaces: a picture that is warped far is not true. Pixels
 * beyond the received rim are not known: receive a larger picture with a wider angle (overscan) to have them. */
#ifndef PSR_CLIENT_LIB_REPROJECT_H
#define PSR_CLIENT_LIB_REPROJECT_H

#include <stdint.h>
#include "psr/frame.h"
#include "psr/pool.h"
#include "psr/view.h"

struct psr_reproject;

/* Shares are of the drawn picture's pixels. */
struct psr_reproject_stats {
	double ms;          /* by the clock */
	double covered;     /* share that shows a surface of the received picture, 0..1 */
	double filled;      /* share that was in a gap, or beyond the rim, and got a surface's colour */
	uint32_t n_cells;   /* of the received picture */
	int is_copy;        /* camera and size are those of the received picture: nothing was warped */
};

/* One thread at a time may use it; two of them may be used at once, such as one that takes while the other draws.
 * MEMORY. */
int psr_reproject_create(struct psr_reproject **out, struct psr_error *err);
void psr_reproject_destroy(struct psr_reproject *reproject); /* NULL is fine */

/* Takes a picture with colour and depth of 1..PSR_MAX_SIDE pixels a side, and the camera that it was drawn for; nothing
 * of them is needed afterwards. Depth as psr_client_wait() gives it: z' in world units, whether it came as floats or as
 * u16. Pixels whose depth is not within 1e-30..1e30 have no surface and are background, of the colour `background`
 * (sRGB). pool: NULL for the caller's thread alone.
 * ARG: no colour or no depth, a camera out of its ranges (psr/view.h); LIMIT; MEMORY. The picture before stays then. */
int psr_reproject_take(struct psr_reproject *reproject, const struct psr_frame *picture,
                       const struct psr_camera *camera, const uint8_t background[3], struct psr_pool *pool,
                       struct psr_error *err);

/* Draws to->rgb, which is to->width * to->height pixels of the caller (other planes are left alone), as `camera` sees
 * the picture taken last; with its own camera and size that is the picture itself, bit for bit. The same bits with any
 * number of threads and any instructions. stats may be NULL.
 * ARG: nothing was taken, no colour plane, a bad camera; LIMIT, MEMORY. The plane holds anything then. */
int psr_reproject_draw(struct psr_reproject *reproject, const struct psr_camera *camera, struct psr_frame *to,
                       struct psr_pool *pool, struct psr_reproject_stats *stats, struct psr_error *err);

#endif
