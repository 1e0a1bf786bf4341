/* Cutting polygons into triangles. */
#ifndef PSR_IMPORT_PLY_POLYGON_H
#define PSR_IMPORT_PLY_POLYGON_H

#define POLYGON_MAX_CLIP 256 /* corners; larger polygons count as convex, since ear clipping is cubic */

/* Writes n - 2 triangles of corners 0 .. n - 1 with the polygon's winding; n >= 3. Reads `point` for 4 to
 * POLYGON_MAX_CLIP corners. A polygon that crosses itself gives any n - 2 triangles. */
void polygon_cut(unsigned (*out)[3], const double (*point)[3], unsigned n);

#endif
