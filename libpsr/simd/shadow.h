/* Kernels of shadow maps ([G] 7.3.1). */
#ifndef PSR_SIMD_SHADOW_H
#define PSR_SIMD_SHADOW_H

#include "strip.h"

/* A map: for each level k in use the nearest z' in cells of 2^k texels, sunk (shadow_sink_fn), with a guard band of one
 * cell. A cell holds steps beyond `from`, rounded up, or SHADOW_EMPTY. Lengths are in the map's own units; a unit of
 * the camera is `scale` of them. */
#define SHADOW_EMPTY 0xffff
struct shadow_map {
	int perspective;
	float turn[3][3], move[3]; /* camera space to the map's: turn p + move */
	float scale;
	float focal, half_width, half_height, near_z;
	/* Biases of the comparison: the fall of the sample's plane over slope_bias cells, texel_bias widths of a cell, and
	 * slack for rounding. */
	float slope_bias, texel_bias, slack;
	float from, step;
	uint32_t levels; /* bit k: level k is in use */
	struct {
		const uint16_t *z;
		const uint16_t *seam; /* the nearest of the cell and the finer level's four in it; NULL if that is not in use */
		uint32_t stride;
		float most_x, most_y; /* greatest coordinates, in cells, that four cells surround */
	} level[PSR_MAX_DEPTH_LEVEL + 1];
};

#define SHADOW_FACES 6

/* The maps of one light: none if it casts no shadow, one, or some faces of a cube around it. */
struct shadow_light {
	uint32_t n_maps;
	struct shadow_map map[SHADOW_FACES];
};

/* Finds how much of a light reaches each sample of a strip with positions: 2 - 2 c, clamped to 0..1, where c is the
 * greatest coverage by a level's cells nearer to the light; 0 where the surface faces away. Returns 0, and leaves
 * `reaches` undefined, if no sample faces the light. */
typedef int strip_shadow_fn(const struct strip *strip, const struct shadow_light *shadow, float *reaches);

/* Three rows of depths: the row above, the row itself, the row below. */
struct shadow_rows {
	const float *above, *own, *below;
};

/* Quantises n cells of a map, sinking all but the first and last: away from the light, by the fall of their surface
 * within a cell. In each direction that is the lesser difference to the two neighbours, or 0 at an edge, where the
 * differences have opposite signs. A cell holds its nearest sample; where two faces meet, unsunk cells of one would
 * shadow the other. */
typedef void shadow_sink_fn(uint16_t *restrict to, const struct shadow_rows *rows, uint32_t n, float from, float step);

#endif
