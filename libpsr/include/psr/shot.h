/* A picture of one model in one call: psr_shot_draw() draws here, psr_client_draw() has psrd draw. Both give the same
 * pixels. psr/render.h has what they are made of: scenes of many models, buffers that are kept, a pool of one's own. */
#ifndef PSR_SHOT_H
#define PSR_SHOT_H

#include "error.h"
#include "frame.h"
#include "model.h"
#include "render.h"
#include "view.h"

#ifdef __cplusplus
extern "C" {
#endif

struct psr_shot {
	struct psr_settings settings;    /* size and quality */
	unsigned planes;                 /* 1 << enum psr_plane, OR-ed; colour */
	const struct psr_camera *camera; /* the caller's; NULL: the whole model is in the picture, see psr_camera_frame() */
	double fov_y;                    /* of that camera: 35 degrees in radians; 0: orthographic */
	const struct psr_light *light;   /* the caller's, n_lights of them; 0: psr_light_key()'s */
	uint32_t n_lights;
	double ambient;                  /* 0..1e6: 0.15; light from everywhere, times diffuse colour */
	uint8_t background[3];           /* sRGB: 20 24 28 in hexadecimal */
};
void psr_shot_default(struct psr_shot *shot, uint32_t width, uint32_t height);

/* Draws the model where it stands, on all cores, into a new frame, which the caller frees (psr_frame_free()). ARG,
 * LIMIT, MEMORY; the frame is zero then. */
int psr_shot_draw(const struct psr_shot *shot, struct psr_model *model, struct psr_frame *frame, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
