/* Visibility cones ([G] 6.4). */
#ifndef PSR_SAMPLE_CONE_H
#define PSR_SAMPLE_CONE_H

/* A cap that holds n unit normals: a unit axis, and the cosine of the angle to the rim, rounded downwards; -1 where they
 * have no mean. */
void cone_bound(const float (*normal)[3], int n, float axis[3], float *cosine);

#endif
