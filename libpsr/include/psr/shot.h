/* A picture of one model in one call: psr_shot_draw() draws it here, psr_client_draw() has psrd draw it. Both give the
 * same pixels. psr/render.h has the parts: scenes of many models, buffers that are kept, a pool of one's own. */
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
	struct psr_settings settings;    /* size and quality; by default with smooth edges */
	unsigned planes;                 /* 1 << enum psr_plane, OR-ed; by default colour alone */
	const struct psr_camera *camera; /* the caller's; NULL, the default: the camera of psr_camera_frame(), which
	                                  * shows the whole model */
	double fov_y;                    /* of the default camera: 35 degrees in radians; 0: orthographic */
	const struct psr_light *light;   /* the caller's, n_lights of them; by default 0, which stands for one light of
	                                  * psr_light_key() */
	uint32_t n_lights;
	double ambient;                  /* light from everywhere: white shows it as it is; 0..1e6; 0.15 by default */
	uint8_t background[3];           /* sRGB; 20 24 28 in hexadecimal by default */
};
void psr_shot_default(struct psr_shot *shot, uint32_t width, uint32_t height);

/* Draws the model untransformed, on all cores, into a new frame, which the caller frees (psr_frame_free()). ARG, LIMIT,
 * MEMORY; after a failure the frame is zero. */
int psr_shot_draw(const struct psr_shot *shot, struct psr_model *model, struct psr_frame *frame, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
