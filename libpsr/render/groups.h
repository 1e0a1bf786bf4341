/* Which representation of its model an instance is drawn from. */
#ifndef PSR_RENDER_GROUPS_H
#define PSR_RENDER_GROUPS_H

#include "model/cubes.h"
#include "model/points.h"
#include "psr/scene.h"

/* Returns whether an instance is drawn as an octree: it names that representation, or its model has no blocks. */
static inline int is_octree(const struct psr_instance *instance)
{
	return instance->representation == PSR_OCTREE
	       || (instance->representation == PSR_AUTOMATIC && psr_model_blocks(instance->model) == NULL);
}

/* Returns the cubes of an instance that is drawn as an octree, or NULL. psr_scene_validate() has made them. */
static inline const struct psr_cubes *instance_cubes(const struct psr_instance *instance)
{
	return is_octree(instance) ? psr_model_cubes(instance->model) : NULL;
}

/* The same of differential points: where automatic, its model has nothing else. */
static inline const struct psr_points *instance_points(const struct psr_instance *instance)
{
	const int are_points = instance->representation == PSR_DPOINTS
	                       || (instance->representation == PSR_AUTOMATIC && psr_model_blocks(instance->model) == NULL
	                           && psr_model_cubes(instance->model) == NULL);

	return are_points ? psr_model_points(instance->model) : NULL;
}

/* Returns what culling reads; NULL if the model has not what the instance names. */
static inline const struct psr_blocks *instance_groups(const struct psr_instance *instance)
{
	const struct psr_cubes *cubes = instance_cubes(instance);
	const struct psr_points *points = instance_points(instance);

	if (cubes != NULL)
		return &cubes->groups;
	if (points != NULL)
		return &points->groups;
	return instance->representation <= PSR_BLOCKS ? psr_model_blocks(instance->model) : NULL;
}

/* Returns what a valid instance is drawn as: never PSR_AUTOMATIC. */
static inline enum psr_representation instance_drawn_as(const struct psr_instance *instance)
{
	if (instance_cubes(instance) != NULL)
		return PSR_OCTREE;
	return instance_points(instance) != NULL ? PSR_DPOINTS : PSR_BLOCKS;
}

#endif
