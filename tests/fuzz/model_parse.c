/* Any bytes as a .psr file, plain or packed: as they are, and with their hashes put right, since no mutation would come
 * past those. Properties: what is taken obeys the rules that readers rely on, and the same model made again from its
 * arrays is taken too and holds the same. */
#include <math.h>
#include <stdlib.h>
#include "model/pack.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define REQUIRE(x) ((x) ? (void)0 : abort())

static int take_leaf(const struct octree_node *node, void *userdata)
{
	REQUIRE(node->leaf == (*(uint64_t *)userdata)++);
	return 0;
}

static void check_octree(const struct octree *tree)
{
	uint64_t n_leaves = 0;

	octree_walk(tree, tree->levels, take_leaf, &n_leaves);
	REQUIRE(n_leaves == tree->n_leaves && (tree->material == NULL || tree->one_material == NULL));
	for (uint64_t i = 0; i < n_leaves; i++)
		REQUIRE((tree->normal == NULL || tree->normal[i] < 32768) &&
		        (tree->offset == NULL || tree->offset[i] < OCTREE_OFFSETS));
}

static void check_blocks(const struct psr_blocks *b)
{
	uint64_t n_samples = 0;
	uint32_t n_in_clusters = 0;
	volatile uint16_t beyond = 0; /* readable, says the header */

	for (uint32_t i = 0; i < b->n_clusters; i++) {
		const struct psr_cluster *c = &b->cluster[i];

		REQUIRE(c->first_block == n_in_clusters && c->n_blocks > 0 && c->n_blocks <= b->n_blocks - n_in_clusters);
		REQUIRE(c->group < b->n_clusters && c->level < b->n_levels);
		n_in_clusters += c->n_blocks;
	}
	REQUIRE(n_in_clusters == b->n_blocks);
	for (uint32_t i = 0; i < b->n_blocks; i++) {
		REQUIRE(b->mask[i] != 0 && psr_blocks_attr_first(b, i) == n_samples);
		REQUIRE(b->block_projection[i] < b->n_projections && psr_blocks_level(b, i) < b->n_levels);
		REQUIRE(b->visibility_mask == NULL || psr_blocks_visibility(b, i) < b->n_masks);
		REQUIRE(b->cone_x == NULL || (b->cone_x[i] | b->cone_y[i] | b->cone_z[i]) != 0); /* its length divides */
		n_samples += (uint64_t)__builtin_popcountll(b->mask[i]);
	}
	REQUIRE(n_samples == b->n_samples);
	for (uint64_t k = n_samples; k < n_samples + PSR_BLOCK_SAMPLES; k++)
		beyond ^= b->depth[k];
	(void)beyond;
}

static void check_points(const struct dpoint_set *set)
{
	uint64_t n_points = 0;

	for (uint32_t i = 0; i < set->n_groups; i++) {
		const struct dpoint_group *g = &set->group[i];

		REQUIRE(g->first == n_points && g->n > 0 && g->n <= DPOINT_GROUP);
		for (uint32_t k = 0; k < g->n; k++)
			for (int side = 0; side < 2; side++)
				REQUIRE((set->delta != NULL ? set->delta[g->first + k] : g->delta)[side] < DPOINT_DELTA_CLASSES);
		REQUIRE(!(g->flags & DPOINT_LEANING) == (g->first < set->n_points - set->n_lean));
		n_points += g->n;
	}
	REQUIRE(n_points == set->n_points && set->n_lean <= n_points && (set->n_lean == 0) == (set->lean == NULL));
	for (uint32_t i = 0; i < set->n_lean; i++)
		for (int k = 0; k < 4; k++)
			REQUIRE(fabsf(dpoint_lean_by(set->lean[i].by[k / 2][k % 2])) <= DPOINT_MOST_LEAN_BY);
}

static void check_rules(const struct content *content)
{
	REQUIRE(content->has_blocks || content->has_octree || content->has_points);
	if (content->has_points)
		check_points(&content->points);
	if (content->has_blocks)
		check_blocks(&content->blocks);
	if (content->has_octree)
		check_octree(&content->octree);
}

static void check_presets(const struct psr_presets *a, const struct psr_presets *b)
{
	REQUIRE(a->n_cameras == b->n_cameras && a->n_lights == b->n_lights);
	REQUIRE(a->n_cameras == 0 || memcmp(a->camera, b->camera, a->n_cameras * sizeof *a->camera) == 0);
	REQUIRE(a->n_lights == 0 || memcmp(a->light, b->light, a->n_lights * sizeof *a->light) == 0);
}

static void check_again(const struct content *content)
{
	const struct psr_model_info *info = &content->info;
	struct psr_model *model = NULL;

	const struct psr_model_parts parts = { content->has_blocks ? &content->blocks : NULL,
		                                   content->has_octree ? &content->octree : NULL,
		                                   content->has_points ? &content->points : NULL };

	/* Points may obey all rules of their sections, and yet reach too far. */
	if (psr_model_create_of(&model, info, &parts, &content->presets, NULL) != PSR_OK) {
		REQUIRE(content->has_points);
		return;
	}
	check_presets(&content->presets, psr_model_presets(model));
	for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS; k++) {
		const struct section_spec *spec = &section_table[k];
		const void *a = section_array(spec, content), *b = section_array(spec, model_content(model));

		REQUIRE((a == NULL) == (b == NULL));
		REQUIRE(a == NULL || memcmp(a, b, spec->item_bytes * section_items(spec, content)) == 0);
	}
	/* Up to its last field: what the compiler pads with is anything. */
	REQUIRE(memcmp(psr_model_info(model), info, offsetof(struct psr_model_info, builder) + sizeof info->builder) == 0);
	psr_model_unref(model);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct psr_model *model = NULL;
	struct psr_error err = { 0, "" };
	struct content content;
	void *copy = NULL;
	int code;

	/* Reading must not depend on what follows: an allocation of just that size. */
	REQUIRE(posix_memalign(&copy, FILE_ALIGNMENT, n) == 0);
	if (n > 0)
		memcpy(copy, data, n);
	code = psr_model_parse(&model, data, n, &err);
	REQUIRE((code == PSR_OK) == (model != NULL) && code == err.code && (code == PSR_OK) == (err.text[0] == 0));
	psr_model_unref(model);

	if (n >= FILE_HEADER_BYTES && pack_is_packed(copy)) {
		model = NULL;
		pack_seal(copy, n);
		if (psr_model_parse(&model, copy, n, NULL) == PSR_OK)
			check_rules(model_content(model));
		psr_model_unref(model);
		free(copy);
		return 0;
	}
	file_seal(copy, n);
	err = (struct psr_error){ 0, "" };
	code = file_parse(copy, n, NULL, "input", &content, &err);
	REQUIRE(code == err.code && (code == PSR_OK) == (err.text[0] == 0));
	if (code == PSR_OK) {
		check_rules(&content);
		check_again(&content);
	}
	free(copy);
	return 0;
}
