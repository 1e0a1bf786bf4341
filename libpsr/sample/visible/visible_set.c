#include <math.h>
#include "base/cell.h"
#include "base/direction.h"
#include "buried.h"
#include "psr/error.h"
#include "visible_set.h"

#define RECENT TABLE_MARK /* met by the views under way */
#define CELL_PIXELS 1.5
#define BATCH 64
#define AT_ONCE 16 /* views */
#define VIEW_LEVEL 5
#define N_DIRECTIONS (8u << 2 * VIEW_LEVEL)
#define N_SETS 16 /* of directions, each all around */
#define SET_SIZE (N_DIRECTIONS / N_SETS)
#define RAY_PIXELS 4 /* between rays: many views rather than fine ones */
#define LEAST_WAY 0.4f

static uint64_t coarser_key(uint64_t key)
{
	uint64_t coarser = key >> 60 << 60;

	for (int shift = 0; shift <= 40; shift += 20) {
		int at = (int)(key >> shift & 0xfffff);

		at = at < 1 << 19 ? at : at - (1 << 20);
		coarser |= (uint64_t)(at >> 1 & 0xfffff) << shift;
	}
	return coarser;
}

enum found { NO_ROOM, OLD, NEW };

/* From any thread. A recent key counts as new. Finding no room takes a walk through the whole table. */
static enum found insert(const struct visible_set *set, uint64_t key, uint64_t *n_new)
{
	const struct table *table = &set->table;
	const uint64_t plain = key & ~RECENT;
	size_t i = table_place(key, table->size);

	for (size_t tries = 0; tries < table->size; tries++, i = (i + 1) & (table->size - 1)) {
		uint64_t *entry = table_at(table, i), old = __atomic_load_n(entry, __ATOMIC_RELAXED);

		if (old == TABLE_FREE
		    && __atomic_compare_exchange_n(entry, &old, key, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
			__atomic_fetch_add(n_new, 1, __ATOMIC_RELAXED);
			return NEW;
		}
		if (old == plain)
			return OLD;
		if (old == (plain | RECENT))
			return NEW;
	}
	return NO_ROOM;
}

struct look {
	const struct visible_set *set;
	const struct ray_scene *scene;
	double basis[AT_ONCE][3][3], ds;
	int reach; /* rows and columns on each side of the middle */
	uint64_t n_new, n_hits, n_unseen; /* cells; rays; rays that met a place unseen by earlier views */
	int is_full, is_counting;
};

static uint64_t place_key(const struct visible_set *set, const float p[3], const float n[3])
{
	int at[3];

	cell_of(p, set->width, at);
	return cell_facing_key(at, cell_facing(n));
}

static void mark(struct look *look, const struct ray *ray, const struct ray_hit *hit)
{
	const float *front = ray_scene_normal(look->scene, hit->prim);
	enum found found;
	float p[3], n[3];

	for (int k = 0; k < 3; k++) {
		p[k] = (float)(ray->origin[k] + hit->t * ray->direction[k]);
		n[k] = hit->is_back ? -front[k] : front[k];
	}
	found = insert(look->set, place_key(look->set, p, n) | RECENT, &look->n_new);
	if (found == NO_ROOM)
		__atomic_store_n(&look->is_full, 1, __ATOMIC_RELAXED);
	else if (found == NEW && look->is_counting && !visible_set_has(look->set, p, n))
		__atomic_fetch_add(&look->n_unseen, 1, __ATOMIC_RELAXED);
}

static void trace_batch(struct look *look, const struct ray *ray, int n)
{
	struct ray_hit hit[BATCH];
	uint64_t n_hits = 0;

	ray_scene_trace(look->scene, ray, n, 0, hit);
	for (int k = 0; k < n && !__atomic_load_n(&look->is_full, __ATOMIC_RELAXED); k++) {
		if (hit[k].prim == RAY_NONE)
			continue;
		mark(look, &ray[k], &hit[k]);
		n_hits++;
	}
	__atomic_fetch_add(&look->n_hits, n_hits, __ATOMIC_RELAXED);
}

/* Two rows at once: rays traced together are near to each other. */
static void look_along_rows(int i, void *userdata)
{
	struct look *look = userdata;
	double (*basis)[3] = look->basis[i / look->reach];
	int row = 2 * (i % look->reach) - look->reach, columns = 0, n = 0;
	struct ray ray[BATCH];

	for (int r = row; r < row + 2; r++) {
		double y = (r + 0.5) * look->ds, half = 1 - y * y;
		int reach = half > 0 ? (int)(sqrt(half) / look->ds) + 1 : 0;

		columns = reach > columns ? reach : columns;
	}
	for (int c = -columns; c < columns && !__atomic_load_n(&look->is_full, __ATOMIC_RELAXED); c++) {
		for (int r = row; r < row + 2; r++, n++) {
			double x = (c + 0.5) * look->ds, y = (r + 0.5) * look->ds;

			for (int k = 0; k < 3; k++) {
				ray[n].origin[k] = x * basis[0][k] + y * basis[1][k] + 2 * basis[2][k];
				ray[n].direction[k] = -basis[2][k];
			}
		}
		if (n == BATCH || c + 1 == columns) {
			trace_batch(look, ray, n);
			n = 0;
		}
	}
}

int visible_set_init(struct visible_set *set, double ds)
{
	*set = (struct visible_set){ .width = CELL_PIXELS * ds, .ds = ds };
	return table_init(&set->table, sizeof(uint64_t), 1 << 16);
}

void visible_set_fini(struct visible_set *set)
{
	table_fini(&set->table);
}

/* Views that fill the table break off, and start again with more room. */
static int look_along(struct look *look, struct visible_set *set, struct psr_pool *pool)
{
	/* Far apart views come first, so that the table soon has its size. */
	for (unsigned k = 0; k < AT_ONCE; k++) {
		unsigned i = set->n_views + k, view = N_SETS * (i * 211 % SET_SIZE) + i / SET_SIZE % N_SETS;
		double direction[3];

		psr_direction_center(VIEW_LEVEL, view, direction);
		psr_direction_basis(direction, look->basis[k]);
	}
	do {
		look->n_new = look->n_hits = look->n_unseen = 0;
		look->is_full = 0;
		psr_pool_for(pool, AT_ONCE * look->reach, look_along_rows, look);
		set->table.n += look->n_new;
		while (2 * set->table.n > set->table.size)
			if (table_grow(&set->table) != PSR_OK)
				return PSR_ERR_MEMORY;
	} while (look->is_full);
	set->n_views += AT_ONCE;
	for (size_t i = 0; i < set->table.size; i++)
		if (*table_at(&set->table, i) != TABLE_FREE)
			*table_at(&set->table, i) &= ~RECENT;
	return PSR_OK;
}

int visible_set_look(struct visible_set *set, const struct ray_scene *scene, uint64_t enough, struct psr_pool *pool)
{
	double step = RAY_PIXELS / CELL_PIXELS * set->width;
	struct look look = { .set = set, .scene = scene, .ds = step, .reach = (int)ceil(1 / step) };
	uint64_t n_hits = 0, n_unseen = 0;

	for (unsigned i = 1; i <= VISIBLE_MOST_VIEWS / AT_ONCE; i++) {
		look.is_counting = set->n_views >= VISIBLE_LEAST_VIEWS; /* to the first ones nearly all is new */
		if (look_along(&look, set, pool) != PSR_OK)
			return PSR_ERR_MEMORY;
		n_hits += look.n_hits;
		n_unseen += look.n_unseen;
		if (i % (VISIBLE_LEAST_VIEWS / AT_ONCE) != 0)
			continue;
		if (look.is_counting && enough * n_unseen <= n_hits)
			break;
		n_hits = n_unseen = 0;
	}
	return PSR_OK;
}

int visible_set_coarsen(struct visible_set *set, const struct visible_set *finer)
{
	*set = (struct visible_set){ .width = 2 * finer->width, .ds = finer->ds };
	if (table_init(&set->table, sizeof(uint64_t), finer->table.size) != PSR_OK)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < finer->table.size; i++)
		if (*table_at(&finer->table, i) != TABLE_FREE)
			(void)table_put(&set->table, coarser_key(*table_at(&finer->table, i)));
	return PSR_OK;
}

