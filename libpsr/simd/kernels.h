/* Every variant of every kernel. */
#ifndef PSR_SIMD_KERNELS_H
#define PSR_SIMD_KERNELS_H

#include "simd/simd.h"

warp_fn warp_c, warp_avx2, warp_avx512;

#endif
