#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "base/cell.h"
#include "base/direction.h"
#include "psr/error.h"
#include "visible_set.h"

#define FREE UINT64_MAX
#define RECENT (UINT64_C(1) << 63) /* what the views met that are being looked along */
#define CELL_PIXELS 1.5
#define BATCH 64
#define AT_ONCE 16 /* views */
#define VIEW_LEVEL 5
#define N_DIRECTIONS (8u << 2 * VIEW_LEVEL)
#define N_SETS 16 /* of directions, each all around */
#define SET_SIZE (N_DIRECTIONS / N_SETS)
#define RAY_PIXELS 4 /* between rays: many views rather than fine ones */
#define LEAST_WAY 0.4f

/* 20 bits an axis, as the sphere is 8192 pixels wide at most, and one of six ways to face. */
static uint64_t key_of(const int at[3], int axis, int is_negative)
{
	uint64_t key = (uint64_t)(2 * axis + is_negative);

	for (int k = 0; k < 3; k++)
		key = key << 20 | (uint64_t)(at[k] & 0xfffff);
	return key;
}

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

/* From any thread. What is marked as recent is as good as new. To find that there is no room takes a walk through all
 * of it. */
static enum found insert(const struct seen *seen, uint64_t key, uint64_t *n_new)
{
	const uint64_t plain = key & ~RECENT;
	size_t i = cell_place(plain, seen->size);

