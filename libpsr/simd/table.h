/* The loops, and the table of one instruction set, for c/, avx2/ and avx512/: the variants of the kernels that are written by
 * hand are its arguments. */
#include "simd/cull.h"
#include "simd/fill.h"
#include "simd/gaps.h"
#include "simd/kernels.h"
#include "simd/shadow.h"
#include "simd/strip.h"
#include "simd/warp_clear.h"

#define SIMD_TABLE(warp_kernel, list_kernel, find_kernel, write_kernel) { \
	.cull = cull,                               \
	.warp_far = warp_far,                       \
	.warp_clear = warp_clear,                   \
	.warp = warp_kernel,                        \
	.strip_list = list_kernel,                  \
	.strip_find = find_kernel,                  \
	.strip_resolve = strip_resolve,             \
	.strip_shadow = strip_shadow,               \
	.strip_light = strip_light,                 \
	.strip_lit = strip_lit,                     \
	.strip_color = strip_color,                 \
	.strip_write = write_kernel,                \
	.depth_row = depth_row,                     \
	.gaps = gaps,                               \
	.fill_pull = fill_pull,                     \
	.fill_push = fill_push,                     \
	.fill_push_picture = fill_push_picture,     \
	.fill_depths = fill_depths,                 \
}
