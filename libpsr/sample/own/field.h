/* Which way the surface faces, at the scale of a few samples: what says which projection owns it. Where it is rough,
 * neighbouring samples would otherwise belong to different projections, and blocks would be full of holes. */
#ifndef PSR_SAMPLE_OWN_FIELD_H
#define PSR_SAMPLE_OWN_FIELD_H

#include <stddef.h>
#include <stdint.h>

#define FIELD_LOBES 6 /* of normals in a cell: by the axis and sign that is greatest in them */

struct field_cell {
	uint64_t key;
	int32_t lobe[FIELD_LOBES][3]; /* sums of normals, times FIELD_ONE: integers, so that the order does not matter */
};
#define FIELD_ONE 256

struct field {
	double cell; /* side of a cubic cell, inner units */
	size_t n_cells, capacity;
	struct field_cell *table;
};

int field_init(struct field *field, double cell); /* MEMORY; field_fini() either way */
void field_fini(struct field *field);

/* A piece of the surface of unit normal n at p; weight: its area, 0..16 in any unit. MEMORY. */
int field_add(struct field *field, const float p[3], const float n[3], float weight);

/* The smoothed normal (not of unit length) at p of what faces like n: n itself where nothing is known. Any number of
 * threads may ask. */
void field_normal(const struct field *field, const float p[3], const float n[3], float out[3]);

#endif
