/* Sorting many things by numbers, in a time that grows as they do. */
#ifndef PSR_BASE_RADIX_H
#define PSR_BASE_RADIX_H

#include <stddef.h>
#include <stdint.h>

struct radix_entry {
	uint64_t key;
	uint32_t value;
};

/* The order of finite numbers; both zeros are one. */
uint32_t radix_of_float(float x);

/* Sorts n entries by their keys; those of one key stay in their order. There is room for 2 n: the second half is for
 * its use. */
void radix_sort(struct radix_entry *entry, size_t n);

/* Sorts n records, of so many bytes, by the uint64_t that each begins with, which is below 2^bits; those of one number
 * stay in their order. spare: room for as many. Returns where they are then, record or spare. */
void *radix_sort_records(void *record, void *spare, size_t bytes, size_t n, int bits);

#endif
