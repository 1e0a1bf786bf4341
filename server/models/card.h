/* A model's card: the facts that psrd tells clients, kept even while the model is out of memory. */
#ifndef PSRD_CARD_H
#define PSRD_CARD_H

#include <stdint.h>
#include "psr/model.h"
#include "psr/scene.h"

struct card {
	uint8_t content_id[16];
	struct psr_model_info info;
	struct psr_presets presets; /* freed by the card */
	uint32_t representations; /* bit r: enum psr_wire_rep r */
	uint32_t colors;          /* bit c: enum psr_wire_color c, where nobody names a representation */
	uint32_t n_levels;        /* these of what is drawn where nobody names a representation */
	uint32_t n_blocks, n_cubes, n_points; /* of blocks, of the octree, groups of differential points; 0 without */
	uint64_t n_samples;
	struct psr_model_prefix prefix; /* zeros of a whole file */
	int has_sheer; /* some samples let a part of the light through */
	int is_calibrated; /* its blocks' ladder is measured (model/calibration.h) */
};

/* Fills the card of a model, whose cubes are made. MEMORY: the card then holds nothing. */
int card_init(struct card *card, const struct psr_model *model);
void card_fini(struct card *card);

/* Returns how many blocks, cubes or groups of this representation a model has, at all levels. */
static inline uint32_t card_groups(const struct card *card, enum psr_representation representation)
{
	if (representation == PSR_AUTOMATIC)
		return card->n_blocks > 0 ? card->n_blocks : card->n_cubes > 0 ? card->n_cubes : card->n_points;
	return representation == PSR_DPOINTS ? card->n_points : representation == PSR_OCTREE ? card->n_cubes : card->n_blocks;
}

#endif
