/* The kept samples, by place: S of [G] 5.2. */
#ifndef PSR_SAMPLE_OWN_KEPT_H
#define PSR_SAMPLE_OWN_KEPT_H

#include "base/grid.h"
#include "base/vec.h"

struct kept_sample {
	float position[3];
	uint16_t normal;     /* base/direction.h: a sample that faces away does not count */
	uint8_t two_sided;   /* set: it counts from both sides */
	uint8_t traits;      /* model/blocks.h. Bent: `attr` has another normal, for shading alone */
	uint8_t sample;      /* its place in this patch: */
	uint8_t opacity;     /* model/blocks.h; of thin things, else PSR_OPAQUE */
	uint32_t projection, patch;
	uint32_t next;       /* next sample of the same cell */
	uint64_t attr;       /* model/blocks.h */
};

struct kept {
	struct grid grid; /* of cells as wide as a pixel */
	struct kept_sample *sample;
	uint32_t n, capacity;
};

/* A kept sample within so many pixels of a place lies in every pixel that is centred there. */
#define KEPT_NEAR 0.5

int kept_init(struct kept *kept, double ds); /* MEMORY; kept_fini() either way */
void kept_fini(struct kept *kept);
int kept_add(struct kept *kept, const struct kept_sample *sample); /* sets sample->next; MEMORY */

/* Returns whether a sample covers a place p that faces like n: it is within radius <= ds and faces like n, too. */
int kept_covers(const struct kept *kept, const float p[3], const float n[3], double radius);

/* Returns whether one sample covers a place p of normal n on a sheet that is sampled once for both sides: it is within
 * radius across the sheet, which pixels see foreshortened, and 0.6 across^2 + along^2 <= radius^2. */
static inline int kept_covers_sheet(const float sample[3], const float p[3], const float n[3], float radius)
{
	float d[3], across, distance2;

	v3f_sub(d, sample, p);
	across = v3f_dot(d, n);
	distance2 = v3f_dot(d, d);
	return across * across <= radius * radius && distance2 - 0.4f * across * across <= radius * radius;
}

#endif
