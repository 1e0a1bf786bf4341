#include "simd/loops/table.h"

#define AS_LOOPS(kernel) kernel

const struct simd simd_c = SIMD_TABLE(warp_c, warp_leaves_c, veil_c, reproject_look, AS_LOOPS);
