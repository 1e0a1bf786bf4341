/* The points of a PCD file as they come, in its coordinates. */
#ifndef PSR_IMPORT_POINTS_PCD_POINTS_H
#define PSR_IMPORT_POINTS_PCD_POINTS_H

#include "octree/build/build.h"

/* Compressed points are unpacked in memory, at most `most` bytes of them: LIMIT. */
int pcd_points_open(struct octree_source *out, const char *path, uint64_t most, struct psr_error *err);
void pcd_points_close(struct octree_source *source);

#endif
