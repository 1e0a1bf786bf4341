/* Packed octrees for tests of psrd and of viewers. */
#ifndef TESTS_UNIT_SERVER_CLOUD_H
#define TESTS_UNIT_SERVER_CLOUD_H

#include <limits.h>
#include <stdio.h>
#include "../octree/leaves.h"
#include "model/cubes.h"
#include "model/tree.h"

/* Writes an octree of so many levels with n random leaves, packed in steps of two levels. */
static inline void cloud_write(const char *to, const char *name, int levels, size_t n)
{
	struct leaves leaves = leaves_at_random(levels, n);
	struct octree *tree = leaves_to_tree(&leaves, levels), inner;
	struct psr_model_info info;
	struct psr_model *model;
	char path[2 * PATH_MAX];

	free(leaves.path);
	assert_true(tree != NULL && leaves_dress(tree, 5));
	psr_octree_info(&info, tree);
	psr_octree_to_inner(&inner, tree, &info);
	assert_int_equal(psr_model_create_octree(&model, &info, &inner, NULL, NULL), PSR_OK);
	snprintf(path, sizeof path, "%s/%s", to, name);
	assert_int_equal(psr_model_write_packed(model, path, NULL), PSR_OK);
	psr_model_unref(model);
	octree_destroy(tree);
}

#endif
