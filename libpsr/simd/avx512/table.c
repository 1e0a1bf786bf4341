#include "simd/table.h"

const struct simd simd_avx512 = SIMD_TABLE(warp_avx512, strip_list_avx512, strip_find_avx512, strip_write_avx512);
