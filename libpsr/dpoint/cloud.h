/* Clouds of points to candidates and cells. */
#ifndef PSR_DPOINT_CLOUD_H
#define PSR_DPOINT_CLOUD_H

#include "surface.h"

#define DPOINT_MOST_NEAR 16
#define DPOINT_MOST_CLOUD (1u << 22) /* points */

struct dpoint_cloud {
	uint32_t n, k;            /* points; neighbours of each, less than n, at most DPOINT_MOST_NEAR */
	const double (*at)[3];    /* inner units */
	const float (*normal)[3]; /* of unit length; which side is the front, and about where it faces */
	const float *radius;      /* of a disc over all that is nearer to the point than to its neighbours; > 0 */
	const uint32_t *near;     /* n * k, nearest first */
	const uint32_t *part;     /* of each point */
	const uint64_t *attr;     /* without a normal */
};

struct dpoint_cloud_report {
	uint32_t n_flat;          /* points whose neighbours tell no curvature: too few, along a line */
	int is_closed;            /* it ends nowhere, and neighbours face the same side: there is an outside */
};

/* Adds, for each point, a candidate, a cell and four facets. The cell is the square around the point's disc, on the
 * tangent plane: squares overlap, and leave no gap where discs leave none.
 *
 * Place, normal and curvatures are those of a polynomial over the neighbours (shape.h). Where its residuals are so large
 * that normals over a rectangle might be off by cover->angle, it is tried over the neighbours' neighbours, too: noise
 * does not grow with the distance. Where residuals do grow there is a crease: then the point is taken to the polynomial
 * of that neighbour which it fits best, as in methods that are essentially non-oscillatory (Harten and others, 1987). A
 * point that tells no curvature is flat, with the normal that it came with. A point moves by half its radius at most,
 * and by half of cover->error if there is one. Facets are where points were: so an error counts what noise was smoothed.
 *
 * Beside points without neighbours over 150 degrees there is a strip that no rectangle may be over. MEMORY. */
int dpoint_sample_cloud(struct dpoint_surface *surface, struct dpoint_cloud_report *report,
                        const struct dpoint_cloud *cloud, const struct dpoint_cover_options *cover, float delta,
                        struct psr_pool *pool);

#endif
