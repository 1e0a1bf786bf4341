/* Cuts of discs: where a block's lattice lacks a sample beside one that it has, the surface may end between them. */
#ifndef PSR_RENDER_SPLAT_CUT_H
#define PSR_RENDER_SPLAT_CUT_H

#include <stdint.h>

/* Where discs are cut, in steps of the lattice. Surfaces end anywhere on the way to the missing sample, in the mean
 * half a step away; but a sample may stand off the surface (PSR_SAMPLE_OFF), most often beyond its edge. Measured. */
#define SPLAT_CUT 0.3f

/* Samples of a block that have no neighbour along the lattice's three lines, one step on and one step back, where the
 * neighbour would be in the block. */
struct splat_ends {
	uint64_t next[3], last[3], any;
};

static inline uint64_t splat_shift(uint64_t mask, int by)
{
	return by < 0 ? mask << -by : mask >> by;
}

/* Returns the samples of a row's parity whose place (row, col) away is in the block and not in the mask. */
static inline uint64_t splat_lacking(uint64_t mask, uint64_t parity, int row, int col)
{
	const uint64_t columns = col > 0 ? 0x7f7f7f7f7f7f7f7f : col < 0 ? 0xfefefefefefefefe : UINT64_MAX;
	const uint64_t rows = row > 0 ? UINT64_MAX >> 8 : row < 0 ? UINT64_MAX << 8 : UINT64_MAX;

	return mask & parity & columns & rows & ~splat_shift(mask, 8 * row + col);
}

/* Odd rows are half a step to the right: there a neighbour in another row is one column further. */
static inline uint64_t splat_lacking_beside(uint64_t mask, int row, int even_col)
{
	const uint64_t even = 0x00ff00ff00ff00ff;

	return splat_lacking(mask, even, row, even_col) | splat_lacking(mask, ~even, row, even_col + 1);
}

static inline void splat_find_ends(struct splat_ends *ends, uint64_t mask)
{
	ends->next[0] = splat_lacking(mask, UINT64_MAX, 0, 1);
	ends->last[0] = splat_lacking(mask, UINT64_MAX, 0, -1);
	ends->next[1] = splat_lacking_beside(mask, 1, 0);
	ends->last[1] = splat_lacking_beside(mask, -1, -1);
	ends->next[2] = splat_lacking_beside(mask, 1, -1);
	ends->last[2] = splat_lacking_beside(mask, -1, 0);
	ends->any = 0;
	for (int i = 0; i < 3; i++)
		ends->any |= ends->next[i] | ends->last[i];
}

/* A disc's cuts. A place in units of its two radii is line[i] . place steps along line i, and on the disc's side of all
 * cuts if these are low[i] to high[i]. */
struct splat_cut {
	float line[3][2], low[3], high[3];
};

/* radius: of the disc along rows and across them, in steps. */
static inline void splat_cut_make(struct splat_cut *cut, const struct splat_ends *ends, uint32_t sample,
                                  const float radius[2])
{
	static const float line[3][2] = { { 1, 0 }, { 0.5f, 0.866025404f }, { -0.5f, 0.866025404f } };
	const float nowhere = 4; /* in steps: beyond any disc */

	for (int i = 0; i < 3; i++) {
		for (int k = 0; k < 2; k++)
			cut->line[i][k] = line[i][k] * radius[k];
		cut->low[i] = ends->last[i] >> sample & 1 ? -SPLAT_CUT : -nowhere;
		cut->high[i] = ends->next[i] >> sample & 1 ? SPLAT_CUT : nowhere;
	}
}

static inline int splat_is_cut_off(const struct splat_cut *cut, const float place[2])
{
	int is_off = 0;

	for (int i = 0; i < 3; i++) {
		const float along = cut->line[i][0] * place[0] + cut->line[i][1] * place[1];

		is_off |= (along < cut->low[i]) | (along > cut->high[i]);
	}
	return is_off;
}

#endif
