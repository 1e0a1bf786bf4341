/* What differential points are chosen from, and what they have to cover: the surface in small cells. */
#ifndef PSR_DPOINT_SURFACE_H
#define PSR_DPOINT_SURFACE_H

#include <stddef.h>
#include <stdint.h>
#include "base/pool.h"
#include "dpoint.h"
#include "facets.h"
#include "psr/error.h"

/* A piece of the surface: a convex quadrilateral, or a triangle, whose last corners are one. */
struct dpoint_cell {
	float corner[4][3];
	float normal[3];   /* in its middle, of unit length; 0,0,0 where there is none, at poles */
	uint32_t part;     /* of the source: a patch, a material; or DPOINT_BEYOND */
	uint64_t attr;     /* of points in it, without a normal */
};

static inline void dpoint_cell_middle(float m[3], const struct dpoint_cell *cell)
{
	for (int k = 0; k < 3; k++)
		m[k] = 0.25f * (cell->corner[0][k] + cell->corner[1][k] + cell->corner[2][k] + cell->corner[3][k]);
}

/* The part of a cell that is no surface: the strip beside a border, which no rectangle may be over (dpoint_fit()), and
 * none covers. */
#define DPOINT_BEYOND (UINT32_MAX - 1)

struct dpoint_candidate {
	struct dpoint point;
	float delta[2];    /* as in struct dpoint_limit */
	uint32_t part;
	uint32_t cell;     /* that its place is in */
};

/* Half sides of the candidate's rectangle at this sine of epsilon. */
static inline void dpoint_candidate_extent(float extent[2], const struct dpoint_candidate *c, float sine)
{
	const struct dpoint_limit limit = { sine, { c->delta[0], c->delta[1] } };

	dpoint_extent(extent, &c->point, &limit);
}

/* A triangle whose corners' normals lean from it: rectangles on them stand as the slats of a blind do. */
struct dpoint_face {
	float corner[3][3], normal[3][3];
	float bend[3];              /* of the side from a corner to the next: the sine of the angle to the next face; 1 from a
	                             * right one on, and where there is a crease, or no such face */
	uint32_t part, first_cell, n_cells;
	uint32_t twin;              /* which face makes it a rectangle, beyond its side `shared`; UINT32_MAX: none does */
	int shared;
};

struct dpoint_surface {
	struct dpoint_cell *cell;
	struct dpoint_candidate *candidate;
	size_t n_cells, n_candidates, cells_room, candidates_room;
	struct dpoint_face *face;   /* of a mesh: those that may be tiled (lean.h) */
	struct dpoint_lean *lean;   /* of the n_lean candidates from first_lean on */
	size_t n_faces, n_lean, first_lean, faces_room, lean_room;
	uint64_t n_bad, n_clamped;  /* candidates that were left out; whose curvature was brought to the bound */
	struct facets facets;       /* of a mesh or a cloud; of other sources there are none */
	float margin;               /* of its cover's options */
	int is_cloud;               /* cells are as far apart as samples are: what mends one keeps its curvatures */
};

void dpoint_surface_init(struct dpoint_surface *surface); /* empty */
void dpoint_surface_fini(struct dpoint_surface *surface);

/* Makes room for so many elements in all. Returns 0 without memory, or if they are more than there may be. */
int dpoint_surface_reserve(struct dpoint_surface *surface, size_t n_cells, size_t n_candidates, size_t n_facets);

/* Add one element, cells of zeros. Return NULL without memory. */
struct dpoint_cell *dpoint_surface_cell(struct dpoint_surface *surface);
struct dpoint_candidate *dpoint_surface_candidate(struct dpoint_surface *surface);

/* Makes the candidate of a local shape, rounded to what a word holds but for its place. NULL: there is no shape, which
 * is DPOINT_BAD. like: its delta, part, cell and attributes. */
enum dpoint_made dpoint_candidate_make(struct dpoint_candidate *out, const struct dpoint_local *local,
                                       const struct dpoint_candidate *like);

/* Makes a candidate, and adds it; counts what is left out. MEMORY. */
int dpoint_surface_put(struct dpoint_surface *surface, const struct dpoint_local *local,
                       const struct dpoint_candidate *like);

/* ---- coverage ---- */

struct dpoint_cover_options {
	float sine;        /* of epsilon: dpoint_sine() */
	float slack;       /* what rounding of places may take from an extent */
	float angle;       /* radians: the normal of [K] (6) may be off by so much in the middle of a cell; pi: by anything
	                    * below a right angle */
	float height;      /* S_p may be off by so much there; and by half of the shorter extent at most */
	int is_within_parts; /* points cover cells of their own part alone, as in [K] 6 */
	float overhang;    /* dpoint_fit(): how far a rectangle may reach over what it does not suit */
	int looks;         /* a cell may differ from the point by so many 255ths of a channel (look.h), 0..255 */
	float error;       /* above 0: dpoint_fit() and dpoint_mend() keep the quadric over the rectangle within this distance
	                    * of the surface's facets, as bound.h proves it, before places are packed */
	/* Rectangles cover less than they are by this part of an extent where nothing ended it: by epsilon, or at `delta`.
	 * So neighbours overlap, and what words tilt them by is no gap from aslant. */
	float margin, delta;
	float graze;       /* that slanted rays may count on (seal.h): half of what is drawn; 0: none */
	float slit;        /* of faces whose corners are further apart along the normal of one, those that are seen through
	                    * are tiled (lean.h); 0: none */
	const uint8_t *is_two_sided; /* by part: rectangles that are seen from both sides; NULL: none is */
};

