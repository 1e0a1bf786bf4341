/* Legends: what the colours of --color-by stand for, drawn into a picture. */
#ifndef PSR_CLIENT_OUTPUT_LEGEND_H
#define PSR_CLIENT_OUTPUT_LEGEND_H

#include "client/scene/scene.h"
#include "psr/tint.h"

#define LEGEND_LEAST_WIDTH 160 /* smaller pictures get no legend */
#define LEGEND_LEAST_HEIGHT 120

struct legend {
	enum psr_color_by by;
	double low, high;    /* INTENSITY, HEIGHT: the ends of the ramp; heights in the file's units */
	uint64_t classes[4]; /* CLASS: as in struct psr_scan */
	unsigned orders;     /* RETURN: the same */
};

/* Finds what a frame's colours stand for. Returns 0 if no legend tells it: no instance is coloured by a number, or two
 * are by different ones, or by heights of different models. */
int legend_find(struct legend *legend, const struct scene *scene, const struct psr_msg_frame_end *end);

/* The same where all instances are coloured by the same number. HEIGHT: of this model; NULL: there are several. */
int legend_find_of(struct legend *legend, enum psr_color_by by, const struct psr_msg_opened *model,
                   const struct psr_msg_frame_end *end);

/* Draws it into the lower left corner of width x height pixels, 3 bytes each, on a dark plate that covers three
 * quarters of what is below. Draws nothing where the picture is too small, or the plate does not fit. */
void legend_draw(const struct legend *legend, uint8_t *rgb, uint32_t width, uint32_t height);

#endif
