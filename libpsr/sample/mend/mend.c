#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "candidates.h"
#include "dice.h"
#include "mend.h"
#include "psr/error.h"
#include "sample/thin/cover.h"

#define CHEAP 7 /* of candidates that open no block */

/* Places for which candidates are found at once, by all threads. */
#define WINDOW 2048
#define PART 32

struct window {
	const struct keeper *keeper;
	const struct field *field;
	const struct place *place;
	struct candidates *candidates;
	uint8_t *is_covered;
	int n;
};

static void look_for_candidates(int i, void *userdata)
{
	struct window *window = userdata;

	for (int k = i * PART; k < (i + 1) * PART && k < window->n; k++)
		window->is_covered[k] = (uint8_t)candidates_look(&window->candidates[k], window->keeper, window->field,
		                                                 &window->place[k]);
}

/* Covers one place after the other. A place that costs more than `most` is left over, and asks for a block. */
static int cover_window(const struct window *window, float most, struct place *left, size_t *n_left)
{
	int rc = PSR_OK;

	for (int k = 0; rc == PSR_OK && k < window->n; k++) {
		const struct candidates *candidates = &window->candidates[k];
		int is_left = 0;

		if (!window->is_covered[k] && !candidates_are_superfluous(candidates, window->keeper, &window->place[k]))
			rc = candidates_take(candidates, window->keeper, &window->place[k], most, &is_left);
		if (is_left) {
			candidates_want(candidates, window->keeper);
			left[(*n_left)++] = window->place[k];
		}
	}
	return rc;
}

/* Moves places that are left over to the front: *n of them. */
static int cover_places(struct window *window, struct place *place, size_t *n, float most)
{
	size_t n_left = 0;
	int rc = PSR_OK;

	for (size_t done = 0; rc == PSR_OK && done < *n; done += (size_t)window->n) {
		window->place = place + done;
		window->n = (int)(*n - done < WINDOW ? *n - done : WINDOW);
		psr_pool_for(window->keeper->sampling->pool, (window->n + PART - 1) / PART, look_for_candidates, window);
		rc = cover_window(window, most, place, &n_left);
	}
	*n = n_left;
	return rc;
}

int mend_surface(const struct keeper *keeper, const struct field *field, int round)
{
	struct window window = { .keeper = keeper, .field = field };
	struct places places;
	size_t n, n_thin;
	int rc = dice(&places, &n_thin, keeper, field, round);

	n = n_thin;
	window.candidates = psr_alloc_array(WINDOW, sizeof *window.candidates);
	window.is_covered = psr_alloc_array(WINDOW, 1);
	if (window.candidates == NULL || window.is_covered == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK && n_thin != 0)
		rc = thin_cover(keeper, places.place, &n);
	if (rc == PSR_OK) {
		for (size_t i = n_thin; i < places.n; i++)
			places.place[n++] = places.place[i];
		rc = cover_places(&window, places.place, &n, CHEAP);
	}
	if (rc == PSR_OK)
		rc = cover_places(&window, places.place, &n, INFINITY);
	psr_free(window.candidates);
	psr_free(window.is_covered);
	free(places.place);
	return rc;
}

int mend_place(const struct keeper *keeper, const struct field *field, const struct place *place)
{
	struct candidates candidates;
	int is_left;

	candidates_find(&candidates, keeper, field, place);
	return candidates_take(&candidates, keeper, place, INFINITY, &is_left);
}
