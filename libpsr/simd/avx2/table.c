#include "simd/loops/table.h"

#define AS_LOOPS(kernel) kernel

const struct simd simd_avx2 = SIMD_TABLE(warp_avx2, warp_leaves_avx2, veil_avx2, reproject_look_avx2, AS_LOOPS);
