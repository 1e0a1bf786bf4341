/* A model's card: the facts that psrd tells clients, kept even while the model is out of memory. */
#ifndef PSRD_CARD_H
#define PSRD_CARD_H

#include <stdint.h>
#include "psr/model.h"

struct card {
	uint8_t content_id[16];
	struct psr_model_info info;
	struct psr_presets presets; /* freed by the card */
	uint32_t n_levels, n_blocks;
	uint64_t n_samples;
	int has_sheer; /* some samples let a part of the light through */
};

/* Fills the card of a model that has blocks. MEMORY: the card then holds nothing. */
int card_init(struct card *card, const struct psr_model *model);
void card_fini(struct card *card);

#endif
