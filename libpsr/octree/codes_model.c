#include <string.h>
#include "codes.h"
#include "codes_model.h"

/* exp(-x / 256) in units of 2^-30, x 0..2048, by repeated multiplication with exp(-1/256) = 1069556082 * 2^-30. */
static void make_shares(struct codes_model *model)
{
	uint64_t power = (uint64_t)1 << 30;

	for (int x = 0; x <= 2047; x++) {
		/* 1 / (1 + exp(-x)) */
		const uint64_t share = ((uint64_t)65536 << 30) / (((uint64_t)1 << 30) + power);

		model->share[2048 + x] = (uint16_t)(share > 65504 ? 65504 : share);
		model->share[2048 - x] = (uint16_t)(65536 - model->share[2048 + x]);
		power = power * 1069556082 >> 30;
	}
	model->share[0] = model->share[1];
	for (int p = 0, x = 1; p < 4096; p++) {
		while (x < 4095 && model->share[x] < 16 * p + 8)
			x++;
		model->logit[p] = (int16_t)(x - 2048);
	}
}

/* How much a level has shown of a context: nothing, a little, more. */
static int known_of(int count)
{
	return count <= KEPT_COUNT ? 0 : count < 15 ? 1 : 2;
}

static void make_counts(struct codes_model *model)
{
	for (int n = 0; n <= COUNTS; n++) {
		model->part[n] = (uint32_t)(16384 / (n + 2));
		model->more[n] = n < COUNTS;
		model->set_by_d[n] = (uint8_t)(3 * known_of(n) << 4);
		model->set_by_e[n] = (uint8_t)(known_of(n) << 4);
	}
}

static void make_places(struct codes_model *model)
{
	for (unsigned plane = 0; plane < 512; plane++) {
		model->across[plane] = 0;
		for (unsigned i = 0; i < 9; i++)
			model->across[plane] |= (plane >> i & 1) << (10 * (i % 3) + i / 3);
	}
}

static void fill(uint32_t *p, size_t n)
{
	for (size_t i = 0; i < n; i++)
		p[i] = CODER_COUNTED_EVEN;
}

void *codes_mixed_model(void)
{
	struct codes_model *model = malloc(sizeof *model);

	if (model == NULL)
		return NULL;
	fill(model->a, 1 << A_BITS);
	fill(model->b, 1 << B_BITS);
	fill(model->d, 1 << D_BITS);
	fill(model->e, 1 << E_BITS);
	fill(model->f, 1 << F_BITS);
	for (int s = 0; s < WEIGHT_SETS; s++)
		model->weight[s] = (words){ 1600, 1600, 1600, 1600, 1600, 0, 3200, 0 };
	memset(model->of_plane, 0, sizeof model->of_plane);
	memset(model->of_code, 0, sizeof model->of_code);
	memset(model->of_own, 0, sizeof model->of_own);
	memset(model->of_window, 0, sizeof model->of_window);
	memset(model->of_near, 0, sizeof model->of_near);
	memset(model->of_far, 0, sizeof model->of_far);
	make_shares(model);
	make_counts(model);
	make_places(model);
	return model;
}

static void forget(uint32_t *p, size_t n)
{
	for (size_t i = 0; i < n; i++)
		if ((p[i] & 1023) > KEPT_COUNT)
			p[i] = (p[i] & ~1023u) | KEPT_COUNT;
}

void codes_model_forget(struct codes_model *model, int is_sparse)
{
	forget(model->d, 1 << D_BITS);
	forget(model->e, 1 << E_BITS);
	if (is_sparse)
		return;
	forget(model->a, 1 << A_BITS);
	forget(model->b, 1 << B_BITS);
	forget(model->f, 1 << F_BITS);
}
