/* EWA splats: the reference. */
#include "simd/loops/ewa.h"
#include "simd/kernels.h"

static const struct ewa_parts parts = { ewa_list,        ewa_sort_words, ewa_sort_sums,
	                                    ewa_put_normals, ewa_draw_words, ewa_draw_sums };

uint64_t ewa_words_c(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_words_by(parts, target, entry, n);
}

uint64_t ewa_sums_c(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_sums_by(parts, target, entry, n);
}
