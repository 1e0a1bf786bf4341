#include "renderer.h"

#include <stdlib.h>
#include "base/mem.h"
#include "base/srgb.h"

int psr_renderer_create(struct psr_renderer **out, struct psr_error *err)
{
	struct psr_renderer *r = calloc(1, sizeof *r);

	if (r == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a renderer");
	r->simd = simd_get();
	r->srgb = psr_srgb_of_16_bits();
	sheer_init(&r->sheer);
	*out = r;
	return PSR_OK;
}

void renderer_use(struct psr_renderer *r, const struct simd *simd)
{
	r->simd = simd;
}

struct refiner **renderer_refiner(struct psr_renderer *r)
{
	return &r->refiner;
}

void psr_renderer_destroy(struct psr_renderer *r)
{
	if (r == NULL)
		return;
	refiner_destroy(r->refiner);
	plan_clear(&r->plan);
	shadow_destroy(r->shadow);
	bins_clear(&r->bins);
	fill_clear(&r->fill);
	smooth_clear(&r->smooth);
	sheer_clear(&r->sheer);
	buffers_clear(&r->buffers);
	psr_free_huge(r->lit, r->lit_size);
	free(r);
}

uint64_t psr_renderer_bytes(const struct psr_renderer *r)
{
	const uint64_t refiner = r->refiner != NULL ? refiner_bytes(r->refiner) : 0;

	return sizeof *r + refiner + r->plan.storage_size + r->fill.storage_size + r->smooth.storage_size
	       + sheer_bytes(&r->sheer) + r->buffers.pixels_size + r->buffers.counters_size + r->buffers.sum_size + r->lit_size
	       + bins_bytes(&r->bins) + shadow_bytes(r->shadow);
}

void renderer_set_inside(struct psr_renderer *r, const struct inside *inside)
{
	r->inside = inside;
}

const struct simd *renderer_simd(const struct psr_renderer *r)
{
	return r->simd;
}

struct wide_light renderer_light(const struct psr_renderer *r)
{
	const struct buffers *b = &r->buffers;

	return (struct wide_light){ { b->rgb[0], b->rgb[1], b->rgb[2] } };
}
