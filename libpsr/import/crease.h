/* Normals of the corners around a point: corners share a normal across smooth faces, and keep edges. */
#ifndef PSR_IMPORT_CREASE_H
#define PSR_IMPORT_CREASE_H

#define CREASE_MAX_CORNERS 512 /* around one point: the cost grows with the square */

struct crease_corner {
	double face[3];  /* unit normal of its face; 0 for a face without area */
	double share[3]; /* the face's weighted normal, summed into the common one */
	double area;     /* of the flat part of the surface that contains the face */
	int is_flat;     /* that part has other faces, too; not so for the triangles of a curved surface */
	float normal[3]; /* out: unit length, or 0 if undefined */
};

/* `crease`: 1 minus the cosine of the angle up to which faces are smooth, 0..2. n <= CREASE_MAX_CORNERS.
 *
 * Faces that differ by less than the crease angle form a group, directly or through others. If neither of two faces is
 * flat, as on a scan, the limit is 1.7 times that angle: noise and coarse triangles make steps of that size as often as
 * edges do.
 *
 * A group shares one normal where the surface is regular: no face is further from that normal than 1.7 times the widest
 * step between neighbours and than the group's limit, though 0.6 times the crease angle is always allowed. Elsewhere
 * (at the tip of a cone, or at the end of an edge that fades out) each corner averages the faces near its own. A flat
 * part much larger than the others keeps its normal, since the strips that round off its rim are tangent to it. */
void crease_normals(struct crease_corner *corner, unsigned n, double crease);

#endif
