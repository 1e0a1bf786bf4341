/* Kernels of the warp ([G] 7.1) and of the hierarchical z-buffer ([G] 7.2). */
#ifndef PSR_SIMD_WARP_H
#define PSR_SIMD_WARP_H

#include "model/cubes.h"
#include "model/points.h"
#include "ewa.h"
#include "tile.h"
#include "zstack.h"

/* A sample of a one-sided block faces away when its normal (psr_direction_tens) is more than this sine beyond
 * perpendicular, the quantisation error of normals. [G] 7.3.2 shades such samples with weight 0; psr drops them in the
 * warp, before they hide anything, so that open one-sided surfaces are transparent from behind. */
#define BACK_SINE 0.0125f

/* The lattice of one projection in a picture, at level 0; at level l all but `origin` is 2^l times as long, exactly.
 * Axis a is u z', v z' or z' (orthographic: without the factor z'). A sample of row r and column c at depth z lies at
 * origin + (row of its block + r) down + (column of its block + c + (r & 1) / 2) step + z along.
 *
 * This is [G]'s incremental form (7.6): p, q and r are the terms of row and column, looked up instead of accumulated,
 * so that rounding does not add up along a row and holes cost nothing. A row's term stays a double until it is the
 * block's, so that positions are as exact close to the eye. (7.6') is no faster, and off by pixels where A_zz is near 0
 * (tests/simd/forms --bench). */
struct warp_lattice {
	double origin[3], step[3], down[3], along[3];
	double row[3][8]; /* r * down + (r & 1) / 2 * step */
	float col[3][8];  /* c * step */
	struct psr_placing placing;
};

/* Cubes in a picture, at one level: what lies between their middles and those of octants, of these and leaves of each
 * octant, and a leaf's offset, a third of which is a vector of `along` for each component of its normal of 511ths.
 * [B] (1) adds one of the former to another. */
struct warp_octants {
	double row[3][8];
	float col[3][8];
	float along[3][3];
};

/* Axis a of a point p of inner coordinates is origin[a] + axis[a] . p, as that of a lattice. */
struct warp_cubes {
	const struct psr_cubes *model;
	double origin[3], axis[3][3];
	struct warp_octants level[CUBES_MOST_LEVELS];
	struct ewa_view ewa; /* of plans with EWA splats */
};

/* Differential points in a picture. Axis a of a point p of inner coordinates is origin[a] + axis[a] . p: focal times x
 * and y from where the view axis meets the picture, and z'. */
struct warp_points {
	const struct psr_points *model;
	const struct dpoint_tables *tables;
	const float (*direction)[3]; /* psr_direction_table() */
	double origin[3], axis[3][3];
	double eye[3];               /* inner coordinates */
	/* The line of sight through a pixel: inner coordinates for a z' of 1, which a pixel to the right or down adds to
	 * `forward`; orthographic: which a pixel adds to where the line begins. */
	float right[3], down[3], forward[3];
	float center[2];             /* pixels: where the view axis meets the picture */
	float graze;                 /* dpoint.h */
};

struct warp_instance {
	const struct psr_blocks *blocks;    /* groups of an octree or of points: those of `cubes` or `points` */
	const struct warp_cubes *cubes;     /* NULL: no octree */
	const struct warp_points *points;   /* NULL: no differential points. Both NULL: blocks */
	const struct warp_lattice *lattice; /* one a projection */
	uint32_t first_slot;
	/* The direction of sight through (u, v), in inner coordinates: u du + v dv + d0, of any length. */
	float du[3], dv[3], d0[3];
	float turn[3][3]; /* inner coordinates to camera space, a rotation */
};

/* A block that may show in a tile. */
struct bin_entry {
	uint32_t slot;
	uint16_t instance;
	uint8_t level;         /* of the depth buffer that fits the block */
	uint8_t is_mixed : 1;  /* some of its samples may face away */
	uint8_t at_border : 1; /* it may reach beyond the picture */
	uint8_t is_wide : 1;   /* a cube's leaves: wider than pixels, so that their offsets count */
	uint32_t hit;          /* index in bins->hit */
};

/* One tile of the z-buffer: its words, and the cells of each level that belong to it, which are those of its pixels
 * and, at the picture's border, of the guard band. Pixels count from the picture's corner, cells from the guard band's.
 * */
struct warp_target {
	const struct warp_instance *instance;
	const uint32_t *direction; /* psr_direction_tens() */
	float near_z;
	int perspective;
	uint64_t *word; /* the word of pixel (x0, y0); kernels leave the gaps between rows alone */
	unsigned place_bits; /* of words, struct psr_zstack's; not 0 for blocks alone */
	uint32_t stride;
	int32_t x0, y0, x1, y1;
	int32_t above, below; /* rows of the tile that are not the target's: differential points are counted there, too */
	uint32_t clean; /* bits of parts whose words are empty before the tile is cleared */
	uint32_t bare;  /* bits of parts where nothing is drawn */
	/* By bin_entry.hit, what an entry of cubes draws: bit i the cube of its slot + i. All are of one run. NULL: each
	 * entry of cubes is one. */
	const uint64_t *cubes;
	struct ewa_sum *sum; /* of pixel (x0, y0), for ewa_sums */
	uint32_t sum_stride;
	struct warp_cells {
		float *z;
		uint32_t stride, first;
		int32_t x0, y0, x1, y1; /* pixels of the cells, of which `first` is the first */
	} cells[PSR_MAX_DEPTH_LEVEL + 1];
};

/* Warps the samples of blocks into the tile: a word, and for entries with a level above 0 a cell, keeps the nearest
 * sample that lies beyond near_z and does not face away. Returns how many samples fell into the tile. */
typedef uint64_t warp_fn(const struct warp_target *target, const struct bin_entry *entry, uint32_t n);

/* Empties a tile: all words but those of clean parts, and the cells of the levels in the bit mask. */
typedef void warp_clear_fn(const struct warp_target *target, uint32_t levels);

/* Derives the cells of a level from the tile's words: each becomes the least z' of its pixels, bare parts left out, and
 * cells of the guard band become empty. The same result as lowering them sample by sample, if all blocks drawn so far
 * belong to that level. */
typedef void warp_cells_fn(const struct warp_target *target, int level);

/* Finds the greatest z' of each 8x8 pixels of a tile, as bits: far[y / 8 * (TILE_WIDTH / 8) + x / 8]; +inf where a
 * pixel is empty. */
#define FAR_SIDE 8
#define FAR_CELLS (TILE_HEIGHT / FAR_SIDE * (TILE_WIDTH / FAR_SIDE))
typedef void warp_far_fn(const struct warp_target *target, uint32_t far[FAR_CELLS]);

#endif