static int has(const struct table *table, uint64_t key)
{
	size_t i = table_place(key, table->size);

	for (size_t tries = 0; tries < table->size; tries++, i = (i + 1) & (table->size - 1)) {
		uint64_t found = __atomic_load_n(table_at(table, i), __ATOMIC_RELAXED);

		if (found == TABLE_FREE || (found & ~RECENT) == key)
			return found == key;
	}
	return 0;
}

int visible_set_has(const struct visible_set *set, const float p[3], const float n[3])
{
	int first[3];

	/* The eight cells around, and all facings that something of nearly this normal may have. */
	for (int k = 0; k < 3; k++)
		first[k] = cell_floor((double)p[k] / set->width - 0.5);
	for (unsigned axis = 0; axis < 3; axis++) {
		if (fabsf(n[axis]) < LEAST_WAY)
			continue;
		for (int i = 0; i < 8; i++) {
			int at[3] = { first[0] + (i & 1), first[1] + (i >> 1 & 1), first[2] + (i >> 2) };

			if (has(&set->table, cell_facing_key(at, 1 + 2 * axis + (n[axis] < 0))))
				return 1;
		}
	}
	return 0;
}

int visible_set_shows(const struct visible_set *set, const struct ray_scene *scene, const float p[3], const float n[3])
{
	return visible_set_has(set, p, n) && !is_buried(scene, set->ds, p, n);
}

int visible_set_add(struct visible_set *set, const float p[3], const float n[3])
{
	return table_put(&set->table, place_key(set, p, n)) != NULL ? PSR_OK : PSR_ERR_MEMORY;
}
