#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "base/vec.h"
#include "file.h"

/* Unit vectors in single precision: if components went through eight roundings of 2^-24 on either side of a product, a
 * scalar product of two of them is at most 2 * 8 * 2^-24 off. */
#define UNIT_TOLERANCE 0x1p-20f

struct checker {
	const struct psr_model_info *info;
	const struct psr_blocks *blocks;
	const struct psr_presets *presets;
	const char *name;
	struct psr_error *err;
};

#define fail(c, section, format, ...) \
	psr_fail((c)->err, PSR_ERR_FORMAT, "%s: section %s: " format, (c)->name, section, ##__VA_ARGS__)

/* Returns 0 for NaN, too. */
static int is_length(float v)
{
	return v >= 0 && v <= MODEL_MAX_COORDINATE;
}

static int is_coordinate(float v)
{
	return v >= -MODEL_MAX_COORDINATE && v <= MODEL_MAX_COORDINATE;
}

/* The protocol tells lengths of at most 1e30, and positive ones from 1e-30 on. */
static int is_told(double v)
{
	return v >= -1e30 && v <= 1e30;
}

static int is_unit(const float v[3])
{
	return fabsf(v3f_dot(v, v) - 1) <= UNIT_TOLERANCE;
}

static int check_info(const struct checker *c)
{
	const struct psr_model_info *info = c->info;
	size_t length = strnlen(info->builder, sizeof info->builder);

	for (int k = 0; k < 3; k++) {
		if (!isfinite(info->origin[k]))
			return fail(c, "INFO", "the origin is not finite");
		if (!isfinite(info->box_min[k]) || !isfinite(info->box_max[k]) || info->box_min[k] > info->box_max[k])
			return fail(c, "INFO", "the box is not finite or inside out");
		if (!is_told(info->box_min[k]) || !is_told(info->box_max[k]))
			return fail(c, "INFO", "the box is from %g to %g; coordinates are at most 1e30 in magnitude",
			            info->box_min[k], info->box_max[k]);
	}
	if (!(fabs(v3d_dot(info->up, info->up) - 1) <= 1e-6))
		return fail(c, "INFO", "up is %g,%g,%g; it must have length 1", info->up[0], info->up[1], info->up[2]);
	if (!(info->scale > 0 && isfinite(info->scale)))
		return fail(c, "INFO", "the scale is %g; it must be positive and finite", info->scale);
	if (!(info->spacing >= 1e-30 && is_told(info->spacing)))
		return fail(c, "INFO", "the spacing is %g; it must be from 1e-30 to 1e30", info->spacing);
	if (!(info->tolerance >= 0 && info->tolerance <= 1.5707963267948966))
		return fail(c, "INFO", "the tolerance is %g; it must be an angle from 0 to half of pi", info->tolerance);
	if (info->resolution == 0)
		return fail(c, "INFO", "the resolution is 0");
	if (info->n_missing > info->n_trials || info->n_lost > info->n_trials)
		return fail(c, "INFO", "%" PRIu64 " pixels are missing and %" PRIu64 " lost, out of %" PRIu64, info->n_missing,
		            info->n_lost, info->n_trials);
	for (size_t i = 0; i < sizeof info->builder; i++)
		if (i < length ? info->builder[i] < ' ' || info->builder[i] > '~' : info->builder[i] != 0)
			return fail(c, "INFO", "byte %zu of the builder's name is not text", i);
	return length < sizeof info->builder ? PSR_OK : fail(c, "INFO", "the builder's name has no end");
}

static int check_counts(const struct checker *c)
{
	const struct psr_blocks *b = c->blocks;

	if (b->n_blocks == 0 || b->n_blocks > MODEL_MAX_BLOCKS)
		return fail(c, "BLKS", "%" PRIu32 " blocks; it must be 1 to %" PRIu32, b->n_blocks, MODEL_MAX_BLOCKS);
	if (b->n_projections == 0 || b->n_projections > MODEL_MAX_PROJECTIONS)
		return fail(c, "BLKS", "%" PRIu32 " projections; it must be 1 to %" PRIu32, b->n_projections,
		            MODEL_MAX_PROJECTIONS);
	if (b->n_clusters == 0 || b->n_clusters > b->n_blocks)
		return fail(c, "BLKS", "%" PRIu32 " clusters; it must be 1 to the number of blocks", b->n_clusters);
	if (b->n_levels == 0 || b->n_levels > PSR_MAX_LEVELS)
		return fail(c, "BLKS", "%" PRIu32 " levels; it must be 1 to %d", b->n_levels, PSR_MAX_LEVELS);
	if (b->n_masks > b->n_blocks)
		return fail(c, "BLKS", "%" PRIu32 " visibility masks; it must be at most one a block", b->n_masks);
	return PSR_OK;
}

static int check_projections(const struct checker *c)
{
	for (uint32_t i = 0; i < c->blocks->n_projections; i++) {
		const struct psr_projection *p = &c->blocks->projection[i];
		float z[3];

		/* Not (... <= ...), so that NaN fails as well. */
		for (int k = 0; k < 3; k++)
			if (!is_unit(p->axis[k]) || !(fabsf(v3f_dot(p->axis[k], p->axis[(k + 1) % 3])) <= UNIT_TOLERANCE))
				return fail(c, "PROJ", "the axes of projection %" PRIu32 " are not orthonormal", i);
		v3f_cross(z, p->axis[0], p->axis[1]);
		if (!(v3f_dot(z, p->axis[2]) > 0))
			return fail(c, "PROJ", "the axes of projection %" PRIu32 " are left-handed", i);
		if (!(p->spacing >= MODEL_LEAST_SPACING && p->spacing <= MODEL_MAX_COORDINATE))
			return fail(c, "PROJ", "the spacing of projection %" PRIu32 " is %g; it must be from %g to %g", i,
			            (double)p->spacing, (double)MODEL_LEAST_SPACING, (double)MODEL_MAX_COORDINATE);
	}
	return PSR_OK;
}

static int check_cluster(const struct checker *c, uint32_t i, uint64_t next_block)
{
	const struct psr_blocks *b = c->blocks;
	const struct psr_cluster *k = &b->cluster[i];

	if (k->first_block != next_block || k->n_blocks == 0 || k->n_blocks > b->n_blocks - next_block)
		return fail(c, "CLUS", "cluster %" PRIu32 " has %" PRIu32 " blocks from %" PRIu32 " on; the next free one is %"
		            PRIu64 " of %" PRIu32, i, k->n_blocks, k->first_block, next_block, b->n_blocks);
	if (k->group >= b->n_clusters)
		return fail(c, "CLUS",
		            "cluster %" PRIu32 " is of group %" PRIu32 "; groups are below the number of clusters, %" PRIu32, i,
		            k->group, b->n_clusters);
	if (k->level >= b->n_levels)
		return fail(c, "CLUS", "cluster %" PRIu32 " is of level %d of %" PRIu32, i, k->level, b->n_levels);
	if (!is_coordinate(k->center[0]) || !is_coordinate(k->center[1]) || !is_coordinate(k->center[2])
	    || !is_length(k->radius))
		return fail(c, "CLUS", "the sphere of cluster %" PRIu32 " is not one", i);
	if (k->zero[0] != 0 || k->zero[1] != 0 || k->zero[2] != 0)
		return fail(c, "CLUS", "reserved bytes of cluster %" PRIu32 " are not zero", i);
	for (uint32_t j = k->first_block; j < k->first_block + k->n_blocks; j++)
		if (psr_blocks_level(b, j) != k->level)
			return fail(c, "BFLG", "block %" PRIu32 " is of level %u, and its cluster %" PRIu32 " of level %d", j,
			            psr_blocks_level(b, j), i, k->level);
	return PSR_OK;
}

static int check_clusters(const struct checker *c)
{
	const struct psr_blocks *b = c->blocks;
	uint64_t next_block = 0;
	uint32_t *levels_of_group;
	int code = PSR_OK;

	levels_of_group = psr_alloc_array(b->n_clusters, sizeof *levels_of_group);
	if (levels_of_group == NULL)
		return psr_fail(c->err, PSR_ERR_MEMORY, "%s: no memory to check %" PRIu32 " clusters", c->name, b->n_clusters);
	memset(levels_of_group, 0, b->n_clusters * sizeof *levels_of_group);
	for (uint32_t i = 0; i < b->n_clusters && code == PSR_OK; i++) {
		const struct psr_cluster *k = &b->cluster[i];

		code = check_cluster(c, i, next_block);
		if (code != PSR_OK)
			break;
		if (levels_of_group[k->group] >> k->level & 1)
			code = fail(c, "CLUS", "cluster %" PRIu32 " is the second of group %" PRIu32 " at level %d", i, k->group,
			            k->level);
		levels_of_group[k->group] |= (uint32_t)1 << k->level;
		next_block += k->n_blocks;
	}
	if (code == PSR_OK && next_block != b->n_blocks)
		code = fail(c, "CLUS", "blocks %" PRIu64 " to %" PRIu32 " are in no cluster", next_block, b->n_blocks - 1);
	psr_free(levels_of_group);
	return code;
}

static int check_heads(const struct checker *c)
{
	const struct psr_blocks *b = c->blocks;
	uint64_t n_samples = 0;

	for (uint32_t i = 0; i < b->n_blocks; i++) {
		if (b->block_projection[i] >= b->n_projections)
			return fail(c, "BPRJ", "block %" PRIu32 " is of projection %d of %" PRIu32, i, b->block_projection[i],
			            b->n_projections);
		if (b->mask[i] == 0)
			return fail(c, "MASK", "block %" PRIu32 " has no valid sample", i);
		if (i % PSR_RUN_BLOCKS == 0 && b->run[i / PSR_RUN_BLOCKS].attr_first != n_samples)
			return fail(c, "RUNS", "the attributes of run %" PRIu32 " begin at %" PRIu32 " instead of %" PRIu64,
			            i / PSR_RUN_BLOCKS, b->run[i / PSR_RUN_BLOCKS].attr_first, n_samples);
		if (psr_blocks_attr_first(b, i) != n_samples)
			return fail(c, "AOFF", "the attributes of block %" PRIu32 " begin at %" PRIu32 " instead of %" PRIu64, i,
			            psr_blocks_attr_first(b, i), n_samples);
		n_samples += (uint64_t)__builtin_popcountll(b->mask[i]);
	}
	if (n_samples != b->n_samples)
		return fail(c, "MASK", "%" PRIu64 " samples are valid, and BLKS counts %" PRIu64, n_samples, b->n_samples);
	return PSR_OK;
}

static int check_visibility(const struct checker *c)
{
	const struct psr_blocks *b = c->blocks;

	for (uint32_t i = 0; i < psr_blocks_runs(b); i++)
		if (b->run[i].visibility_first > b->n_masks)
			return fail(c, "RUNS", "the visibility masks of run %" PRIu32 " begin at %" PRIu32 " of %" PRIu32, i,
			            b->run[i].visibility_first, b->n_masks);
	for (uint32_t i = 0; i < b->n_blocks && b->n_masks != 0; i++)
		if (psr_blocks_visibility(b, i) >= b->n_masks)
			return fail(c, "VISI", "block %" PRIu32 " has visibility mask %" PRIu32 " of %" PRIu32, i,
			            psr_blocks_visibility(b, i), b->n_masks);
	return PSR_OK;
}

static int check_cones(const struct checker *c)
{
	const struct psr_blocks *b = c->blocks;

	if (b->cone_x == NULL)
		return PSR_OK;
	for (uint32_t i = 0; i < b->n_blocks; i++) {
		const int axis[3] = { abs(b->cone_x[i]), abs(b->cone_y[i]), abs(b->cone_z[i]) };
		int greatest = axis[0] > axis[1] ? axis[0] : axis[1];

		greatest = axis[2] > greatest ? axis[2] : greatest;
		if (greatest != 127)
			return fail(c, "CONX, CONY, CONZ",
			            "the greatest component of the axis of block %" PRIu32 " is %d instead of 127",
			            i, greatest);
	}
	return PSR_OK;
}

static int check_traits(const struct checker *c)
{
	const struct psr_blocks *b = c->blocks;

	for (uint32_t i = 0; b->traits != NULL && i < b->n_blocks; i++) {
		if ((b->traits[i] & ~(PSR_BLOCK_BENT | PSR_BLOCK_SHEER | PSR_BLOCK_THIN | PSR_BLOCK_OFF)) != 0)
			return fail(c, "TRTS", "block %" PRIu32 " has unknown traits %d", i, b->traits[i]);
		if ((b->traits[i] & (PSR_BLOCK_SHEER | PSR_BLOCK_THIN)) == PSR_BLOCK_THIN)
			return fail(c, "TRTS", "block %" PRIu32 " is thin, but not sheer", i);
	}
	return PSR_OK;
}

static int check_presets(const struct checker *c)
{
	struct psr_error err = { 0 };
	const char *section = NULL;

	return presets_validate(c->presets, &section, &err) == PSR_OK ? PSR_OK : fail(c, section, "%s", err.text);
}

int model_validate(const struct content *content, struct psr_pool *pool, const char *name, struct psr_error *err)
{
	static int (*const checks[])(const struct checker *) = {
		check_info, check_presets, /* from here on, of blocks: */ check_counts, check_projections, check_clusters,
		check_heads, check_cones, check_traits, check_visibility,
	};
	const size_t n_checks = content->has_blocks ? sizeof checks / sizeof checks[0] : 2;
	const struct checker c = { &content->info, &content->blocks, &content->presets, name, err };
	int code = PSR_OK;

	for (size_t i = 0; i < n_checks && code == PSR_OK; i++)
		code = checks[i](&c);
	struct psr_error broken = { 0 };
	if (code == PSR_OK && calibration_validate(&content->calibration, &broken) != PSR_OK)
		code = fail(&c, "CALB", "%s", broken.text);
	if (code == PSR_OK && content->has_octree)
		code = model_validate_octree(&content->octree, pool, name, err);
	if (code == PSR_OK && content->has_points)
		code = model_validate_points(&content->points, name, err);
	return code;
}
