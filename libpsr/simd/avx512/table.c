#include "simd/loops/table.h"

#define BY_HAND(kernel) kernel##_avx512

const struct simd simd_avx512 = SIMD_TABLE(warp_avx512, warp_leaves_avx512, veil_avx512, reproject_look_avx2, BY_HAND);
