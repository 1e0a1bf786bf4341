/* Warnings about pictures, on standard error. */
#ifndef PSR_CLIENT_OUTPUT_NOTES_H
#define PSR_CLIENT_OUTPUT_NOTES_H

#include "client/scene/scene.h"

/* Collects warnings over all pictures of a command, and prints each once. */
struct notes {
	uint32_t n_pictures, n_empty, n_fewer_passes, n_over;
	unsigned least_pass;
	const char *why_empty;   /* of the last picture */
	double coarsest;         /* pixels between samples of the most magnified model */
	const struct scene_model *coarsest_model;
};

void notes_add(struct notes *notes, const struct scene *scene, const struct psr_msg_frame *asked,
               const struct psr_event *event);

void notes_print(const struct notes *notes, const char *program, const struct psr_msg_frame *asked);

/* Returns the pixels between neighbouring samples of instance i at its nearest visible part; 0: it is not visible. */
double notes_magnification(const struct scene *scene, uint32_t i, const struct psr_camera *camera, uint32_t width,
                           uint32_t height);

#endif
