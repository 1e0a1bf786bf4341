/* The loops and the table of one instruction set; c/, avx2/ and avx512/ include this file, each compiled for its own
 * instructions. Arguments: the name of the set, the kernels of reproject_look and smooth_places, and two macros that name
 * a kernel's variant where one is written by hand: for AVX2 and AVX-512 (PIXELS), and for AVX-512 alone. */
#include "average.h"
#include "cull.h"
#include "discs.h"
#include "fill_near.h"
#include "fill_pull.h"
#include "fill_push.h"
#include "gaps.h"
#include "simd/kernels.h"
#include "holes.h"
#include "light.h"
#include "points.h"
#include "reproject.h"
#include "reproject_fit.h"
#include "shadow.h"
#include "smooth.h"
#include "strip.h"
#include "zbuffer.h"

#define SIMD_TABLE(isa, look_kernel, places_kernel, PIXELS, KERNEL) { \
	.cull = cull,                                  \
	.cull_cones = cull_cones,                      \
	.warp_far = warp_far,                          \
	.warp_clear = warp_clear,                      \
	.warp_cells = warp_cells,                      \
	.warp = warp_##isa,                            \
	.warp_leaves = warp_leaves_##isa,              \
	.warp_points = PIXELS(warp_points),            \
	.ewa_words = ewa_words_##isa,                  \
	.ewa_sums = ewa_sums_##isa,                    \
	.veil = veil_##isa,                            \
	.discs_of_block = discs_of_block,              \
	.discs_place = discs_place,                    \
	.discs_draw = discs_draw,                      \
	.strip_list = PIXELS(strip_list),              \
	.strip_find = strip_find,                      \
	.strip_read = KERNEL(strip_read),              \
	.strip_resolve = strip_resolve,                \
	.strip_shadow = strip_shadow,                  \
	.shadow_sink = shadow_sink,                    \
	.strip_light = strip_light,                    \
	.strip_lit = strip_lit,                        \
	.strip_color = strip_color,                    \
	.strip_write = PIXELS(strip_write),            \
	.depth_row = depth_row,                        \
	.gaps = gaps,                                  \
	.holes = holes,                                \
	.fill_pull_weights = KERNEL(fill_pull_weights),\
	.fill_pull_colors = KERNEL(fill_pull_colors),  \
	.fill_push = KERNEL(fill_push),                \
	.fill_push_picture = KERNEL(fill_push_picture),\
	.fill_far = fill_far,                          \
	.fill_beside = fill_beside,                    \
	.fill_pick = fill_pick,                        \
	.fill_own = fill_own,                          \
	.fill_depths = fill_depths,                    \
	.smooth_places = places_kernel,                \
	.smooth = smooth,                              \
	.average_light = average_light,                \
	.average_around = average_around,              \
	.average_depth = average_depth,                \
	.reproject_depths = reproject_depths,          \
	.reproject_texels = reproject_texels,          \
	.reproject_fit = reproject_fit,                \
	.reproject_bound = reproject_bound,            \
	.reproject_cells = reproject_cells,            \
	.reproject_look = look_kernel,                 \
}
