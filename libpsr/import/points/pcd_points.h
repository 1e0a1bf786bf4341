/* The points of a PCD file as they come, in its coordinates. */
#ifndef PSR_IMPORT_POINTS_PCD_POINTS_H
#define PSR_IMPORT_POINTS_PCD_POINTS_H

#include "octree/build/build.h"

/* Compressed points are unpacked in memory, at most `most` bytes of them: LIMIT. part: points of a reading (spread.h),
 * 0: all; text is read whole. */
int pcd_points_open(struct octree_source *out, const char *path, uint64_t most, uint64_t part, struct psr_error *err);
void pcd_points_close(struct octree_source *source);

#endif
