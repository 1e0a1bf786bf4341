/* The vertices of a PLY file as they come, in its coordinates. */
#ifndef PSR_IMPORT_POINTS_PLY_POINTS_H
#define PSR_IMPORT_POINTS_PLY_POINTS_H

#include "octree/build/build.h"

/* part: points of a reading (spread.h), 0: all; text, and vertices with lists, are read whole. */
int ply_points_open(struct octree_source *out, const char *path, uint64_t part, struct psr_error *err);
int ply_points_have_faces(const struct octree_source *source); /* or triangle strips */
void ply_points_close(struct octree_source *source);

#endif
