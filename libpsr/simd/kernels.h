/* Every variant of every kernel. */
#ifndef PSR_SIMD_KERNELS_H
#define PSR_SIMD_KERNELS_H

#include "simd/simd.h"

warp_fn warp_c, warp_avx2, warp_avx512;
strip_list_fn strip_list_avx512; /* the others: strip.h */

#endif
