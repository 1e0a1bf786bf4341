/* The samples that are kept, by place: S of [G] 5.2. */
#ifndef PSR_SAMPLE_OWN_KEPT_H
#define PSR_SAMPLE_OWN_KEPT_H

#include <stddef.h>
#include <stdint.h>
#include "base/vec.h"

struct cover_point {
	float position[3];
	uint16_t normal;     /* psr/direction.h: what is turned away from the viewer does not count, */
	uint8_t two_sided;   /* unless this is set */
	uint8_t traits;      /* psr/model.h. Bent: `attr` has another normal, which is shaded and does not tell facing */
	uint8_t sample;      /* whose it is: projection, patch, sample */
	uint32_t projection, patch;
	uint32_t next;       /* of the same cell */
	uint64_t attr;       /* psr/model.h */
};

struct cover {
	double ds;           /* cells are as wide as a pixel */
	struct cover_point *point;
	uint32_t n_points, capacity;
	struct cover_brick *table;
	size_t n_bricks, table_size;
};

int cover_init(struct cover *cover, double ds); /* MEMORY; cover_fini() either way */
void cover_fini(struct cover *cover);
int cover_add(struct cover *cover, const struct cover_point *point); /* `next` is set here; MEMORY */

#define COVER_NONE UINT32_MAX

/* First point of the cell of integer coordinates at (position / ds, rounded down); COVER_NONE. */
uint32_t cover_cell(const struct cover *cover, const int at[3]);

/* First points of all cells with any that the cube of half-side radius <= 4 ds around p touches; returns how many. */
#define COVER_MOST_AROUND 729
int cover_around(const struct cover *cover, const float p[3], double radius, uint32_t first[COVER_MOST_AROUND]);

/* Whether a point that faces like n lies within radius <= ds of p. */
int cover_is_near(const struct cover *cover, const float p[3], const float n[3], double radius);

/* The same of one sample on a sheet that is sampled once for both sides, whose normal at p is n: along the sheet as far
 * as radius, and across it, too, as pixels see that foreshortened; between, where 0.6 across^2 + along^2 <=
 * radius^2. */
static inline int cover_is_sheet_near(const float sample[3], const float p[3], const float n[3], float radius)
{
	float d[3], across, distance2;

	v3f_sub(d, sample, p);
	across = v3f_dot(d, n);
	distance2 = v3f_dot(d, d);
	return across * across <= radius * radius && distance2 - 0.4f * across * across <= radius * radius;
}

#endif
