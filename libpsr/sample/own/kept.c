#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "base/cell.h"
#include "kept.h"
#include "base/direction.h"
#include "psr/error.h"

#define FREE UINT64_MAX

/* 2 x 2 x 2 cells: what is asked for is mostly in one or two of them. */
struct cover_brick {
	uint64_t key;
	uint32_t first[8]; /* points of its cells */
};

static uint64_t brick_key(const int at[3])
{
	return cell_key(at[0] >> 1, at[1] >> 1, at[2] >> 1);
}

static int place_in_brick(const int at[3])
{
	return (at[0] & 1) | (at[1] & 1) << 1 | (at[2] & 1) << 2;
}

static struct cover_brick *find(const struct cover *cover, uint64_t key)
{
	size_t i = cell_place(key, cover->table_size);

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
	struct cover_brick *old = cover->table;
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

static int cell_at(const struct cover *cover, double x)
{
	return cell_floor(x / cover->ds);
}

int cover_add(struct cover *cover, const struct cover_point *point)
{
	struct cover_brick *brick;
	uint32_t *first;
	int at[3];

	if (cover->n_points == cover->capacity) {
		uint32_t capacity = cover->capacity != 0 ? cover->capacity + cover->capacity / 2 : 4096;
		struct cover_point *grown = realloc(cover->point, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		cover->point = grown;
		cover->capacity = capacity;
	}
	if (4 * cover->n_bricks >= 3 * cover->table_size && grow_table(cover) != PSR_OK)
		return PSR_ERR_MEMORY;
	for (int k = 0; k < 3; k++)
		at[k] = cell_at(cover, (double)point->position[k]);
	brick = find(cover, brick_key(at));
	if (brick->key == FREE) {
		brick->key = brick_key(at);
		for (int i = 0; i < 8; i++)
			brick->first[i] = COVER_NONE;
		cover->n_bricks++;
	}
	first = &brick->first[place_in_brick(at)];
	cover->point[cover->n_points] = *point;
	cover->point[cover->n_points].next = *first;
	*first = cover->n_points++;
	return PSR_OK;
}

uint32_t cover_cell(const struct cover *cover, const int at[3])
{
	const struct cover_brick *brick = find(cover, brick_key(at));

	return brick->key != FREE ? brick->first[place_in_brick(at)] : COVER_NONE;
}

int cover_around(const struct cover *cover, const float p[3], double radius, uint32_t first[COVER_MOST_AROUND])
{
	int low[3], high[3], at[3], n = 0;

	assert(radius <= 4 * cover->ds);
	for (int k = 0; k < 3; k++) {
		low[k] = cell_at(cover, (double)p[k] - radius);
		high[k] = cell_at(cover, (double)p[k] + radius);
	}
	for (at[2] = low[2] >> 1; at[2] <= high[2] >> 1; at[2]++) {
		for (at[1] = low[1] >> 1; at[1] <= high[1] >> 1; at[1]++) {
			for (at[0] = low[0] >> 1; at[0] <= high[0] >> 1; at[0]++) {
				const struct cover_brick *brick = find(cover, cell_key(at[0], at[1], at[2]));

				for (int i = 0; brick->key != FREE && i < 8; i++) {
					int x = 2 * at[0] + (i & 1), y = 2 * at[1] + (i >> 1 & 1), z = 2 * at[2] + (i >> 2);

					if (brick->first[i] != COVER_NONE && x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1]
					    && z >= low[2] && z <= high[2])
						first[n++] = brick->first[i];
				}
			}
		}
	}
	return n;
}

int cover_is_near(const struct cover *cover, const float p[3], const float n[3], double radius)
{
	const float (*direction)[3] = psr_direction_table();
	const float radius2 = (float)(radius * radius);
	uint32_t first[COVER_MOST_AROUND];
	int n_cells = cover_around(cover, p, radius, first);

	for (int c = 0; c < n_cells; c++) {
		for (uint32_t i = first[c]; i != COVER_NONE; i = cover->point[i].next) {
			const struct cover_point *point = &cover->point[i];
			float d[3];

			v3f_sub(d, point->position, p);
			if (v3f_dot(d, d) <= radius2 && v3f_dot(direction[point->normal], n) > 0.6f)
				return 1;
			if (point->two_sided && cover_is_sheet_near(point->position, p, n, (float)radius))
				return 1;
		}
	}
	return 0;
}