static inline int dpoint_is_two_sided(const struct dpoint_cover_options *options, uint32_t part)
{
	return options->is_two_sided != NULL && options->is_two_sided[part];
}

/* Which cells each candidate covers. A candidate covers a cell whose corners all are within its rectangle, seen along
 * its normal, where the rectangle is shortened by the cosine of its sine: the tangent planes of two points on a circle
 * meet at r tan a, above a place that is r sin a from both. So rectangles that cover neighbouring places cross, and
 * leave no gap from any side. */
struct cell_tree;
struct dpoint_cover {
	size_t n_candidates, n_cells;
	const uint32_t **list;   /* of a candidate: nodes of the tree, all of whose cells it covers, each once */
	uint32_t *n;
	uint32_t *size;          /* how many cells these have */
	struct cell_tree *tree;  /* cell_tree.h; NULL without cells or candidates */
	void **chunk;            /* what the lists are in */
	size_t n_chunks;
};

static inline size_t dpoint_cover_size(const struct dpoint_cover *cover, uint32_t candidate)
{
	return cover->size[candidate];
}

/* MEMORY, CANCELLED; dpoint_cover_fini() even then. pool and cancel may be NULL. */
int dpoint_cover_init(struct dpoint_cover *cover, const struct dpoint_surface *surface,
                      const struct dpoint_cover_options *options, struct psr_pool *pool,
                      const struct psr_cancel *cancel);
void dpoint_cover_fini(struct dpoint_cover *cover);

/* Adds a flat candidate over each cell that none covers, and to the cover: of a cloud, one as bent as its point if
 * there is such a one. It reaches over the cell's sides by 3 to 23 % of its size, or to the sides of a rectangle around
 * a triangle: so there is no hole where samples are too far apart for the options, or where a crease is finer than a
 * cell, and what is wrong there is as small as a cell. Left open are cells without an area, and some that are as bent
 * as their sides are long. */
int dpoint_mend(struct dpoint_surface *surface, struct dpoint_cover *cover,
                const struct dpoint_cover_options *options, struct psr_pool *pool, const struct psr_cancel *cancel);

/* Shortens each candidate's delta, along u and along v, until its rectangle is over no cell that S_p does not suit: one
 * of the surface that goes on beside it, where normal, height or look is further off than the options say. So a
 * rectangle ends at a crease, and where curvatures change; its point may move along S_p for that. delta becomes one of
 * dpoint_delta_class(), unless it is as it was. Cells that look the other way, and those of other sheets above or
 * below, shorten nothing. MEMORY, CANCELLED. */
int dpoint_fit(struct dpoint_surface *surface, const struct dpoint_cover_options *options, struct psr_pool *pool,
               const struct psr_cancel *cancel);

/* Returns the class of the greatest delta that is at most this one, or the last class. */
unsigned dpoint_delta_class(float delta);

/* ---- simplification ([K] 4.2) ---- */

struct dpoint_choice {
	uint8_t *is_kept;        /* of each candidate */
	size_t n_kept, n_holes;  /* n_holes: cells that no candidate covers, kept or not */
};

/* Chooses few candidates that cover every cell that any of them covers. A front sweeps along the longest side: the
 * first cell that is not covered yet gets, of the candidates that cover it, the one that covers most that is not. Those
 * that others made superfluous are pruned, and kept ones exchanged for others where one takes the place of several. The
 * same for any pool. MEMORY; dpoint_choice_fini() even then. */
int dpoint_choose(struct dpoint_choice *choice, const struct dpoint_cover *cover);

void dpoint_choice_fini(struct dpoint_choice *choice);

/* All of it: fits candidates, mends holes, chooses, tiles faces that their normals lean from (lean.h), and keeps or adds
 * points where slanted rays would slip through (seal.h). Candidates come in two turns: of the first, every `sparse`-th
 * at random (1: all), and fewer of those whose rectangles are many cells wide; then those in cells that none of these
 * covers, and some of those in cells that one alone covers; others are dropped. For candidates that are much closer than
 * their rectangles are wide, which takes so much less time.
 * MEMORY, CANCELLED; the caller ends cover and choice even then. */
int dpoint_simplify(struct dpoint_choice *choice, struct dpoint_cover *cover, struct dpoint_surface *surface,
                    const struct dpoint_cover_options *options, uint32_t sparse, struct psr_pool *pool,
                    const struct psr_cancel *cancel);

/* ---- how good a choice is ---- */

/* Normals are compared in the middle of each cell, by [K] (6), with those of the cells; heights are S_p's. Each kept
 * point counts for each cell that it covers: any of them may be seen. Cells of no point, and poles, do not count. */
struct dpoint_errors {
	double normal_rms, normal_worst; /* radians */
	double height_rms, height_worst; /* inner units */
	double overlap;                  /* kept points a covered cell */
};
int dpoint_measure(struct dpoint_errors *errors, const struct dpoint_surface *surface, const struct dpoint_cover *cover,
                   const struct dpoint_choice *choice, struct psr_pool *pool); /* MEMORY; pool may be NULL */

/* How far the kept points' quadrics are from the surface's facets, over all of their rectangles. */
struct dpoint_bounds {
	size_t n_over;     /* points for which options->error is not shown to hold */
	double worst;      /* no place is further off, before packing; at most 1/16 and 1e-5 too great; 0 without facets */
};
int dpoint_bounds_measure(struct dpoint_bounds *bounds, const struct dpoint_surface *surface,
                          const struct dpoint_choice *choice, const struct dpoint_cover_options *options,
                          struct psr_pool *pool); /* MEMORY */

#endif
