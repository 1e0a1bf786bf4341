#include <inttypes.h>
#include <math.h>
#include "base/direction.h"
#include "file.h"

enum { TREE_LEVELS = 0, TREE_FLAGS = 4, TREE_LOW = 8, TREE_EDGE = 32, TREE_CODES = 40, TREE_LEAVES = 48, TREE_SKIPS = 56 };

enum { ONE_SIDED = 1, CLOUD = 2 };

#define fail(section, format, ...) \
	psr_fail(err, PSR_ERR_FORMAT, "%s: section %s: " format, name, section, ##__VA_ARGS__)

void file_put_octree(uint8_t *at, const struct octree *tree)
{
	file_put(at + TREE_LEVELS, 4, (uint64_t)tree->levels);
	file_put(at + TREE_FLAGS, 4, (tree->is_one_sided ? ONE_SIDED : 0) | (tree->is_cloud ? CLOUD : 0));
	for (int c = 0; c < 3; c++)
		file_put_double(at + TREE_LOW + 8 * c, tree->low[c]);
	file_put_double(at + TREE_EDGE, tree->edge);
	file_put(at + TREE_CODES, 8, tree->n_codes);
	file_put(at + TREE_LEAVES, 8, tree->n_leaves);
	file_put(at + TREE_SKIPS, 8, tree->n_skips);
}

void file_get_octree(struct octree *tree, const uint8_t *at)
{
	const uint64_t levels = file_get(at + TREE_LEVELS, 4), flags = file_get(at + TREE_FLAGS, 4);

	tree->levels = levels <= OCTREE_MOST_LEVELS ? (int)levels : OCTREE_MOST_LEVELS + 1;
	tree->is_one_sided = (flags & ONE_SIDED) != 0;
	tree->is_cloud = (flags & CLOUD) != 0;
	for (int c = 0; c < 3; c++)
		tree->low[c] = file_get_double(at + TREE_LOW + 8 * c);
	tree->edge = file_get_double(at + TREE_EDGE);
	tree->n_codes = file_get(at + TREE_CODES, 8);
	tree->n_leaves = file_get(at + TREE_LEAVES, 8);
	tree->n_skips = file_get(at + TREE_SKIPS, 8);
}

int model_check_octree_counts(const struct octree *tree, const char *name, struct psr_error *err)
{
	if (tree->levels < OCTREE_LEAST_LEVELS || tree->levels > OCTREE_MOST_LEVELS)
		return fail("OCTR", "it says %s than %d levels", tree->levels < OCTREE_LEAST_LEVELS ? "less" : "more",
		            tree->levels < OCTREE_LEAST_LEVELS ? OCTREE_LEAST_LEVELS : OCTREE_MOST_LEVELS);
	if (tree->n_leaves == 0 || tree->n_leaves > MODEL_MAX_LEAVES)
		return fail("OCTR", "%" PRIu64 " leaves; it must be 1 to %" PRIu64, tree->n_leaves, MODEL_MAX_LEAVES);
	/* With these, no product of a count and an item's size overflows. */
	if (tree->n_codes == 0 || tree->n_codes / (uint64_t)tree->levels > tree->n_leaves)
		return fail("OCTR", "%" PRIu64 " codes do not fit %" PRIu64 " leaves of %d levels", tree->n_codes,
		            tree->n_leaves, tree->levels);
	if (tree->n_skips == 0 || tree->n_skips > tree->n_codes)
		return fail("OCTR", "a skip index of %" PRIu64 " entries does not fit %" PRIu64 " codes", tree->n_skips,
		            tree->n_codes);
	return PSR_OK;
}

#define STRETCH 4096 /* leaves whose attributes are looked at together */

_Static_assert((PSR_DIRECTIONS & (PSR_DIRECTIONS - 1)) == 0 && (OCTREE_OFFSETS & (OCTREE_OFFSETS - 1)) == 0,
               "one bit too many shows in the union of all");

static uint64_t stretch_end(const struct octree *tree, uint64_t first)
{
	return tree->n_leaves - first < STRETCH ? tree->n_leaves : first + STRETCH;
}

static unsigned any_normal(const struct octree *tree, uint64_t first)
{
	const uint64_t end = stretch_end(tree, first);
	unsigned any = 0;

	for (uint64_t i = first; i < end; i++)
		any |= tree->normal[i];
	return any;
}

static unsigned any_offset(const struct octree *tree, uint64_t first)
{
	const uint64_t end = stretch_end(tree, first);
	unsigned any = 0;

	for (uint64_t i = first; i < end; i++)
		any |= tree->offset[i];
	return any;
}

static int fail_normal(const struct octree *tree, uint64_t i, const char *name, struct psr_error *err)
{
	while (tree->normal[i] < PSR_DIRECTIONS)
		i++;
	return fail("ONRM", "the normal of leaf %" PRIu64 " is %d; normals are below %d", i, tree->normal[i], PSR_DIRECTIONS);
}

static int fail_offset(const struct octree *tree, uint64_t i, const char *name, struct psr_error *err)
{
	while (tree->offset[i] < OCTREE_OFFSETS)
		i++;
	return fail("OOFF", "the offset of leaf %" PRIu64 " is %d; offsets are below %d", i, tree->offset[i], OCTREE_OFFSETS);
}

static int check_scan(const struct octree_scan *scan, const char *name, struct psr_error *err)
{
	if ((scan->time == NULL) != (scan->time_scale == NULL))
		return fail(scan->time == NULL ? "OTSC" : "OTIM", "it is there without section %s",
		            scan->time == NULL ? "OTIM" : "OTSC");
	if (scan->time_scale == NULL)
		return PSR_OK;
	const double first = (*scan->time_scale)[0], step = (*scan->time_scale)[1];
	if (!isfinite(first) || !(step >= 0) || !isfinite(first + step * UINT32_MAX))
		return fail("OTSC", "times from %g in steps of %g are not finite, or go back", first, step);
	return PSR_OK;
}

int model_validate_octree(const struct octree *tree, struct psr_pool *pool, const char *name, struct psr_error *err)
{
	struct psr_error what = { 0 };

	/* Not (... > ...), so that NaN fails as well. */
	for (int c = 0; c < 3; c++)
		if (!(tree->low[c] >= -(double)MODEL_MAX_COORDINATE && tree->low[c] + tree->edge <= (double)MODEL_MAX_COORDINATE))
			return fail("OCTR", "the cube at %g,%g,%g of edge %g reaches beyond %g", tree->low[0], tree->low[1],
			            tree->low[2], tree->edge, (double)MODEL_MAX_COORDINATE);
	if (!(tree->edge >= (double)MODEL_LEAST_SPACING))
		return fail("OCTR", "the cube's edge is %g; it must be %g at least", tree->edge, (double)MODEL_LEAST_SPACING);
	if (octree_check(tree, pool, &what) != PSR_OK)
		return fail("OCOD", "%s", what.text);
	for (uint64_t i = 0; tree->normal != NULL && i < tree->n_leaves; i += STRETCH)
		if ((any_normal(tree, i) & ~(PSR_DIRECTIONS - 1)) != 0)
			return fail_normal(tree, i, name, err);
	for (uint64_t i = 0; tree->offset != NULL && i < tree->n_leaves; i += STRETCH)
		if ((any_offset(tree, i) & ~(OCTREE_OFFSETS - 1)) != 0)
			return fail_offset(tree, i, name, err);
	if (tree->material != NULL && tree->one_material != NULL)
		return fail("OMT1", "it has one material of all leaves, and section OMAT one of each");
	return check_scan(&tree->scan, name, err);
}
