#include "simd/fill.h"
#include "simd/gaps.h"
#include "simd/kernels.h"
#include "simd/cull.h"
#include "simd/shadow.h"
#include "simd/strip.h"
#include "simd/warp_clear.h"

const struct simd simd_avx2 = {
	.cull = cull,
	.warp_far = warp_far,
	.warp_clear = warp_clear,
	.warp = warp_avx2,
	.strip_list = strip_list,
	.strip_resolve = strip_resolve,
	.strip_shadow = strip_shadow,
	.strip_light = strip_light,
	.strip_lit = strip_lit,
	.strip_color = strip_color,
	.strip_write = strip_write,
	.depth_row = depth_row,
	.gaps = gaps,
	.fill_pull = fill_pull,
	.fill_push = fill_push,
	.fill_push_picture = fill_push_picture,
	.fill_depths = fill_depths,
};
