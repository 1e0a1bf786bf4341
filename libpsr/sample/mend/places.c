#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/cell.h"
#include "psr/error.h"
#include "places.h"

#define FREE UINT64_MAX

int spots_add(struct spots *spots, const struct surface_spot *spot)
{
	if (spots->n == spots->capacity) {
		size_t capacity = spots->capacity != 0 ? 2 * spots->capacity : 64;
		struct surface_spot *grown = realloc(spots->spot, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		spots->spot = grown;
		spots->capacity = capacity;
	}
	spots->spot[spots->n++] = *spot;
	return PSR_OK;
}

static int make_table(struct spot_cells *cells, size_t size)
{
	uint64_t *key = malloc(size * sizeof *key);

	if (key == NULL)
		return PSR_ERR_MEMORY;
	memset(key, 0xff, size * sizeof *key);
	cells->key = key;
	cells->size = size;
	return PSR_OK;
}

int spot_cells_init(struct spot_cells *cells, double width)
{
	*cells = (struct spot_cells){ .width = width };
	return make_table(cells, 1024);
}

void spot_cells_fini(struct spot_cells *cells)
{
	free(cells->key);
	*cells = (struct spot_cells){ .width = 0 };
}

/* 20 bits an axis, and the way: 0 is none. */
static uint64_t key_of(const struct spot_cells *cells, const float p[3], const float n[3])
{
	int axis = 0;
	uint64_t key;

	for (int k = 1; k < 3; k++)
		axis = fabsf(n[k]) > fabsf(n[axis]) ? k : axis;
	key = n[axis] == 0 ? 0 : (uint64_t)(1 + 2 * axis + (n[axis] < 0));
	for (int k = 0; k < 3; k++)
		key = key << 20 | (uint64_t)(cell_floor((double)p[k] / cells->width) & 0xfffff);
	return key;
}

static uint64_t *find(const struct spot_cells *cells, uint64_t key)
{
	size_t i = cell_place(key, cells->size);

	while (cells->key[i] != FREE && cells->key[i] != key)
		i = (i + 1) & (cells->size - 1);
	return &cells->key[i];
}

int spot_cells_has(const struct spot_cells *cells, const float p[3], const float n[3])
{
	return *find(cells, key_of(cells, p, n)) != FREE;
}

int spot_cells_add(struct spot_cells *cells, const float p[3], const float n[3])
{
	struct spot_cells old = *cells;
	uint64_t key = key_of(cells, p, n), *at = find(cells, key);

	if (*at == key)
		return PSR_OK;
	*at = key;
	if (2 * ++cells->n <= cells->size)
		return PSR_OK;
	if (make_table(cells, 2 * old.size) != PSR_OK)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < old.size; i++)
		if (old.key[i] != FREE)
			*find(cells, old.key[i]) = old.key[i];
	free(old.key);
	return PSR_OK;
}
