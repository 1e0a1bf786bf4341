/* Surfaces that lie close beneath others: a table under its cloth, a panel under its label. */
#ifndef PSR_SAMPLE_VISIBLE_BURIED_H
#define PSR_SAMPLE_VISIBLE_BURIED_H

#include "ray/ray.h"

/* Returns whether another surface lies less than 0.75 ds above p, along n (unit, on the side that counts), and of 64
 * rays to p from outside, less than 72 degrees off n, none arrives. Only views that nearly graze the surface show it,
 * through a slit less than a pixel high. Finding out takes one short ray of most places. */
int is_buried(const struct ray_scene *scene, double ds, const float p[3], const float n[3]);

#endif
