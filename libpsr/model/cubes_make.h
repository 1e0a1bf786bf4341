/* Cubes in the making: cubes.c knows the order, cubes_make.c reads subtrees, cubes_bounds.c bounds runs. */
#ifndef PSR_MODEL_CUBES_MAKE_H
#define PSR_MODEL_CUBES_MAKE_H

#include "cubes.h"
#include "octree/subtree.h"

/* Elements of each level: how many, or the next ones. */
struct cubes_count {
	uint64_t cube[CUBES_MOST_LEVELS], code[CUBES_MOST_LEVELS], leaf[CUBES_MOST_LEVELS], skip[CUBES_MOST_LEVELS];
};

struct cubes_making {
	struct psr_cubes *cubes;
	const struct octree *tree;
	int height, n_levels;      /* height: of subtrees, which are clusters */
	struct octree *coarse[CUBES_MOST_LEVELS]; /* the trees of levels above 0 */
	struct cubes_count task[OCTREE_TASKS + 1]; /* elements of each task; then of all before it, and of all */
	/* Arrays to fill; levels follow each other in all but `run`. */
	struct psr_cluster *cluster;
	struct psr_cube *cube;
	struct psr_cube_bunch *bunch;
	struct psr_cube_run *run[CUBES_MOST_LEVELS];
	struct psr_cube_bound *bound[CUBES_MOST_LEVELS];
	uint8_t *flags, *sine;     /* sine, axis: NULL without cones */
	uint8_t *traits;           /* NULL: no leaf leans */
	int8_t *axis[3];
};

/* Loops of a pool over OCTREE_TASKS; userdata is the struct cubes_making. */
void cubes_count_task(int task, void *userdata);
/* Fills the trees and arrays of a task; in cubes, `code` and `leaf` are the low bits of their places in the level. */
void cubes_fill_task(int task, void *userdata);
/* Bounds the runs and bunches of a task. After all tasks have filled. */
void cubes_bound_task(int task, void *userdata);

/* Finds which streams of a scan a tree has, and their ranges. MEMORY. */
int cubes_survey_scan(struct psr_scan *scan, const struct octree *tree, struct psr_error *err);

static inline uint64_t cubes_n_bunches(const struct octree *tree)
{
	return (tree->n_skips + CUBES_BUNCH - 1) / CUBES_BUNCH;
}

static inline uint32_t cubes_n_runs(const struct psr_cube_level *level)
{
	return (level->n + CUBES_RUN - 1) / CUBES_RUN;
}

#endif
