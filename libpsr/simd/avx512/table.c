#include "points_spread.h"
#define SMOOTH_RUN 16
#include "simd/loops/table.h"

#define BY_HAND(kernel) kernel##_avx512

const struct simd simd_avx512 = SIMD_TABLE(avx512, reproject_look_avx2, smooth_places, BY_HAND, BY_HAND);