	for (size_t tries = 0; tries < seen->size; tries++, i = (i + 1) & (seen->size - 1)) {
		uint64_t old = __atomic_load_n(&seen->table[i], __ATOMIC_RELAXED);

		if (old == FREE &&
		    __atomic_compare_exchange_n(&seen->table[i], &old, key, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
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
	const struct seen *seen;
	const struct ray_scene *scene;
	double frame[AT_ONCE][3][3], ds;
	int reach; /* rows and columns on each side of the middle */
	uint64_t n_new, n_hits, n_unseen; /* cells; rays; those that met what no view of before had seen */
	int is_full, is_counting;
};

static uint64_t place_key(const struct seen *seen, const float p[3], const float n[3])
{
	int at[3], axis = 0;

	for (int k = 0; k < 3; k++) {
		at[k] = cell_floor((double)p[k] / seen->cell);
		axis = fabsf(n[k]) > fabsf(n[axis]) ? k : axis;
	}
	return key_of(at, axis, n[axis] < 0);
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
	found = insert(look->seen, place_key(look->seen, p, n) | RECENT, &look->n_new);
	if (found == NO_ROOM)
		__atomic_store_n(&look->is_full, 1, __ATOMIC_RELAXED);
	else if (found == NEW && look->is_counting && !seen_is(look->seen, p, n))
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

/* Two rows at once: rays that are traced together are to be near to each other. */
static void look_along_rows(int i, void *userdata)
{
	struct look *look = userdata;
	double (*frame)[3] = look->frame[i / look->reach];
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
				ray[n].origin[k] = x * frame[0][k] + y * frame[1][k] + 2 * frame[2][k];
				ray[n].direction[k] = -frame[2][k];
			}
		}
		if (n == BATCH || c + 1 == columns) {
			trace_batch(look, ray, n);
			n = 0;
		}
	}
}

static int grow(struct seen *seen)
{
	struct seen old = *seen;
	uint64_t n_new = 0;

	seen->table = psr_alloc_array(2 * old.size, sizeof *seen->table);
	if (seen->table == NULL) {
		*seen = old;
		return PSR_ERR_MEMORY;
	}
	seen->size = 2 * old.size;
	memset(seen->table, 0xff, seen->size * sizeof *seen->table);
	for (size_t i = 0; i < old.size; i++)
		if (old.table[i] != FREE)
			(void)insert(seen, old.table[i], &n_new);
	psr_free(old.table);
	return PSR_OK;
}

int seen_init(struct seen *seen, double ds)
{
	*seen = (struct seen){ .cell = CELL_PIXELS * ds, .size = 1 << 16 };
	seen->table = psr_alloc_array(seen->size, sizeof *seen->table);
	if (seen->table == NULL)
		return PSR_ERR_MEMORY;
	memset(seen->table, 0xff, seen->size * sizeof *seen->table);
	return PSR_OK;
}

/* Views that fill the table are broken off, and looked along again once there is room. */
static int look_along(struct look *look, struct seen *seen, struct psr_pool *pool)
{
	/* Far apart ones first, so that the table soon has its size. */
	for (unsigned k = 0; k < AT_ONCE; k++) {
		unsigned i = seen->n_views + k, view = N_SETS * (i * 211 % SET_SIZE) + i / SET_SIZE % N_SETS;
		double direction[3];

		psr_direction_center(VIEW_LEVEL, view, direction);
		psr_direction_frame(direction, look->frame[k]);
	}
	do {
		look->n_new = look->n_hits = look->n_unseen = 0;
		look->is_full = 0;
		psr_pool_for(pool, AT_ONCE * look->reach, look_along_rows, look);
		seen->n_cells += look->n_new;
		while (2 * seen->n_cells > seen->size)
			if (grow(seen) != PSR_OK)
				return PSR_ERR_MEMORY;
	} while (look->is_full);
	seen->n_views += AT_ONCE;
	for (size_t i = 0; i < seen->size; i++)
		if (seen->table[i] != FREE)
			seen->table[i] &= ~RECENT;
	return PSR_OK;
}

int seen_look(struct seen *seen, const struct ray_scene *scene, uint64_t enough, struct psr_pool *pool)
{
	double step = RAY_PIXELS / CELL_PIXELS * seen->cell;
	struct look look = { .seen = seen, .scene = scene, .ds = step, .reach = (int)ceil(1 / step) };
	uint64_t n_hits = 0, n_unseen = 0;

	for (unsigned i = 1; i <= SEEN_MOST_VIEWS / AT_ONCE; i++) {
		look.is_counting = seen->n_views >= SEEN_LEAST_VIEWS; /* to the first ones nearly all is new */
		if (look_along(&look, seen, pool) != PSR_OK)
			return PSR_ERR_MEMORY;
		n_hits += look.n_hits;
		n_unseen += look.n_unseen;
		if (i % (SEEN_LEAST_VIEWS / AT_ONCE) != 0)
			continue;
		if (look.is_counting && enough * n_unseen <= n_hits)
			break;
		n_hits = n_unseen = 0;
	}
	return PSR_OK;
}

int seen_coarsen(struct seen *seen, const struct seen *finer)
{
	*seen = (struct seen){ .cell = 2 * finer->cell, .size = finer->size };
	seen->table = psr_alloc_array(seen->size, sizeof *seen->table);
	if (seen->table == NULL)
		return PSR_ERR_MEMORY;
	memset(seen->table, 0xff, seen->size * sizeof *seen->table);
	for (size_t i = 0; i < finer->size; i++)
		if (finer->table[i] != FREE)
			(void)insert(seen, coarser_key(finer->table[i]), &seen->n_cells);
	return PSR_OK;
}

void seen_fini(struct seen *seen)
{
	psr_free(seen->table);
	*seen = (struct seen){ 0 };
}

static int has(const struct seen *seen, uint64_t key)
{
	size_t i = cell_place(key, seen->size);

	for (size_t tries = 0; tries < seen->size; tries++, i = (i + 1) & (seen->size - 1)) {
		uint64_t found = __atomic_load_n(&seen->table[i], __ATOMIC_RELAXED);

		if (found == FREE || (found & ~RECENT) == key)
			return found == key;
	}
	return 0;
}

int seen_is(const struct seen *seen, const float p[3], const float n[3])
{
	int first[3];

	/* The eight cells around; and the ways that something of nearly this normal may have been put down as. */
	for (int k = 0; k < 3; k++)
		first[k] = cell_floor((double)p[k] / seen->cell - 0.5);
	for (int axis = 0; axis < 3; axis++) {
		if (fabsf(n[axis]) < LEAST_WAY)
			continue;
		for (int i = 0; i < 8; i++) {
			int at[3] = { first[0] + (i & 1), first[1] + (i >> 1 & 1), first[2] + (i >> 2) };

			if (has(seen, key_of(at, axis, n[axis] < 0)))
				return 1;
		}
	}
	return 0;
}

int seen_add(struct seen *seen, const float p[3], const float n[3])
{
	if (2 * seen->n_cells > seen->size && grow(seen) != PSR_OK)
		return PSR_ERR_MEMORY;
	(void)insert(seen, place_key(seen, p, n), &seen->n_cells);
	return PSR_OK;
}
