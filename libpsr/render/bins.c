#include "bins.h"

#include <stddef.h>
#include <string.h>
#include "base/mem.h"

#define ARRAY(name) { offsetof(struct bins, name), offsetof(struct bins, name##_capacity) }
static const struct {
	size_t array, capacity;
} arrays[] = {
	ARRAY(entry), ARRAY(tile_begin), ARRAY(thin_begin), ARRAY(glass_begin), ARRAY(by_work), ARRAY(is_quiet),
	ARRAY(hit),   ARRAY(cubes),      ARRAY(order),      ARRAY(chunk),       ARRAY(masks),   ARRAY(group),
	ARRAY(count),
};
#define N_ARRAYS (sizeof arrays / sizeof *arrays)

static size_t capacity_of(const struct bins *bins, size_t i)
{
	return *(const size_t *)((const char *)bins + arrays[i].capacity);
}

void *bins_room_for(void *array, size_t *capacity, size_t n, size_t size)
{
	if (array != NULL && n * size <= *capacity)
		return array;
	return psr_grow_by_pages(array, capacity, (n + n / 4 + 1) * size);
}

size_t bins_bytes(const struct bins *bins)
{
	size_t n = 0;

	for (size_t i = 0; i < N_ARRAYS; i++)
		n += capacity_of(bins, i);
	return n;
}

void bins_clear(struct bins *bins)
{
	for (size_t i = 0; i < N_ARRAYS; i++)
		psr_free_huge(*(void **)((char *)bins + arrays[i].array), capacity_of(bins, i));
	memset(bins, 0, sizeof *bins);
}
