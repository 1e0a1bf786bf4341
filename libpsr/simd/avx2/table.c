#include "simd/table.h"

const struct simd simd_avx2 = SIMD_TABLE(warp_avx2, strip_list, strip_find, strip_write);
