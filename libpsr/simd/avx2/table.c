#include "points_spread.h"
#include "simd/loops/table.h"

#define AS_LOOPS(kernel) kernel
#define BY_HAND(kernel) kernel##_avx2

const struct simd simd_avx2 = SIMD_TABLE(avx2, reproject_look_avx2, smooth_places_avx2, BY_HAND, AS_LOOPS);
