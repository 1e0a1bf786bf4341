/* Polygons of n corners as n - 2 triangles. */
#ifndef PSR_IMPORT_PLY_POLYGON_H
#define PSR_IMPORT_PLY_POLYGON_H

#define POLYGON_MAX_CLIP 256 /* corners; beyond, a polygon is taken for convex, since clipping ears is cubic at worst */

/* Writes n - 2 triangles of corners 0 .. n - 1, turning as the polygon does; n >= 3. `point` is read for 4 to
 * POLYGON_MAX_CLIP corners. A polygon that crosses itself gives some triangles of the right number. */
void polygon_cut(unsigned (*out)[3], const double (*point)[3], unsigned n);

#endif
