#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "base/cell.h"
#include "field.h"
#include "psr/error.h"

#define FREE UINT64_MAX

static struct field_cell *find(const struct field *field, uint64_t key)
{
	size_t i = cell_place(key, field->capacity);

	while (field->table[i].key != FREE && field->table[i].key != key)
		i = (i + 1) & (field->capacity - 1);
	return &field->table[i];
}

static int make_table(struct field *field, size_t capacity)
{
	field->table = psr_alloc_array(capacity, sizeof *field->table);
	if (field->table == NULL)
		return PSR_ERR_MEMORY;
	field->capacity = capacity;
	for (size_t i = 0; i < capacity; i++)
		field->table[i].key = FREE;
	return PSR_OK;
}

int field_init(struct field *field, double cell)
{
	*field = (struct field){ .cell = cell };
	return make_table(field, 1024);
}

void field_fini(struct field *field)
{
	psr_free(field->table);
	*field = (struct field){ 0 };
}

static int grow(struct field *field)
{
	struct field old = *field;

	if (make_table(field, 2 * old.capacity) != PSR_OK) {
		*field = old;
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < old.capacity; i++)
		if (old.table[i].key != FREE)
			*find(field, old.table[i].key) = old.table[i];
	psr_free(old.table);
	return PSR_OK;
}

static int lobe_of(const float n[3])
{
	int k = fabsf(n[0]) >= fabsf(n[1]) ? 0 : 1;

	if (fabsf(n[2]) > fabsf(n[k]))
		k = 2;
	return 2 * k + (n[k] < 0);
}

int field_add(struct field *field, const float p[3], const float n[3], float weight)
{
	struct field_cell *cell;
	int at[3], lobe = lobe_of(n);

	if (4 * field->n_cells >= 3 * field->capacity && grow(field) != PSR_OK)
		return PSR_ERR_MEMORY;
	for (int k = 0; k < 3; k++)
		at[k] = cell_floor((double)p[k] / field->cell);
	cell = find(field, cell_key(at[0], at[1], at[2]));
	if (cell->key == FREE) {
		memset(cell, 0, sizeof *cell);
		cell->key = cell_key(at[0], at[1], at[2]);
		field->n_cells++;
	}
	for (int k = 0; k < 3; k++)
		cell->lobe[lobe][k] += (int32_t)lrintf(n[k] * weight * FIELD_ONE);
	return PSR_OK;
}

void field_normal(const struct field *field, const float p[3], const float n[3], float out[3])
{
	float weight[3][2], sum[3] = { 0, 0, 0 };
	int at[3];

	for (int k = 0; k < 3; k++) {
		double x = (double)p[k] / field->cell - 0.5;

		at[k] = cell_floor(x);
		weight[k][1] = (float)(x - at[k]);
		weight[k][0] = 1 - weight[k][1];
	}
	for (int i = 0; i < 8; i++) {
		const struct field_cell *cell = find(field, cell_key(at[0] + (i & 1), at[1] + (i >> 1 & 1), at[2] + (i >> 2)));
		float w = weight[0][i & 1] * weight[1][i >> 1 & 1] * weight[2][i >> 2];

		for (int l = 0; cell->key != FREE && l < FIELD_LOBES; l++) {
			const int32_t *sums = cell->lobe[l];
			float lobe[3] = { (float)sums[0], (float)sums[1], (float)sums[2] }, g;

			if ((sums[0] | sums[1] | sums[2]) == 0)
				continue;
			g = v3f_dot(lobe, n);
			/* What faces within some 70 degrees of n counts. */
			if (g > 0 && g * g > 0.1f * v3f_dot(lobe, lobe))
				v3f_add_scaled(sum, sum, w, lobe);
		}
	}
	if (v3f_dot(sum, n) > 0)
		v3f_set(out, sum[0], sum[1], sum[2]);
	else
		v3f_set(out, n[0], n[1], n[2]);
}
