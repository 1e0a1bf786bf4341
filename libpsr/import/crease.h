/* Normals of the corners around one point: which share one, and which keep an edge between them. */
#ifndef PSR_IMPORT_CREASE_H
#define PSR_IMPORT_CREASE_H

#define CREASE_MAX_CORNERS 512 /* around one point: the cost grows with the square */

struct crease_corner {
	double face[3];  /* unit normal of its face; 0 for a face without area */
	double share[3]; /* in the common normal: the face's normal, weighted */
	double area;     /* of the flat part of the surface that the face lies in */
	float normal[3]; /* out: unit length; 0 where there is none to be had */
};

/* `crease` is 1 minus the cosine of the angle up to which faces are smooth, 0..2. n <= CREASE_MAX_CORNERS.
 *
 * Faces that differ by less belong together, directly or through others. They share one normal where the surface is
 * regular: where no face is further from that normal than the greatest of 0.6 times the crease angle and 1.2 times the
 * widest step between neighbours, and none further than the crease angle. Elsewhere (at the tip of a cone, or at the end of an edge that fades out) each corner takes only the
 * faces near its own. A flat part that is much larger than the others keeps its normal, for the strips that round off
 * its rim touch it along a tangent. */
void crease_normals(struct crease_corner *corner, unsigned n, double crease);

#endif
