/* A triangle to pieces: cells, and a candidate in the middle of each. */
#ifndef PSR_DPOINT_CUT_H
#define PSR_DPOINT_CUT_H

#include "bound.h"
#include "corners.h"
#include "mesh.h"

#define CUT_MOST_PARTS 4096 /* of a side */
#define CUT_MOST_PIECES (1u << 22)

struct cutting {
	struct dpoint_surface *surface;
	const struct dpoint_mesh_options *options;
	const struct corner *corner[3];
	uint32_t triangle, material;
	struct bound_view *view; /* what the bound of options->cover is looked at through; NULL: it is not asked for */
	uint32_t n, grains;  /* parts of the longest side, and how many grains each has: a power of two */
	uint32_t ratio;      /* the shortest side has n / ratio parts, and the other one n */
	uint32_t units;      /* of a grain: likewise */
	double least_cosine; /* of normals along the side of a piece of more units than `least_turned` */
	uint32_t least_turned;
	int apex, along;     /* the corner that is opposite of the longest side; the one that x runs to, along n parts */
	int side;            /* the one that directions follow where any would do */
};

/* Tells the rest of `c` from its corners, triangle and material. A side in `is_open` (bits) is followed first. Returns
 * in how many parts the longest side would have to be cut, which may be more than CUT_MOST_PARTS. */
double cut_plan(struct cutting *c, unsigned is_open);

/* In how many parts a side is cut. */
static inline uint32_t cut_parts(const struct cutting *c, int side)
{
	const int across = c->along == (c->apex + 1) % 3 ? (c->apex + 2) % 3 : c->apex;

	return side == across ? c->n / c->ratio : c->n;
}

/* Adds the pieces: parallelograms along the two shorter sides, and what the longest one leaves of them along it. Where
 * looks differ they are quarters, and so on down to grains; where normals turn by more than options->turn, or a
 * rectangle of the piece's own point around it is not within the bound, quarters down to units. MEMORY; LIMIT: more
 * than CUT_MOST_PIECES cells. */
int cut(const struct cutting *c);

#endif
