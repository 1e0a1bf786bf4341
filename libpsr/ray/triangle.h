/* Triangles in space. */
#ifndef PSR_RAY_TRIANGLE_H
#define PSR_RAY_TRIANGLE_H

/* Square of the distance from p to the nearest point of a triangle, which may be degenerate. */
double triangle_distance2(const double corner[3][3], const double p[3]);

#endif
