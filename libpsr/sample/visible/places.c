#include "base/array.h"
#include "base/cell.h"
#include "places.h"
#include "psr/error.h"

int places_add(struct places *places, const struct place *place)
{
	if (!ARRAY_ROOM(places->place, places->n, places->capacity))
		return PSR_ERR_MEMORY;
	places->place[places->n++] = *place;
	return PSR_OK;
}

void place_ray(const struct place *place, const double view[3], struct ray *ray)
{
	for (int k = 0; k < 3; k++) {
		ray->origin[k] = (double)place->p[k] + PLACE_AWAY * view[k];
		ray->direction[k] = -view[k];
	}
}

int place_cells_init(struct place_cells *cells, double width)
{
	cells->width = width;
	return table_init(&cells->table, sizeof(uint64_t), 1024);
}

void place_cells_fini(struct place_cells *cells)
{
	table_fini(&cells->table);
}

static uint64_t key_of(const struct place_cells *cells, const float p[3], const float n[3])
{
	int at[3];

	cell_of(p, cells->width, at);
	return cell_facing_key(at, cell_facing(n));
}

int place_cells_has(const struct place_cells *cells, const float p[3], const float n[3])
{
	return table_find(&cells->table, key_of(cells, p, n)) != NULL;
}

int place_cells_add(struct place_cells *cells, const float p[3], const float n[3])
{
	return table_put(&cells->table, key_of(cells, p, n)) != NULL ? PSR_OK : PSR_ERR_MEMORY;
}
