#include <assert.h>
#include "cell.h"
#include "grid.h"
#include "psr/error.h"

struct brick {
	uint64_t key;
	uint32_t after[8]; /* one more than the first element of each cell; 0: the cell is empty */
};

static uint64_t brick_key(const int at[3])
{
	return cell_key(at[0] >> 1, at[1] >> 1, at[2] >> 1);
}

static int cell_in_brick(const int at[3])
{
	return (at[0] & 1) | (at[1] & 1) << 1 | (at[2] & 1) << 2;
}

int grid_init(struct grid *grid, double width)
{
	grid->width = width;
	return table_init(&grid->bricks, sizeof(struct brick), 1024);
}

void grid_fini(struct grid *grid)
{
	table_fini(&grid->bricks);
}

int grid_put(struct grid *grid, const float p[3], uint32_t i, uint32_t *next)
{
	struct brick *brick;
	uint32_t *after;
	int at[3];

	cell_of(p, grid->width, at);
	brick = table_put(&grid->bricks, brick_key(at));
	if (brick == NULL)
		return PSR_ERR_MEMORY;
	after = &brick->after[cell_in_brick(at)];
	*next = *after - 1;
	*after = i + 1;
	return PSR_OK;
}

uint32_t grid_first(const struct grid *grid, const int at[3])
{
	const struct brick *brick = table_find(&grid->bricks, brick_key(at));

	return brick != NULL ? brick->after[cell_in_brick(at)] - 1 : GRID_NONE;
}

int grid_around(const struct grid *grid, const float p[3], double radius, uint32_t first[GRID_MOST_AROUND])
{
	int low[3], high[3], at[3], n = 0;

	assert(radius <= 4 * grid->width);
	for (int k = 0; k < 3; k++) {
		low[k] = cell_floor(((double)p[k] - radius) / grid->width);
		high[k] = cell_floor(((double)p[k] + radius) / grid->width);
	}
	for (at[2] = low[2] >> 1; at[2] <= high[2] >> 1; at[2]++) {
		for (at[1] = low[1] >> 1; at[1] <= high[1] >> 1; at[1]++) {
			for (at[0] = low[0] >> 1; at[0] <= high[0] >> 1; at[0]++) {
				const struct brick *brick = table_find(&grid->bricks, cell_key(at[0], at[1], at[2]));

				for (int i = 0; brick != NULL && i < 8; i++) {
					int x = 2 * at[0] + (i & 1), y = 2 * at[1] + (i >> 1 & 1), z = 2 * at[2] + (i >> 2);

					if (brick->after[i] != 0 && x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1]
					    && z >= low[2] && z <= high[2])
						first[n++] = brick->after[i] - 1;
				}
			}
		}
	}
	return n;
}
