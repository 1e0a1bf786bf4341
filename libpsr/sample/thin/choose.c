#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/cell.h"
#include "base/table.h"
#include "base/vec.h"
#include "choose.h"
#include "psr/error.h"
#include "sample/own/kept.h"

#define MOST_MOVE 0.4 /* pixels */
#define MOST_GAIN 64  /* places that a candidate covers, at most */
#define NOBODY UINT32_MAX

int thin_candidates_add(struct thin_candidates *list, const struct thin_candidate *candidate)
{
	if (!ARRAY_ROOM(list->candidate, list->n, list->capacity))
		return PSR_ERR_MEMORY;
	list->candidate[list->n++] = *candidate;
	return PSR_OK;
}

int thin_candidates_move(struct thin_candidates *list, const struct sheets *sheets, unsigned q,
                         const struct place *place, double ds)
{
	struct thin_candidate candidate = { .ref = { q, { SHEET_NONE, 0 } }, .surface = place->surface };
	struct lattice_point corner[3];
	double nearest = MOST_MOVE * ds * MOST_MOVE * ds, at[2], inner[3];
	int is_found = 0;
	float p[3];

	if (fabsf(v3f_dot(sheets->projection.axis[2], place->n)) < SHEET_LEAST_COSINE)
		return PSR_OK;
	projection_project(&sheets->projection, place->p, p);
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
	projection_inner(&sheets->projection, at[0], at[1], (double)p[2], inner);
	v3f_set(candidate.position, (float)inner[0], (float)inner[1], (float)inner[2]);
	return thin_candidates_add(list, &candidate);
}

/* Places sorted by cells twice as wide as the radius. */
struct near_places {
	double radius;
	size_t size;     /* slots for cells, a power of two */
	uint32_t *first; /* by slot, and the end: */
	struct near_place {
		float p[3], n[3];
		uint32_t number;
	} *place;
};

static size_t slot_of(const struct near_places *near, const int at[3])
{
	return table_place(cell_key(at[0], at[1], at[2]), near->size);
}

static size_t slot_of_place(const struct near_places *near, const float p[3])
{
	int at[3];

	cell_of(p, 2 * near->radius, at);
	return slot_of(near, at);
}

static int sort_places(struct near_places *near, const struct place *place, size_t n, double radius)
{
	*near = (struct near_places){ .radius = radius, .size = 64 };
	while (near->size < 2 * n)
		near->size *= 2;
	near->first = calloc(near->size + 1, sizeof *near->first);
	near->place = malloc(n * sizeof *near->place + 1);
	if (near->first == NULL || near->place == NULL)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < n; i++)
		near->first[slot_of_place(near, place[i].p)]++;
	for (size_t slot = 0; slot < near->size; slot++)
		near->first[slot + 1] += near->first[slot];
	for (size_t i = n; i-- > 0;) {
		struct near_place *to = &near->place[--near->first[slot_of_place(near, place[i].p)]];

		memcpy(to->p, place[i].p, sizeof to->p);
		memcpy(to->n, place[i].n, sizeof to->n);
		to->number = (uint32_t)i;
	}
	return PSR_OK;
}

/* Finds the places that each candidate covers, one candidate after the other. */
struct covers {
	uint32_t *place, n, capacity;
};

static int add_cover(struct covers *covers, uint32_t place)
{
	if (!ARRAY_ROOM(covers->place, covers->n, covers->capacity))
		return PSR_ERR_MEMORY;
	covers->place[covers->n++] = place;
	return PSR_OK;
}

static int look_into(const struct near_places *near, size_t slot, const float position[3], struct covers *covers)
{
	for (uint32_t i = near->first[slot]; i < near->first[slot + 1]; i++)
		if (kept_covers_sheet(position, near->place[i].p, near->place[i].n, (float)near->radius)
		    && add_cover(covers, near->place[i].number) != PSR_OK)
			return PSR_ERR_MEMORY;
	return PSR_OK;
}

/* Looks in the eight cells around, some of which may share a slot. */
static int find_covered(const struct near_places *near, struct thin_candidate *candidate, struct covers *covers)
{
	size_t slot[8];
	int low[3], rc = PSR_OK;

	for (int k = 0; k < 3; k++)
		low[k] = cell_floor(((double)candidate->position[k] - near->radius) / (2 * near->radius));
	candidate->first = covers->n;
	for (int i = 0; rc == PSR_OK && i < 8; i++) {
		int at[3] = { low[0] + (i & 1), low[1] + (i >> 1 & 1), low[2] + (i >> 2) }, is_new = 1;

		slot[i] = slot_of(near, at);
		for (int k = 0; k < i; k++)
			is_new &= slot[k] != slot[i];
		if (is_new)
			rc = look_into(near, slot[i], candidate->position, covers);
	}
	candidate->end = covers->n;
	return rc;
}

static unsigned gain_of(const struct thin_candidate *candidate, const struct covers *covers, const uint8_t *is_covered)
{
	unsigned gain = 0;

	for (uint32_t i = candidate->first; i < candidate->end; i++)
		gain += !is_covered[covers->place[i]];
	return gain < MOST_GAIN ? gain : MOST_GAIN;
}

/* Lists by gain, which only falls: it is counted again when its turn comes. Chosen candidates get `first` NOBODY. */
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
				is_covered[covers->place[k]] = 1;
			candidate->first = NOBODY;
		}
	}
}

static void leave_chosen(struct thin_candidates *list, struct place *place, size_t *n, const uint8_t *is_covered)
{
	uint32_t n_chosen = 0;
	size_t n_left = 0;

	for (uint32_t i = 0; i < list->n; i++)
		if (list->candidate[i].first == NOBODY)
			list->candidate[n_chosen++] = list->candidate[i];
	for (size_t i = 0; i < *n; i++)
		if (!is_covered[i])
			place[n_left++] = place[i];
	list->n = n_chosen;
	*n = n_left;
}

int thin_choose(struct thin_candidates *list, struct place *place, size_t *n, double radius)
{
	struct covers covers = { NULL, 0, 0 };
	struct near_places near = { .first = NULL };
	uint32_t *next = malloc((size_t)list->n * sizeof *next + 1);
	uint8_t *is_covered = calloc(*n + 1, 1);
	int rc = next == NULL || is_covered == NULL ? PSR_ERR_MEMORY : sort_places(&near, place, *n, radius);

	for (uint32_t i = 0; rc == PSR_OK && i < list->n; i++)
		rc = find_covered(&near, &list->candidate[i], &covers);
	if (rc == PSR_OK) {
		choose(list, &covers, is_covered, next);
		leave_chosen(list, place, n, is_covered);
	}
	free(near.first);
	free(near.place);
	free(covers.place);
	free(next);
	free(is_covered);
	return rc;
}
