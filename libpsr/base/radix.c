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

static inline uint64_t key_of(const uint8_t *record)
{
	uint64_t key;

	memcpy(&key, record, sizeof key);
	return key;
}

static inline unsigned digit_of(const uint8_t *record, int shift)
{
	return key_of(record) >> shift & (DIGITS - 1);
}

/* Moves the records to `to`, in the order of a digit. Returns 0 if all have the same: then they stay. */
static inline __attribute__((always_inline)) int sort_by(uint8_t *to, const uint8_t *from, size_t bytes, size_t n,
                                                         int shift)
{
	size_t place[DIGITS] = { 0 }, sum = 0;

	for (size_t i = 0; i < n; i++)
		place[digit_of(from + i * bytes, shift)]++;
	if (place[digit_of(from, shift)] == n)
		return 0;
	for (unsigned d = 0; d < DIGITS; d++) {
		const size_t count = place[d];

		place[d] = sum;
		sum += count;
	}
	for (size_t i = 0; i < n; i++) {
		const uint8_t *record = from + i * bytes;

		memcpy(to + bytes * place[digit_of(record, shift)]++, record, bytes);
	}
	return 1;
}

static inline __attribute__((always_inline)) void *sort(uint8_t *from, uint8_t *to, size_t bytes, size_t n, int bits)
{
	for (int shift = 0; shift < bits && n > 1; shift += BITS)
		if (sort_by(to, from, bytes, n, shift)) {
			uint8_t *const swapped = from;

			from = to;
			to = swapped;
		}
	return from;
}

void *radix_sort_records(void *record, void *spare, size_t bytes, size_t n, int bits)
{
	switch (bytes) { /* a constant is copied by registers */
	case 16:
		return sort(record, spare, 16, n, bits);
	case 24:
		return sort(record, spare, 24, n, bits);
	default:
		return sort(record, spare, bytes, n, bits);
	}
}

void radix_sort(struct radix_entry *entry, size_t n)
{
	const void *sorted = radix_sort_records(entry, entry + n, sizeof *entry, n, 64);

	if (sorted != entry)
		memcpy(entry, sorted, n * sizeof *entry);
}
