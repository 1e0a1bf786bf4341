/* Octrees from points, in a bounded part of memory: the points are sorted in runs on disk, and merged into leaves. */
#ifndef PSR_OCTREE_BUILD_BUILD_H
#define PSR_OCTREE_BUILD_BUILD_H

#include <stddef.h>
#include "octree/octree.h"
#include "base/pool.h"

struct octree_point {
	double at[3];
	uint8_t color[3]; /* sRGB */
	float normal[3];  /* of any length; 0,0,0: none, as anything that is not finite */
	/* As in struct octree_scan, where the source has them. */
	uint8_t class, returns;
	uint16_t intensity;
	double time;      /* seconds; not finite: as the first one of all */
};

enum octree_scan_stream { OCTREE_INTENSITY, OCTREE_CLASS, OCTREE_RETURNS, OCTREE_TIME, OCTREE_SCAN_STREAMS };

/* Where points come from; they are read twice, and have to be the same both times. Functions return PSR_OK or an error
 * with its text. */
struct octree_source {
	const char *name;   /* for errors: the file's */
	int has_color, has_normal;
	unsigned scan;      /* bit s: points have stream s of enum octree_scan_stream */
	uint64_t n_points;  /* for progress alone */
	/* Goes to the first point. */
	int (*rewind)(void *userdata, struct psr_error *err);
	/* Reads up to `room` points; *n is 0 behind the last one only. */
	int (*read)(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err);
	void *userdata;
};

struct octree_build_options {
	int levels;          /* OCTREE_LEAST_LEVELS..OCTREE_MOST_LEVELS; 0: the fewest whose leaves are at most `spacing` */
	double spacing;      /* in units of the source */
	uint64_t memory;     /* bytes to sort in, OCTREE_LEAST_MEMORY at least; the tree itself comes on top */
	const char *folder;  /* for the runs */
	const struct psr_cancel *cancel; /* may be NULL */
	/* stage: "bounds", "points", "merge" or "normals"; "leaves" of a mesh. May be NULL. */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata);
	void *userdata;
};

#define OCTREE_LEAST_MEMORY ((uint64_t)1 << 20)

/* 10 levels, 2 GB, the folder of the environment's TMPDIR or /tmp. */
void octree_build_options_default(struct octree_build_options *options);

/* Checks the ranges of options, and finds how many levels they ask for in a cube of this edge. ARG: a spacing finer than
 * OCTREE_MOST_LEVELS levels, too. */
int octree_build_levels(int *levels, const struct octree_build_options *options, const char *name, double edge,
                        struct psr_error *err);

/* Builds a tree with normals, offsets, and colours and streams of a scan if the source has any; a stream of zeros alone is
 * none. Colours and places of a leaf's points are
 * averaged, and so are normals of the source. Leaves whose points have none blend those of the cells around them: least
 * squares over 27 cells of some ten leaves, whose sides agree; the highest place of what hangs together looks up.
 *
 * FORMAT: no points, a place that is not finite, all points at one place; ARG: options out of range, a spacing finer
 * than OCTREE_MOST_LEVELS levels; IO: the disk is full; MEMORY, CANCELLED; and errors of the source. Runs have no
 * names: no file is left, whatever happens. */
int octree_build(struct octree **out, const struct octree_source *source, const struct octree_build_options *options,
                 struct psr_error *err);

#endif
