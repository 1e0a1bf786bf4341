/* Warnings about pictures, on standard error. */
#ifndef PSR_CLIENT_OUTPUT_NOTES_H
#define PSR_CLIENT_OUTPUT_NOTES_H

#include "client/scene/scene.h"

/* Collected over all pictures of a command; each warning is printed once. */
struct notes {
	uint32_t n_pictures, n_empty, n_fewer_passes;
	unsigned least_pass;
	const char *why_empty;   /* of the last one */
	double coarsest;         /* pixels between samples of the model that is magnified most */
	const struct scene_model *coarsest_model;
};

void notes_add(struct notes *notes, const struct scene *scene, const struct psr_msg_frame *asked,
               const struct psr_event *event);

void notes_print(const struct notes *notes, const char *program, const struct psr_msg_frame *asked);

/* Pixels between neighbouring samples of instance i at its nearest visible part; 0: it is not visible. */
double notes_magnification(const struct scene *scene, uint32_t i, const struct psr_msg_camera *camera, uint32_t width,
                           uint32_t height);

#endif
