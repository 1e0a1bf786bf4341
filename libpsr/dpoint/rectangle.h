/* A candidate's rectangle, as cells see it. */
#ifndef PSR_DPOINT_RECTANGLE_H
#define PSR_DPOINT_RECTANGLE_H

#include "base/vec.h"
#include "cell_tree.h"

struct looking {
	const struct dpoint_surface *surface;
	const struct dpoint_cover_options *options;
	const struct cell_tree *tree;
	float cosine, chord; /* of options->angle; chord: 2 sin(angle / 2), at most 0.6 */
	float sure_sine2, sure_cosine2; /* rectangle_surely_suits() */
};
void looking_init(struct looking *l, const struct dpoint_surface *surface, const struct cell_tree *tree,
                  const struct dpoint_cover_options *options);

/* Finds the normal of a cell's plane, on the side of its own normal; 0,0,0 where it has no area. */
void cell_plane(float normal[3], const struct dpoint_cell *cell);

float cell_area(const struct dpoint_cell *cell);

struct rectangle {
	float at[3], axis[3][3]; /* u, v, normal */
	float slant[3][3];       /* of each of them, how far it goes along x, y and z */
	float extent[2];
	float deep;              /* how far from the tangent plane any of its cells may be */
	float height;            /* how far from S_p */
	float lambda_u, rho;
	uint32_t part;
	uint64_t attr;
	uint8_t look[LOOK_CHANNELS]; /* that of attr */
};

void rectangle_of(struct rectangle *r, const struct dpoint_candidate *c, const struct dpoint_cover_options *options);

/* Shortens the extents to what may count as covered (struct dpoint_cover). */
void rectangle_shorten(struct rectangle *r, float slack);

/* Finds the least delta of a class whose rectangle, shortened, is over all corners of a cell. Returns 0 if there is
 * none. */
int rectangle_around(float delta[2], const struct dpoint_candidate *c, const struct dpoint_cell *cell,
                     const struct dpoint_cover_options *options);

/* A place in the frame of the rectangle. */
static inline void rectangle_sees(float at[3], const struct rectangle *r, const float p[3])
{
	float away[3];

	v3f_sub(away, p, r->at);
	m3f_apply(at, (const float (*)[3])r->axis, away);
}

/* Whether in the cell's middle, `at` in the rectangle's frame, height and normal are S_p's, and
 * its look is the point's, as the options say. */
int rectangle_suits(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell,
                    const float at[3]);

/* The same, where it is known how far from S_p the middle is. */
int rectangle_suits_off(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell,
                        const float at[3], float off);

/* Returns 1 only if rectangle_suits() does, by a bound that needs no root and no division; for cells of another look or
 * part it is 0.
 *
 * With w the sine that [K] (5) takes the arc of, and |w| <= |lambda_u| r <= 1/4: the height of S_p is
 * q / (1 + sqrt(1 - w^2)) with q = lambda_u (u^2 + rho v^2), and so within 0.14 |q| w^2 of q / 2. asin w / w is at most
 * 1 + 0.172 w^2, so that the normal of [K] (6) is within 0.18 |w|^3 of (-lambda_u u, -lambda_v v, 1): that is a
 * sixteenth of the angle at most, and an eighth is left. Places are off by 3e-7, which turns a normal by 3e-4 where
 * lambda_u is 1000. */
static inline int rectangle_surely_suits(const struct looking *l, const struct rectangle *r,
                                         const struct dpoint_cell *cell, const float at[3])
{
	const float u2 = at[0] * at[0], v2 = at[1] * at[1], lambda_v = r->lambda_u * r->rho;
	const float q = r->lambda_u * u2 + lambda_v * v2, w2 = r->lambda_u * r->lambda_u * (u2 + v2);
	const float n[3] = { -r->lambda_u * at[0], -lambda_v * at[1], 1 };
	float normal[3], dot;

	if (!(w2 <= l->sure_sine2 && fabsf(at[2] - 0.5f * q) + 0.15f * fabsf(q) * w2 + 2e-6f <= r->height) ||
	    cell->part == DPOINT_BEYOND || cell->attr != r->attr || fabsf(r->lambda_u) > 1000)
		return 0;
	m3f_apply(normal, (const float (*)[3])r->axis, cell->normal);
	dot = v3f_dot(n, normal);
	return dot > 0 && dot * dot >= l->sure_cosine2 * v3f_dot(n, n);
}

/* Whether all corners are within the extents, and the cell suits. */
int rectangle_covers(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell);

/* Whether those of a sphere may suit as a whole: what its size alone is too much for needs no look at the node. */
static inline int rectangle_may_suit(const struct looking *l, const struct rectangle *r, float radius)
{
	const float turn = 1.6f * radius * fabsf(r->lambda_u);

	return !(turn > l->chord || 1.2f * turn * radius > r->height);
}

/* Whether all cells of a node suit, or are covered, told by its sphere, at p in the rectangle's frame, and by its
 * normals and looks alone: 0 may be wrong. */
int rectangle_suits_node(const struct looking *l, const struct rectangle *r, size_t node, const float p[3]);
int rectangle_covers_node(const struct looking *l, const struct rectangle *r, size_t node, const float p[3]);

/* ---- steps of dpoint_simplify() ---- */

struct dpoint_work {
	struct psr_pool *pool;
	const struct psr_cancel *cancel;
};

/* dpoint_fit() of the candidates from `first` on. */
int fit_candidates(struct dpoint_surface *surface, const struct cell_tree *tree, size_t first,
                   const struct dpoint_cover_options *options, const struct dpoint_work *work);

/* Shortens delta, by classes, until the quadric over the rectangle is within options->error of the surface's facets. A
 * rectangle that then does not cover its own cell becomes that of `before` around the cell, if that is within the
 * error. MEMORY. */
struct bound_view;
int shrink_within(struct dpoint_candidate *c, const struct dpoint_candidate *before, struct bound_view *view,
                  const struct looking *l);

/* Makes a flat candidate in the plane of a cell, around it. Returns 0 where there is none. */
int plane_over(struct dpoint_candidate *out, const struct dpoint_surface *surface, uint32_t cell,
               const struct dpoint_cover_options *options);

/* Adds a flat candidate in the plane of each cell that is_open is set for, and to the cover. With options->error they
 * keep it, or are left out. MEMORY, CANCELLED. */
int mend_planes(struct dpoint_surface *surface, struct dpoint_cover *cover, const uint8_t *is_open,
                const struct dpoint_cover_options *options, const struct dpoint_work *work);

/* Gives each kept candidate the mean look of the cells that it covers: within options->looks of those that are so near to
 * its own. */
void paint(struct dpoint_surface *surface, const struct dpoint_choice *choice, const struct dpoint_cover *cover,
           const struct dpoint_cover_options *options);

/* Makes the lists of the surface's candidates that the cover lacks: its last ones. */
int cover_candidates(struct dpoint_cover *cover, const struct dpoint_surface *surface,
                     const struct dpoint_cover_options *options, const struct dpoint_work *work);

#endif
