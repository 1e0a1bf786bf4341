/* Smoothed normals, at the scale of a few samples, which decide ownership: where the surface is rough, its own normals
 * would give neighbouring samples to different projections. */
#ifndef PSR_SAMPLE_OWN_FIELD_H
#define PSR_SAMPLE_OWN_FIELD_H

#include "base/table.h"

struct field {
	double width; /* of a cubic cell, inner units */
	struct table cells;
};

int field_init(struct field *field, double width); /* MEMORY; field_fini() either way */
void field_fini(struct field *field);

/* Adds a piece of the surface of unit normal n at p; weight: its area, 0..16 in any unit. The order of pieces does not
 * matter. MEMORY. */
int field_add(struct field *field, const float p[3], const float n[3], float weight);

/* Finds the smoothed normal (not of unit length) at p of the surface that faces like n: n itself where the field is
 * empty. Any number of threads may call it. */
void field_normal(const struct field *field, const float p[3], const float n[3], float out[3]);

#endif
