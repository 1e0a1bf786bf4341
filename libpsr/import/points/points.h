/* Points of files as they come, whatever the format: sources of octrees (octree/build/build.h). */
#ifndef PSR_IMPORT_POINTS_POINTS_H
#define PSR_IMPORT_POINTS_POINTS_H

#include "octree/build/build.h"

/* Opens a file of points, told by its first bytes, or else by its ending:
 *
 *   LAS 1.0 to 1.4, point formats 0 to 10: without noise and withheld points
 *   PLY, text or binary: the vertices, with colours and normals; faces are passed over
 *   PCD, text, binary, or compressed (of at most POINTS_MOST_UNPACKED bytes: these are held in memory)
 *   PTS and PTX: all scans of a file; PTX in its common coordinates, without what no ray met
 *   XYZ and other tables of text (text.h): .xyz, and .txt .csv .tsv .asc .dat .xyzrgb .xyzi .xyzn or names without an
 *   ending if the first line of points has three numbers
 *
 * Colours are sRGB. Where there are intensities alone they are a linear grey, black to white. Points without a finite
 * place are left out and counted. Takes some two megabytes and what stands before the points; the path must outlive
 * the source. Reads the file once where a colour's scale asks for it. NOT_FOUND, IO, FORMAT with the place, LIMIT,
 * MEMORY; UNSUPPORTED for LAZ, E57 and anything else, with a sentence that says how to convert it. */
int octree_source_open(struct octree_source *out, const char *path, struct psr_error *err);

/* The same, of about `part` points alone, and scales of colours that these tell: for a first picture, in a time that
 * does not grow with the file. They come in runs that are evenly spread over it. Text of other formats than XYZ, and
 * PLY with lists among a vertex's properties, are read whole; part 0: all points. */
int octree_source_open_part(struct octree_source *out, const char *path, uint64_t part, struct psr_error *err);
void octree_source_close(struct octree_source *source);

#define POINTS_MOST_UNPACKED ((uint64_t)1 << 30)

/* Points of the latest reading, or of what there was of it. */
struct octree_source_count {
	uint64_t n_read, n_left_out; /* n_left_out: not among n_read, since they have no finite place */
};

struct octree_source_count octree_source_count(const struct octree_source *source);

/* Returns whether octree_source_open() is the way to read a file: it knows the format, or how to convert it, and the
 * file has no faces. Looks at its beginning alone. */
int octree_source_suits(const char *path);

/* Returns the axis that is up, 1 or 2, by psr/mesh.h's rule; low and edge: of the cube that holds the points. */
int octree_source_up(const struct octree_source *source, const double low[3], double edge);

#endif
