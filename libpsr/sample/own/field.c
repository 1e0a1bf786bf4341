#include <math.h>
#include "base/cell.h"
#include "base/vec.h"
#include "field.h"
#include "psr/error.h"

#define LOBES 6 /* of normals in a cell: by the axis and sign that is greatest in them */
#define ONE 256

struct cell {
	uint64_t key;
	int32_t lobe[LOBES][3]; /* sums of normals, times ONE: integers, so that their order does not matter */
};

int field_init(struct field *field, double width)
{
	field->width = width;
	return table_init(&field->cells, sizeof(struct cell), 1024);
}

void field_fini(struct field *field)
{
	table_fini(&field->cells);
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
	struct cell *cell;
	int at[3], lobe = lobe_of(n);

	cell_of(p, field->width, at);
	cell = table_put(&field->cells, cell_key(at[0], at[1], at[2]));
	if (cell == NULL)
		return PSR_ERR_MEMORY;
	for (int k = 0; k < 3; k++)
		cell->lobe[lobe][k] += (int32_t)lrintf(n[k] * weight * ONE);
	return PSR_OK;
}

void field_normal(const struct field *field, const float p[3], const float n[3], float out[3])
{
	float weight[3][2], sum[3] = { 0, 0, 0 };
	int at[3];

	for (int k = 0; k < 3; k++) {
		double x = (double)p[k] / field->width - 0.5;

		at[k] = cell_floor(x);
		weight[k][1] = (float)(x - at[k]);
		weight[k][0] = 1 - weight[k][1];
	}
	for (int i = 0; i < 8; i++) {
		const struct cell *cell =
			table_find(&field->cells, cell_key(at[0] + (i & 1), at[1] + (i >> 1 & 1), at[2] + (i >> 2)));
		float w = weight[0][i & 1] * weight[1][i >> 1 & 1] * weight[2][i >> 2];

		for (int l = 0; cell != NULL && l < LOBES; l++) {
			const int32_t *sums = cell->lobe[l];
			float lobe[3] = { (float)sums[0], (float)sums[1], (float)sums[2] }, g;

			if ((sums[0] | sums[1] | sums[2]) == 0)
				continue;
			g = v3f_dot(lobe, n);
			/* Lobes within about 70 degrees of n. */
			if (g > 0 && g * g > 0.1f * v3f_dot(lobe, lobe))
				v3f_add_scaled(sum, sum, w, lobe);
		}
	}
	if (v3f_dot(sum, n) > 0)
		v3f_set(out, sum[0], sum[1], sum[2]);
	else
		v3f_set(out, n[0], n[1], n[2]);
}
