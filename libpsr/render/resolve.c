#include "base/srgb.h"
#include "render/block.h"

/* 2^(e / 16), the Phong exponents ([G] table 5.1: 8 bits). */
static float exponent_of(uint32_t e)
{
	static const float root[16] = {
		1.0f,        1.04427378f, 1.09050773f, 1.13878863f, 1.18920712f, 1.24185781f, 1.29683955f, 1.35425555f,
		1.41421356f, 1.47682615f, 1.54221083f, 1.61049033f, 1.68179283f, 1.75625216f, 1.83400809f, 1.91520656f,
	};
	return root[e & 15] * (float)(1u << (e >> 4));
}

static float part(uint32_t bits, int shift, uint32_t max)
{
	return psr_srgb_to_linear[((bits >> shift & max) * 255 + max / 2) / max];
}

/* Positions are the samples' own, not those of the pixels that they fell into ([G] 7.3 takes the pixel's), so that
 * light depends on the model alone. */
void resolve_strip(const struct plan *plan, const uint64_t *word, struct strip *strip)
{
	const float(*direction)[3] = psr_direction_table();
	const struct plan_instance *in = &plan->instance[strip->instance];
	const struct psr_blocks *b = in->blocks;

	for (uint32_t i = 0; i < strip->n; i++) {
		const uint32_t id = (uint32_t)word[strip->pixel[i]];
		const uint32_t block = id / PSR_BLOCK_SAMPLES - in->first_slot, sample = id % PSR_BLOCK_SAMPLES;
		const uint64_t a = block_attr(b, block, sample);
		const float *n = direction[PSR_ATTR_NORMAL(a)];
		const uint32_t diffuse = PSR_ATTR_DIFFUSE(a), specular = PSR_ATTR_SPECULAR(a);
		float p[3], eye[3];

		block_position(b, block, sample, p);
		to_eye(plan, in, p, eye);
		const float g = n[0] * eye[0] + n[1] * eye[1] + n[2] * eye[2];
		const int two_sided = b->flags[block] & PSR_BLOCK_TWO_SIDED;
		const float turn = two_sided && g < 0 ? -1 : 1;
		strip->px[i] = p[0];
		strip->py[i] = p[1];
		strip->pz[i] = p[2];
		strip->nx[i] = n[0] * turn;
		strip->ny[i] = n[1] * turn;
		strip->nz[i] = n[2] * turn;
		strip->dr[i] = part(diffuse, 0, 255);
		strip->dg[i] = part(diffuse, 8, 255);
		strip->db[i] = part(diffuse, 16, 255);
		strip->sr[i] = part(specular, 0, 31);
		strip->sg[i] = part(specular, 5, 63);
		strip->sb[i] = part(specular, 11, 31);
		strip->exponent[i] = exponent_of(PSR_ATTR_EXPONENT(a));
		strip->unlit[i] = (uint8_t)PSR_ATTR_UNLIT(a);
	}
}
