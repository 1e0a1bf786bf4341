#include "simd/loops/table.h"

#define AS_LOOPS(kernel) kernel

const struct simd simd_c = SIMD_TABLE(c, reproject_look, smooth_places, AS_LOOPS, AS_LOOPS);
