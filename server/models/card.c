#include <stdlib.h>
#include <string.h>
#include "card.h"
#include "model/calibration.h"
#include "model/cubes.h"
#include "model/points.h"
#include "psr/message.h"

/* Returns NULL for no presets, or without memory. */
static void *copy(const void *from, size_t n, size_t bytes)
{
	void *to = n > 0 ? malloc(n * bytes) : NULL;

	if (to != NULL)
		memcpy(to, from, n * bytes);
	return to;
}

static uint32_t colors_of(const struct psr_model *model)
{
	const struct psr_cubes *cubes = psr_model_blocks(model) == NULL ? psr_model_cubes(model) : NULL;
	uint32_t colors = 1u << PSR_WIRE_COLOR_HEIGHT;

	if (cubes != NULL && cubes->scan.has_intensity)
		colors |= 1u << PSR_WIRE_COLOR_INTENSITY;
	if (cubes != NULL && cubes->scan.has_class)
		colors |= 1u << PSR_WIRE_COLOR_CLASS;
	if (cubes != NULL && cubes->scan.has_return)
		colors |= 1u << PSR_WIRE_COLOR_RETURN;
	return colors;
}

int card_init(struct card *card, const struct psr_model *model)
{
	const struct psr_blocks *blocks = psr_model_blocks(model), *drawn = blocks;
	const struct psr_cubes *cubes = psr_model_cubes(model);
	const struct psr_points *points = psr_model_points(model);
	const struct psr_presets *presets = psr_model_presets(model);

	if (blocks == NULL)
		drawn = cubes != NULL ? &cubes->groups : &points->groups;
	*card = (struct card){ .info = *psr_model_info(model), .presets = *presets, .n_levels = drawn->n_levels,
		                   .n_samples = drawn->n_samples, .has_sheer = blocks != NULL && blocks->opacity != NULL,
		                   .is_calibrated = psr_model_calibration(model)->n > 0 };
	if (blocks != NULL) {
		card->representations |= 1u << PSR_WIRE_REP_BLOCKS;
		card->n_blocks = blocks->n_blocks;
	}
	if (cubes != NULL) {
		card->representations |= 1u << PSR_WIRE_REP_OCTREE;
		card->n_cubes = cubes->groups.n_blocks;
	}
	if (points != NULL) {
		card->representations |= 1u << PSR_WIRE_REP_DPOINT;
		card->n_points = points->groups.n_blocks;
	}
	card->colors = colors_of(model);
	psr_model_is_prefix(model, &card->prefix);
	psr_model_content_id(model, card->content_id);
	card->presets.camera = copy(presets->camera, presets->n_cameras, sizeof *presets->camera);
	card->presets.light = copy(presets->light, presets->n_lights, sizeof *presets->light);
	if ((presets->n_cameras == 0 || card->presets.camera != NULL)
	    && (presets->n_lights == 0 || card->presets.light != NULL))
		return PSR_OK;
	card_fini(card);
	return PSR_ERR_MEMORY;
}

void card_fini(struct card *card)
{
	free((void *)card->presets.camera);
	free((void *)card->presets.light);
	card->presets = (struct psr_presets){ 0 };
}
