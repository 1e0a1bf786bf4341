/* Checks cameras and lights, of scenes and of models' presets. */
#ifndef PSR_BASE_VIEW_H
#define PSR_BASE_VIEW_H

#include "psr/error.h"
#include "psr/view.h"

/* Returns whether x is finite and of magnitude at most 1e30; 0 for NaN. */
int view_is_point(const double v[3]);
/* Returns whether all components are from 0 to 1e9. */
int view_is_light(const double v[3]);

/* Check the promises of psr/view.h, and limits that keep arithmetic in range. Ignore fields that the kind does not use.
 * ARG, with a text that does not name the camera or light: callers do. */
int view_check_camera(const struct psr_camera *camera, struct psr_error *err);
int view_check_light(const struct psr_light *light, struct psr_error *err);

/* Words for the kinds, by enum psr_camera_kind ("perspective", ...) and enum psr_light_kind ("spot", ...). */
extern const char *const view_camera_kinds[2], *const view_light_kinds[3];

#endif
