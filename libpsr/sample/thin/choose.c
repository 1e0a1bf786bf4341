#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "base/cell.h"
#include "psr/error.h"
#include "choose.h"

#define MOST_MOVE 0.4 /* pixels */
#define MOST_GAIN 64  /* places that a candidate covers; more count as so many */
#define NOBODY UINT32_MAX

int thin_candidates_add(struct thin_candidates *list, const struct thin_candidate *candidate)
{
	if (list->n == list->capacity) {
		uint32_t capacity = list->capacity != 0 ? 2 * list->capacity : 4096;
		struct thin_candidate *grown = realloc(list->candidate, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		list->candidate = grown;
		list->capacity = capacity;
	}
	list->candidate[list->n++] = *candidate;
	return PSR_OK;
}

int thin_candidates_move(struct thin_candidates *list, const struct level *level, const struct surface_spot *spot,
                         unsigned q)
{
	const struct sheets *sheets = &level->sheets[q];
	struct thin_candidate candidate = { .ref = { q, { SHEET_NONE, 0 } }, .surface = spot->surface };
	struct lattice_point corner[3];
	double nearest = MOST_MOVE * level->ds * MOST_MOVE * level->ds, at[2], inner[3];
	int is_found = 0;
	float p[3];

	if (fabsf(v3f_dot(sheets->projection.axis[2], spot->n)) < SHEET_LEAST_COSINE)
		return PSR_OK;
	level_project(&sheets->projection, spot->p, p);
	sheets_triangle(sheets, (double)p[0], (double)p[1], corner);
	for (int k = 0; k < 3; k++) {
		double x, y, distance2;

		sheets_point(sheets, corner[k].row, corner[k].col, &x, &y);
		distance2 = (x - (double)p[0]) * (x - (double)p[0]) + (y - (double)p[1]) * (y - (double)p[1]);
		if (distance2 > nearest)
			continue;
		nearest = distance2;
		candidate.at = corner[k];
		at[0] = x;
		at[1] = y;
		is_found = 1;
	}
	if (!is_found)
		return PSR_OK;
	candidate.z = p[2];
	sheets_inner(&sheets->projection, at[0], at[1], (double)p[2], inner);
	v3f_set(candidate.position, (float)inner[0], (float)inner[1], (float)inner[2]);
	return thin_candidates_add(list, &candidate);
}

/* Places by cells twice as wide as the radius: those of a cell stand together, as each is looked at by many. */
struct grid {
	double radius;
	size_t size;     /* of the table of cells, a power of two */
	uint32_t *first; /* by cell, and the end: */
	struct place {
		float p[3], n[3];
		uint32_t spot;
	} *place;
};

static void cell_of(const struct grid *grid, const float p[3], double shift, int at[3])
{
	for (int k = 0; k < 3; k++)
		at[k] = cell_floor(((double)p[k] + shift) / (2 * grid->radius));
}

static size_t slot_of(const struct grid *grid, const int at[3])
{
	return cell_place(cell_key(at[0], at[1], at[2]), grid->size);
}

static size_t slot_of_place(const struct grid *grid, const float p[3])
{
	int at[3];

	cell_of(grid, p, 0, at);
	return slot_of(grid, at);
}

static void put_place(struct grid *grid, const struct surface_spot *spot, uint32_t i)
{
	struct place *place = &grid->place[--grid->first[slot_of_place(grid, spot->p)]];

	memcpy(place->p, spot->p, sizeof place->p);
	memcpy(place->n, spot->n, sizeof place->n);
	place->spot = i;
}

static int make_grid(struct grid *grid, const struct surface_spot *spot, size_t n, double radius)
{
	*grid = (struct grid){ .radius = radius, .size = 64 };
	while (grid->size < 2 * n)
		grid->size *= 2;
	grid->first = calloc(grid->size + 1, sizeof *grid->first);
	grid->place = malloc(n * sizeof *grid->place + 1);
	if (grid->first == NULL || grid->place == NULL)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < n; i++)
		grid->first[slot_of_place(grid, spot[i].p)]++;
	for (size_t slot = 0; slot < grid->size; slot++)
		grid->first[slot + 1] += grid->first[slot];
	for (size_t i = n; i-- > 0;)
		put_place(grid, &spot[i], (uint32_t)i);
	return PSR_OK;
}

/* Which places candidates cover, one after the other. */
struct covers {
	uint32_t *spot, n, capacity;
};

