/* Normals of the corners around one point: which share one, and which keep an edge between them. */
#ifndef PSR_IMPORT_CREASE_H
#define PSR_IMPORT_CREASE_H

#define CREASE_MAX_CORNERS 512 /* around one point: the cost grows with the square */

struct crease_corner {
	double face[3];  /* unit normal of its face; 0 for a face without area */
	double share[3]; /* in the common normal: the face's normal, weighted */
	double area;     /* of the flat part of the surface that the face lies in */
	int is_flat;     /* the face is not all of that part, as it is where a curved surface is cut into triangles */
	float normal[3]; /* out: unit length; 0 where there is none to be had */
};

/* `crease` is 1 minus the cosine of the angle up to which faces are smooth, 0..2. n <= CREASE_MAX_CORNERS.
 *
 * Faces that differ by less belong together, directly or through others. Where neither is flat, as on a scan, they do
 * up to 1.7 times that angle: there a step tells of noise and of coarse triangles as often as of an edge.
 *
 * They share one normal where the surface is regular: where no face is further from that normal than 1.7 times the
 * widest step between neighbours, and than the angle up to which they belong together; 0.6 times the crease angle
 * always will do. Elsewhere (at the tip of a cone, or at the end of an edge that fades out) each corner takes only
 * the faces that are near its own. A flat part that is much larger than the others keeps its normal, for the strips
 * that round off its rim touch it along a tangent. */
void crease_normals(struct crease_corner *corner, unsigned n, double crease);

#endif
