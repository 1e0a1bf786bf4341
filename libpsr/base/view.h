/* Checks of cameras and lights, in scenes and in the presets of models. */
#ifndef PSR_BASE_VIEW_H
#define PSR_BASE_VIEW_H

#include "psr/error.h"
#include "psr/view.h"

/* Finite and of magnitude at most 1e30; false for NaN too. */
int view_is_point(const double v[3]);
/* Components from 0 to 1e9. */
int view_is_light(const double v[3]);

/* Check the promises of psr/view.h, and limits that keep arithmetic in range. Ignore fields that the kind does not use.
 * ARG; the text lacks the owner of the camera or light. */
int view_check_camera(const struct psr_camera *camera, struct psr_error *err);
int view_check_light(const struct psr_light *light, struct psr_error *err);

#endif
