/* The report of a frame, as `psr shot --report` writes it: how the frame was drawn. */
#ifndef MODELS_ACCURACY_REPORT_H
#define MODELS_ACCURACY_REPORT_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/scene.h"

struct accuracy_report {
	struct psr_camera camera;
	double spacing;        /* of the model's samples, units of the source file */
	double spacing_px;     /* that the frame asked for */
	uint32_t width, height;
	int is_smooth, is_fine;
};

/* Reads a report. NOT_FOUND, IO; FORMAT: it is not a report; UNSUPPORTED: the picture shows several models, or one that
 * was moved; MEMORY. */
int accuracy_report_read(struct accuracy_report *out, const char *path, struct psr_error *err);

#endif
