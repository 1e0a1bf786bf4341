/* Differential points of exact patches. Include after cmocka.h. */
#ifndef TESTS_LIB_POINTS_H
#define TESTS_LIB_POINTS_H

#include "../dpoint/patches.h"
#include "base/direction.h"
#include "dpoint/group.h"
#include "dpoint/sample.h"
#include "model/points.h"
#include "model/tree.h"

#define POINTS_GREY ((uint64_t)0xb4b4b4 << 16) /* scatters light alone */

/* Simplified points of the patch, n x n of a span to begin with, all with these attributes but for their normals. The
 * caller frees by dpoint_set_fini(). */
static inline void points_of_patch(struct dpoint_set *set, const struct dpoint_patch *patch, uint32_t n, uint64_t attr)
{
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.01), .slack = 2e-5f, .angle = 0.05f, .height = 0.002f, .overhang = 5e-4f,
	};
	const struct dpoint_uniform uniform = { .n = n, .cells = 2, .scale = 1, .delta = 0.25f };
	struct dpoint_surface surface;
	struct dpoint_cover cover = { 0 };
	struct dpoint_choice choice = { 0 };
	struct dpoint_errors errors;

	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_uniform(&surface, patch, &uniform), PSR_OK);
	assert_int_equal(dpoint_simplify(&choice, &cover, &surface, &options, 1, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < surface.n_candidates; i++)
		surface.candidate[i].point.attr = attr;
	assert_int_equal(dpoint_set_make(set, &(struct dpoint_grouping){ &surface, &choice, options.sine, NULL }), PSR_OK);
	assert_int_equal(dpoint_measure(&errors, &surface, &cover, &choice, NULL), PSR_OK);
	/* Measured in the middles of cells, of which corners are further off, before places are rounded. */
	set->height = (float)(2 * errors.height_worst) + options.slack;
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

/* A model of a set that reaches to 1 at most, in its own coordinates. */
static inline struct psr_model *points_to_model(const struct dpoint_set *set)
{
	const struct psr_model_info info = { .scale = 1, .box_min = { -1, -1, -1 }, .box_max = { 1, 1, 1 },
		                                 .spacing = 2.0 / 512, .resolution = 512, .builder = "test" };
	struct psr_model *model = NULL;

	assert_int_equal(psr_model_create_of(&model, &info, &(struct psr_model_parts){ .points = set }, NULL, NULL), PSR_OK);
	return model;
}

#endif
