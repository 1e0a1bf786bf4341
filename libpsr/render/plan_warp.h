/* What the warp of an instance needs, by representation: the way from inner coordinates to camera space. */
#ifndef PSR_RENDER_PLAN_WARP_H
#define PSR_RENDER_PLAN_WARP_H

#include "plan.h"

/* to_camera: to camera space, rows of an inner unit's length there; center: of inner coordinates, in camera space. */
void plan_lattice(struct warp_lattice *out, const struct psr_projection *projection, double to_camera[3][3],
                  const double center[3], const struct plan *plan, double focal);
/* The same for the places of cubes; out->model is set. */
void plan_cubes(struct warp_cubes *out, double to_camera[3][3], const double center[3], const struct plan *plan,
                double focal);
/* The same for differential points. turn: to_camera without its scale. */
void plan_points(struct warp_points *out, double to_camera[3][3], double turn[3][3], const double center[3],
                 const struct plan *plan, double focal);

/* Finds a pixel's line of sight in inner coordinates, of length 1 along the view axis. */
void plan_sight(struct warp_instance *out, double turn[3][3], const struct plan *plan, double focal);

#endif
