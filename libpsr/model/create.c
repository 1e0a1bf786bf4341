#include <inttypes.h>
#include "file.h"

static int check_blocks(const struct content *content, struct psr_error *err)
{
	const struct psr_blocks *blocks = &content->blocks;
	int n_cones;

	/* The validator bounds the other counts by these, once the image exists. */
	if (blocks->n_blocks > MODEL_MAX_BLOCKS || blocks->n_projections > MODEL_MAX_PROJECTIONS
	    || blocks->n_clusters > blocks->n_blocks || blocks->n_masks > blocks->n_blocks
	    || blocks->n_samples > (uint64_t)PSR_BLOCK_SAMPLES * blocks->n_blocks)
		return psr_fail(err, PSR_ERR_LIMIT, "a model of %" PRIu32 " blocks, %" PRIu32 " projections, %" PRIu32
		                " clusters and %" PRIu64 " samples is over the limits", blocks->n_blocks, blocks->n_projections,
		                blocks->n_clusters, blocks->n_samples);
	n_cones = !!blocks->cone_x + !!blocks->cone_y + !!blocks->cone_z + !!blocks->cone_sine;
	if (n_cones % 4 != 0)
		return psr_fail(err, PSR_ERR_ARG, "%d of the four arrays of cones are set; set all or none", n_cones);
	if (blocks->traits != NULL && n_cones == 0)
		return psr_fail(err, PSR_ERR_ARG, "the model's blocks have traits, but no cones, which bent blocks need");
	if (blocks->opacity != NULL && blocks->traits == NULL)
		return psr_fail(err, PSR_ERR_ARG, "the model's samples have opacities, but its blocks have no traits");
	if (!blocks->visibility_index != !blocks->visibility_mask || !blocks->visibility_mask != (blocks->n_masks == 0))
		return psr_fail(err, PSR_ERR_ARG, "set visibility masks, their number and their indices together, or none");
	return PSR_OK;
}

static int check_arguments(const struct content *content, struct psr_error *err)
{
	const struct psr_presets *presets = &content->presets;
	int code = PSR_OK;

	if (memchr(content->info.builder, 0, sizeof content->info.builder) == NULL)
		return psr_fail(err, PSR_ERR_ARG, "the builder's name is longer than %zu bytes",
		                sizeof content->info.builder - 1);
	for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS; k++) {
		const struct section_spec *spec = &section_table[k];

		if (spec->pointer != 0 && !section_is_foreign(spec, content) && section_is_needed(spec)
		    && section_array(spec, content) == NULL)
			return psr_fail(err, PSR_ERR_ARG, "the model's array for section %s is missing", spec->type);
	}
	if (content->has_blocks)
		code = check_blocks(content, err);
	if (code == PSR_OK && content->has_octree && content->octree.n_leaves > MODEL_MAX_LEAVES)
		return psr_fail(err, PSR_ERR_LIMIT, "an octree of %" PRIu64 " leaves is over the limit of %" PRIu64,
		                content->octree.n_leaves, MODEL_MAX_LEAVES);
	if (code == PSR_OK && content->has_octree)
		code = model_check_octree_counts(&content->octree, "the model", err);
	if (code == PSR_OK && content->has_points)
		code = model_check_point_counts(&content->points, "the model", err);
	if (code != PSR_OK)
		return code;
	if (presets->n_cameras > PSR_MAX_PRESETS || presets->n_lights > PSR_MAX_PRESETS)
		return psr_fail(err, PSR_ERR_LIMIT, "%" PRIu32 " cameras and %" PRIu32 " lights; the limit is %d of each",
		                presets->n_cameras, presets->n_lights, PSR_MAX_PRESETS);
	if ((presets->n_cameras != 0 && presets->camera == NULL) || (presets->n_lights != 0 && presets->light == NULL))
		return psr_fail(err, PSR_ERR_ARG, "the model's array of cameras or lights is missing");
	return PSR_OK;
}

int psr_model_create_of(struct psr_model **out, const struct psr_model_info *info, const struct psr_model_parts *parts,
                        const struct psr_presets *presets, struct psr_error *err)
{
	const struct psr_blocks *blocks = parts->blocks;
	const struct octree *tree = parts->tree;
	struct content content = { .has_blocks = blocks != NULL, .has_octree = tree != NULL,
		                       .has_points = parts->points != NULL };
	uint64_t n_bytes;
	uint8_t *bytes;
	int code;

	if (info == NULL || (blocks == NULL && tree == NULL && parts->points == NULL))
		return psr_fail(err, PSR_ERR_ARG, "a model needs info, and blocks, an octree or differential points; one is NULL");
	content.info = *info;
	if (info->up[0] == 0 && info->up[1] == 0 && info->up[2] == 0)
		content.info.up[1] = 1;
	if (blocks != NULL)
		content.blocks = *blocks;
	if (tree != NULL)
		content.octree = *tree;
	if (parts->points != NULL)
		content.points = *parts->points;
	if (presets != NULL)
		content.presets = *presets;
	code = check_arguments(&content, err);
	if (code != PSR_OK)
		return code;
	bytes = file_image_make(&content, &n_bytes);
	if (bytes == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model of %" PRIu64 " bytes", n_bytes);
	return model_adopt(out, bytes, n_bytes, 0, "the model", err);
}

int psr_model_create_both(struct psr_model **out, const struct psr_model_info *info, const struct psr_blocks *blocks,
                          const struct octree *tree, const struct psr_presets *presets, struct psr_error *err)
{
	return psr_model_create_of(out, info, &(struct psr_model_parts){ blocks, tree, NULL }, presets, err);
}

int psr_model_create(struct psr_model **out, const struct psr_model_info *info, const struct psr_blocks *blocks,
                     const struct psr_presets *presets, struct psr_error *err)
{
	if (blocks == NULL)
		return psr_fail(err, PSR_ERR_ARG, "a model needs info and blocks; one is NULL");
	return psr_model_create_both(out, info, blocks, NULL, presets, err);
}

int psr_model_create_octree(struct psr_model **out, const struct psr_model_info *info, const struct octree *tree,
                            const struct psr_presets *presets, struct psr_error *err)
{
	if (tree == NULL)
		return psr_fail(err, PSR_ERR_ARG, "a model needs info and an octree; one is NULL");
	return psr_model_create_both(out, info, NULL, tree, presets, err);
}
