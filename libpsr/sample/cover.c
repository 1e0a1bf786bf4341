#include <math.h>
#include "../base/mem.h"
#include "../base/vec.h"
#include "cover.h"
#include "psr/direction.h"
#include "psr/error.h"

#include <stdlib.h>
#include <string.h>

#define FREE UINT64_MAX

struct cover_cell {
	uint64_t key;
	uint32_t first;
};

static uint64_t key_of(const int at[3])
{
	return (uint64_t)(at[0] & 0x1fffff) | (uint64_t)(at[1] & 0x1fffff) << 21 | (uint64_t)(at[2] & 0x1fffff) << 42;
}

static struct cover_cell *find(const struct cover *cover, uint64_t key)
{
	size_t i = (size_t)(key * UINT64_C(0x9e3779b97f4a7c15) >> 20) & (cover->table_size - 1);

	while (cover->table[i].key != FREE && cover->table[i].key != key)
		i = (i + 1) & (cover->table_size - 1);
	return &cover->table[i];
}

static int make_table(struct cover *cover, size_t size)
{
	cover->table = psr_alloc_array(size, sizeof *cover->table);
	if (cover->table == NULL)
		return PSR_ERR_MEMORY;
	cover->table_size = size;
	for (size_t i = 0; i < size; i++)
		cover->table[i].key = FREE;
	return PSR_OK;
}

int cover_init(struct cover *cover, double ds)
{
	*cover = (struct cover){ .ds = ds };
	return make_table(cover, 4096);
}

void cover_fini(struct cover *cover)
{
	free(cover->point);
	psr_free(cover->table);
	*cover = (struct cover){ 0 };
}

static int grow_table(struct cover *cover)
{
	struct cover_cell *old = cover->table;
	size_t old_size = cover->table_size;

	if (make_table(cover, 2 * old_size) != PSR_OK) {
		cover->table = old;
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < old_size; i++)
		if (old[i].key != FREE)
			*find(cover, old[i].key) = old[i];
	psr_free(old);
	return PSR_OK;
}

static int cell_at(const struct cover *cover, float x)
{
	return (int)floor((double)x / cover->ds);
}

int cover_add(struct cover *cover, const struct cover_point *point)
{
	struct cover_cell *cell;
	int at[3];

	if (cover->n_points == cover->capacity) {
		uint32_t capacity = cover->capacity != 0 ? cover->capacity + cover->capacity / 2 : 4096;
		struct cover_point *grown = realloc(cover->point, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		cover->point = grown;
		cover->capacity = capacity;
	}
	if (4 * cover->n_cells >= 3 * cover->table_size && grow_table(cover) != PSR_OK)
		return PSR_ERR_MEMORY;
	for (int k = 0; k < 3; k++)
		at[k] = cell_at(cover, point->position[k]);
	cell = find(cover, key_of(at));
	if (cell->key == FREE) {
		cell->key = key_of(at);
		cell->first = COVER_NONE;
		cover->n_cells++;
	}
	cover->point[cover->n_points] = *point;
	cover->point[cover->n_points].next = cell->first;
	cell->first = cover->n_points++;
	return PSR_OK;
}

uint32_t cover_cell(const struct cover *cover, const int at[3])
{
	const struct cover_cell *cell = find(cover, key_of(at));

	return cell->key != FREE ? cell->first : COVER_NONE;
}

int cover_is_near(const struct cover *cover, const float p[3], const float n[3], double radius)
{
	const float (*direction)[3] = psr_direction_table();
	const float radius2 = (float)(radius * radius);
	int low[3], high[3], at[3];

	for (int k = 0; k < 3; k++) {
		low[k] = cell_at(cover, p[k] - (float)radius);
		high[k] = cell_at(cover, p[k] + (float)radius);
	}
	for (at[2] = low[2]; at[2] <= high[2]; at[2]++) {
		for (at[1] = low[1]; at[1] <= high[1]; at[1]++) {
			for (at[0] = low[0]; at[0] <= high[0]; at[0]++) {
				for (uint32_t i = cover_cell(cover, at); i != COVER_NONE; i = cover->point[i].next) {
					const struct cover_point *point = &cover->point[i];
					float d[3];

					v3f_sub(d, point->position, p);
					if (v3f_dot(d, d) <= radius2
					    && (point->two_sided || v3f_dot(direction[point->normal], n) > 0.6f))
						return 1;
				}
			}
		}
	}
	return 0;
}
