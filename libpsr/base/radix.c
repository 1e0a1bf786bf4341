#include "radix.h"

#include <string.h>
#include "maths.h"

#define BITS 11
#define DIGITS (1u << BITS)

uint32_t radix_of_float(float x)
{
	const uint32_t bits = psr_bits_from_float(x + 0.0f); /* of both zeros the positive one */

	return bits ^ (bits >> 31 ? UINT32_MAX : UINT32_C(1) << 31);
}

static unsigned digit_of(uint64_t key, int shift)
{
	return key >> shift & (DIGITS - 1);
}

/* Moves the entries to `to`, in the order of a digit. Returns 0 if all have the same: then they stay. */
static int sort_by(struct radix_entry *to, const struct radix_entry *from, size_t n, int shift)
{
	size_t first[DIGITS] = { 0 }, sum = 0;

	for (size_t i = 0; i < n; i++)
		first[digit_of(from[i].key, shift)]++;
	if (first[digit_of(from[0].key, shift)] == n)
		return 0;
	for (unsigned d = 0; d < DIGITS; d++) {
		const size_t count = first[d];

		first[d] = sum;
		sum += count;
	}
	for (size_t i = 0; i < n; i++)
		to[first[digit_of(from[i].key, shift)]++] = from[i];
	return 1;
}

void radix_sort(struct radix_entry *entry, size_t n)
{
	struct radix_entry *from = entry, *to = entry + n;

	for (int shift = 0; shift < 64 && n > 1; shift += BITS)
		if (sort_by(to, from, n, shift)) {
			struct radix_entry *const swapped = from;

			from = to;
			to = swapped;
		}
	if (from != entry)
		memcpy(entry, from, n * sizeof *entry);
}
