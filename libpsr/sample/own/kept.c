#include "base/array.h"
#include "base/direction.h"
#include "kept.h"
#include "psr/error.h"

int kept_init(struct kept *kept, double ds)
{
	*kept = (struct kept){ .n = 0 };
	return grid_init(&kept->grid, ds);
}

void kept_fini(struct kept *kept)
{
	free(kept->sample);
	grid_fini(&kept->grid);
	*kept = (struct kept){ .n = 0 };
}

int kept_add(struct kept *kept, const struct kept_sample *sample)
{
	if (!ARRAY_ROOM(kept->sample, kept->n, kept->capacity))
		return PSR_ERR_MEMORY;
	kept->sample[kept->n] = *sample;
	if (grid_put(&kept->grid, sample->position, kept->n, &kept->sample[kept->n].next) != PSR_OK)
		return PSR_ERR_MEMORY;
	kept->n++;
	return PSR_OK;
}

int kept_covers(const struct kept *kept, const float p[3], const float n[3], double radius)
{
	const float (*direction)[3] = psr_direction_table();
	const float radius2 = (float)(radius * radius);
	uint32_t first[GRID_MOST_AROUND];
	int n_cells = grid_around(&kept->grid, p, radius, first);

	for (int c = 0; c < n_cells; c++) {
		for (uint32_t i = first[c]; i != GRID_NONE; i = kept->sample[i].next) {
			const struct kept_sample *sample = &kept->sample[i];
			float d[3];

			v3f_sub(d, sample->position, p);
			if (v3f_dot(d, d) <= radius2 && v3f_dot(direction[sample->normal], n) > 0.6f)
				return 1;
			if (sample->two_sided && kept_covers_sheet(sample->position, p, n, (float)radius))
				return 1;
		}
	}
	return 0;
}
