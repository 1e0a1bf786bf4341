/* The table of kernels, the time-critical loops of a frame: one table for each instruction set. loops/ has most of them
 * as plain loops, which the compiler turns into vectors; c/ has the reference of the others, avx2/ and avx512/ variants
 * by hand. All variants give the same bits (tests/simd compares them): one evaluation tree, true division, no
 * contraction, choices by data alone. */
#ifndef PSR_SIMD_SIMD_H
#define PSR_SIMD_SIMD_H

#include "psr/render.h"
#include "isa.h"
#include "average.h"
#include "cull.h"
#include "discs.h"
#include "fill.h"
#include "gaps.h"
#include "holes.h"
#include "reproject.h"
#include "shadow.h"
#include "smooth.h"
#include "strip.h"
#include "veil.h"
#include "warp.h"

struct simd {
	cull_fn *cull, *cull_cones;
	warp_far_fn *warp_far;
	warp_clear_fn *warp_clear;
	warp_cells_fn *warp_cells;
	warp_fn *warp;
	warp_fn *warp_leaves; /* of entries that are cubes; the former's are blocks */
	warp_fn *warp_points; /* of entries that are groups of differential points: of level 0, without cells */
	/* The words of cubes as EWA splats; then, with all words drawn, the sums of their pixels. The latter returns how many
	 * splats it was given. Neither lowers cells. */
	warp_fn *ewa_words;
	warp_fn *ewa_sums;
	veil_fn *veil;
	discs_of_block_fn *discs_of_block;
	discs_place_fn *discs_place;
	discs_draw_fn *discs_draw;
	strip_list_fn *strip_list;
	strip_find_fn *strip_find;
	strip_read_fn *strip_read;
	strip_resolve_fn *strip_resolve;
	strip_shadow_fn *strip_shadow;
	shadow_sink_fn *shadow_sink;
	strip_light_fn *strip_light;
	strip_lit_fn *strip_lit;
	strip_color_fn *strip_color;
	strip_write_fn *strip_write;
	depth_row_fn *depth_row;
	gaps_fn *gaps;
	holes_fn *holes;
	fill_pull_weights_fn *fill_pull_weights;
	fill_pull_colors_fn *fill_pull_colors;
	fill_push_fn *fill_push;
	fill_push_picture_fn *fill_push_picture;
	fill_far_fn *fill_far;
	fill_beside_fn *fill_beside;
	fill_pick_fn *fill_pick;
	fill_own_fn *fill_own;
	fill_depths_fn *fill_depths;
	smooth_places_fn *smooth_places;
	smooth_fn *smooth;
	average_light_fn *average_light;
	average_around_fn *average_around;
	average_depth_fn *average_depth;
	reproject_depths_fn *reproject_depths;
	reproject_texels_fn *reproject_texels;
	reproject_fit_fn *reproject_fit;
	reproject_bound_fn *reproject_bound;
	reproject_cells_fn *reproject_cells;
	reproject_look_fn *reproject_look;
};

extern const struct simd simd_c, simd_avx2, simd_avx512;
const struct simd *simd_of(enum psr_isa isa); /* NULL if the build or the machine lacks it */
const struct simd *simd_get(void);            /* of psr_isa_get() */

#endif
