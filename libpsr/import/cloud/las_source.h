/* The points of a LAS file as they come, in its coordinates, z up; without those that las_is_left_out() names. */
#ifndef PSR_IMPORT_CLOUD_LAS_SOURCE_H
#define PSR_IMPORT_CLOUD_LAS_SOURCE_H

#include "octree/build/build.h"

/* Opens a file of LAS 1.0 to 1.4; the path must outlive the source. Reads it once, for the scale of its colours. Takes
 * two megabytes and what stands before the points. NOT_FOUND, IO, FORMAT, UNSUPPORTED, LIMIT, MEMORY. */
int las_source_open(struct octree_source *out, const char *path, struct psr_error *err);

/* The same, of at most `most` points and LAS_RUN more, in runs that are evenly spread over the file; 0: all. */
int las_source_open_part(struct octree_source *out, const char *path, uint64_t most, struct psr_error *err);
#define LAS_RUN 512

void las_source_close(struct octree_source *source);

#endif
