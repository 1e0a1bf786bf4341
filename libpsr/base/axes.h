/* The axes of a symmetric matrix, such as the extents of some points. */
#ifndef PSR_BASE_AXES_H
#define PSR_BASE_AXES_H

/* Sets the rows of `axis` to the unit eigenvectors of m (symmetric, not negative), in no order, and leaves their values
 * on its diagonal. The same bits on every machine. */
void axes_find(double m[3][3], double axis[3][3]);

#endif
