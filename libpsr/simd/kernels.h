/* Kernels written by hand; loops/ has the other variants. */
#ifndef PSR_SIMD_KERNELS_H
#define PSR_SIMD_KERNELS_H

#include "simd.h"

warp_fn warp_c, warp_avx2, warp_avx512;
warp_fn warp_leaves_c, warp_leaves_avx2, warp_leaves_avx512;
warp_fn ewa_words_c, ewa_words_avx2, ewa_words_avx512;
warp_fn ewa_sums_c, ewa_sums_avx2, ewa_sums_avx512;
warp_fn warp_points_avx2, warp_points_avx512;
veil_fn veil_c, veil_avx2, veil_avx512;
reproject_look_fn reproject_look_avx2;
strip_list_fn strip_list_avx2, strip_list_avx512;
strip_read_fn strip_read_avx512;
strip_write_fn strip_write_avx2, strip_write_avx512;
smooth_places_fn smooth_places_avx2;
fill_pull_weights_fn fill_pull_weights_avx512;
fill_pull_colors_fn fill_pull_colors_avx512;
fill_push_fn fill_push_avx512;
fill_push_picture_fn fill_push_picture_avx512;

#endif
