#include "simd/table.h"

const struct simd simd_c = SIMD_TABLE(warp_c, strip_list, strip_find, strip_write);
