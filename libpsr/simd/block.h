/* A block prepared for the warp; all variants use it. */
#ifndef PSR_SIMD_BLOCK_H
#define PSR_SIMD_BLOCK_H

#include "warp.h"

struct warp_block {
	double origin[3]; /* of its first lattice point, at depth 0 */
	double scale;     /* 2^level */
	float unit[3];    /* added by a step of depth */
	float rise;       /* a step of depth, in inner units */
	const struct warp_lattice *lattice;
	const uint16_t *depth;
	const uint64_t *attr;
	uint64_t mask;
	uint32_t id;
};

/* A block's terms of row and column, p, q and r of [G] (7.5). */
struct warp_terms {
	float row[3][8], col[3][8];
};

static inline void warp_block_make(struct warp_block *out, const struct warp_instance *in, uint32_t slot)
{
	const struct psr_blocks *b = in->blocks;
	const uint32_t block = slot - in->first_slot;
	const struct warp_lattice *lattice = &in->lattice[b->block_projection[block]];
	const double scale = (double)(1u << psr_blocks_level(b, block));
	const uint32_t first = psr_blocks_attr_first(b, block);
	struct psr_place place;

	psr_placing_find(&lattice->placing, b, block, &place);
	const double bias = place.z - 32768 * (double)place.step;
	for (int a = 0; a < 3; a++) {
		const double across = place.col * lattice->step[a] + place.row * lattice->down[a];

		out->origin[a] = (lattice->origin[a] + bias * lattice->along[a]) + across;
		out->unit[a] = (float)lattice->along[a] * place.step;
	}
	out->scale = scale;
	out->rise = place.step;
	out->lattice = lattice;
	out->depth = b->depth + first;
	out->attr = b->attr + first;
	out->mask = b->mask[block];
	out->id = slot * PSR_BLOCK_SAMPLES;
}

static inline void warp_terms_make(struct warp_terms *out, const struct warp_block *b)
{
	for (int a = 0; a < 3; a++)
		for (int i = 0; i < 8; i++) {
			out->row[a][i] = (float)(b->origin[a] + b->scale * b->lattice->row[a][i]);
			out->col[a][i] = (float)b->scale * b->lattice->col[a][i];
		}
}

/* Axis a of the sample of row r and column c: x', y' or z' of (7.6). */
static inline float warp_axis(const struct warp_terms *terms, const struct warp_block *b, int a, uint32_t r, uint32_t c,
                              float depth)
{
	return (terms->row[a][r] + terms->col[a][c]) + depth * b->unit[a];
}

#endif