static int add_cover(struct covers *covers, uint32_t spot)
{
	if (covers->n == covers->capacity) {
		uint32_t capacity = covers->capacity != 0 ? 2 * covers->capacity : 65536;
		uint32_t *grown = realloc(covers->spot, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		covers->spot = grown;
		covers->capacity = capacity;
	}
	covers->spot[covers->n++] = spot;
	return PSR_OK;
}

static int look_into(const struct grid *grid, size_t slot, const float position[3], struct covers *covers)
{
	for (uint32_t i = grid->first[slot]; i < grid->first[slot + 1]; i++)
		if (cover_is_sheet_near(position, grid->place[i].p, grid->place[i].n, (float)grid->radius)
		    && add_cover(covers, grid->place[i].spot) != PSR_OK)
			return PSR_ERR_MEMORY;
	return PSR_OK;
}

/* In the eight cells around. Two of them may have one slot, which is looked into once. */
static int find_covered(const struct grid *grid, struct thin_candidate *candidate, struct covers *covers)
{
	size_t slot[8];
	int low[3], rc = PSR_OK;

	cell_of(grid, candidate->position, -grid->radius, low);
	candidate->first = covers->n;
	for (int i = 0; rc == PSR_OK && i < 8; i++) {
		int at[3] = { low[0] + (i & 1), low[1] + (i >> 1 & 1), low[2] + (i >> 2) }, is_new = 1;

		slot[i] = slot_of(grid, at);
		for (int k = 0; k < i; k++)
			is_new &= slot[k] != slot[i];
		if (is_new)
			rc = look_into(grid, slot[i], candidate->position, covers);
	}
	candidate->end = covers->n;
	return rc;
}

static unsigned gain_of(const struct thin_candidate *candidate, const struct covers *covers, const uint8_t *is_covered)
{
	unsigned gain = 0;

	for (uint32_t i = candidate->first; i < candidate->end; i++)
		gain += !is_covered[covers->spot[i]];
	return gain < MOST_GAIN ? gain : MOST_GAIN;
}

/* Lists by gain, which is looked up again when its turn comes: it only falls. Chosen ones get `first` NOBODY. */
static void choose(struct thin_candidates *list, const struct covers *covers, uint8_t *is_covered, uint32_t *next)
{
	uint32_t head[MOST_GAIN + 1], after;

	memset(head, 0xff, sizeof head);
	for (uint32_t i = list->n; i-- > 0;) {
		uint32_t n = list->candidate[i].end - list->candidate[i].first, gain = n < MOST_GAIN ? n : MOST_GAIN;

		next[i] = head[gain];
		head[gain] = i;
	}
	for (unsigned most = MOST_GAIN; most > 0; most--) {
		for (uint32_t i = head[most]; i != NOBODY; i = after) {
			struct thin_candidate *candidate = &list->candidate[i];
			unsigned gain = gain_of(candidate, covers, is_covered);

			after = next[i];
			if (gain < most) {
				next[i] = head[gain];
				head[gain] = i;
				continue;
			}
			for (uint32_t k = candidate->first; k < candidate->end; k++)
				is_covered[covers->spot[k]] = 1;
			candidate->first = NOBODY;
		}
	}
}

static void leave_chosen(struct thin_candidates *list, struct surface_spot *spot, size_t *n, const uint8_t *is_covered)
{
	uint32_t n_chosen = 0;
	size_t n_left = 0;

	for (uint32_t i = 0; i < list->n; i++)
		if (list->candidate[i].first == NOBODY)
			list->candidate[n_chosen++] = list->candidate[i];
	for (size_t i = 0; i < *n; i++)
		if (!is_covered[i])
			spot[n_left++] = spot[i];
	list->n = n_chosen;
	*n = n_left;
}

int thin_choose(struct thin_candidates *list, struct surface_spot *spot, size_t *n, double radius)
{
	struct covers covers = { NULL, 0, 0 };
	struct grid grid = { .first = NULL };
	uint32_t *next = malloc((size_t)list->n * sizeof *next + 1);
	uint8_t *is_covered = calloc(*n + 1, 1);
	int rc = next == NULL || is_covered == NULL ? PSR_ERR_MEMORY : make_grid(&grid, spot, *n, radius);

	for (uint32_t i = 0; rc == PSR_OK && i < list->n; i++)
		rc = find_covered(&grid, &list->candidate[i], &covers);
	if (rc == PSR_OK) {
		choose(list, &covers, is_covered, next);
		leave_chosen(list, spot, n, is_covered);
	}
	free(grid.first);
	free(grid.place);
	free(covers.spot);
	free(next);
	free(is_covered);
	return rc;
}
