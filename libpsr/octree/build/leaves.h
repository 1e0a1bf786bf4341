/* The steps of octree_build(). */
#ifndef PSR_OCTREE_BUILD_LEAVES_H
#define PSR_OCTREE_BUILD_LEAVES_H

#include "build.h"

/* Merged leaves; part: the mean place within each, in 256ths of its edge. The tree has normals if the source has, and
 * then RECORD_NO_NORMAL at n_without of its leaves. */
struct built {
	struct octree *tree;
	uint64_t n_without;
	uint8_t (*part)[3];
};

/* normals.c: gives the tree the normals that it lacks, and offsets. MEMORY, CANCELLED, without a text. */
int built_normals(const struct built *built, const struct octree_build_options *options);

static inline void built_progress(const struct octree_build_options *options, const char *stage, uint64_t done,
                                  uint64_t total)
{
	if (options->on_progress != NULL)
		options->on_progress(stage, done, total, options->userdata);
}

#endif
