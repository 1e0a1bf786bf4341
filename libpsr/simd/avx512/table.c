#include "simd/kernels.h"
#include "simd/warp_clear.h"

const struct simd simd_avx512 = {
	.warp_clear = warp_clear,
	.warp = warp_avx512,
};
