/* The kernels: what of a frame takes time, as one table of functions for each ISA. c/ has the reference of every
 * kernel; avx2/ and avx512/ have variants that give the same bits (tests/simd compares them): one evaluation tree, true
 * division, no contraction, choices by data alone. */
#ifndef PSR_SIMD_SIMD_H
#define PSR_SIMD_SIMD_H

#include <stdint.h>
#include "psr/isa.h"
#include "psr/render.h"

/* A sample of a one-sided block faces away when its normal is more than this sine beyond perpendicular: what
 * normals are quantised to. [G] 7.3.2 gives such samples weight 0 when they are shaded; here they are left out
 * when they are warped, before they hide what is behind them, so that open one-sided surfaces are seen through
 * from their backs. */
#define BACK_SINE 0.0125f

/* ---- warp ([G] 7.1, 7.2) ---- */

/* The lattice of one projection in the picture of a frame, at level 0; at level l all but `origin` is 2^l times as long,
 * exactly. Axis a is u z', v z' or z' (without z' if orthographic). A sample of row r and column c at depth z is at
 * origin + (8 block row + r) down + (8 block column + c + (r & 1) / 2) step + z along: [G] (7.3) with the terms of
 * lattice position apart (7.1.1), looked up and not accumulated, so that no rounding adds up along a row. */
struct warp_lattice {
	double origin[3], step[3], down[3], along[3];
	double row[3][8]; /* r * down + (r & 1) / 2 * step */
	float col[3][8];  /* c * step */
};

struct warp_instance {
	const struct psr_blocks *blocks;
	const struct warp_lattice *lattice; /* one a projection */
	uint32_t first_slot;
	/* The direction of sight through (u, v), in inner coordinates: u du + v dv + d0, of any length. */
	float du[3], dv[3], d0[3];
};

/* A block that may show in a tile. */
struct bin_entry {
	uint32_t slot;
	uint16_t instance;
	uint8_t level;    /* of the depth buffer that fits the block */
	uint8_t is_mixed; /* some of its samples may face away */
};

/* One tile of the picture, and for each level the cells that belong to it: those of its pixels, and at the picture's
 * border the guard band. Pixels count from the picture's corner, cells from the guard band's. */
struct warp_target {
	const struct warp_instance *instance;
	const float (*direction)[3];
	float near_z;
	int perspective;
	uint64_t *word; /* of the whole picture; WARP_PADDING more can be written */
	uint32_t stride;
	int32_t x0, y0, x1, y1;
	struct warp_cells {
		float *z;
		uint32_t stride, first;
		int32_t x0, y0, x1, y1; /* pixels whose cells belong to the tile, of which `first` is one */
	} cells[PSR_MAX_DEPTH_LEVEL + 1];
};
#define WARP_PADDING 16

/* Lowers words, and the cells of entries with a level above 0, to the samples of the entries' blocks that fall into the tile,
 * lie beyond near_z and do not face away. Returns how many samples fell into the tile. */
typedef uint64_t warp_fn(const struct warp_target *target, const struct bin_entry *entry, uint32_t n);

/* Makes a tile empty: words, and cells of the levels of the bit mask. */
typedef void warp_clear_fn(const struct warp_target *target, uint32_t levels);

struct simd {
	warp_clear_fn *warp_clear;
	warp_fn *warp;
};

extern const struct simd simd_c, simd_avx2, simd_avx512;
const struct simd *simd_of(enum psr_isa isa); /* NULL if this build or machine has none */
const struct simd *simd_get(void);            /* that of psr_isa_get() */

#endif
