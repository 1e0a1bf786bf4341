#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "parts.h"

/* The pixels of a view's tests: the depth that its samples ask for, and how many of the samples that are left reach
 * it. */
struct table {
	float *need;     /* test by pixel; INFINITY: nothing is asked for */
	uint16_t *count;
	struct greedy_facing facing;
};

/* A block or a sample that may be dropped. */
struct unit {
	float score; /* mean cosine: the lowest is the worst seen */
	uint32_t view, block, first, n;
};

struct prune {
	struct greedy *greedy;
	const struct greedy_select_options *options;
	int n_tests;
	struct greedy_grid grid[GREEDY_MOST_ROTATIONS * GREEDY_MOST_SHIFTS];
	size_t n_pixels;
	struct table *table; /* by views */
	struct unit *unit;
	size_t n_units;
	uint16_t **taken;    /* counts that a unit under trial has been taken from */
	size_t n_taken;
	struct trials_seen *seen; /* of a unit's samples in one view */
};

static int sees(const struct prune *prune, const struct table *table, const struct greedy_sample *sample)
{
	return sample->is_kept && (!prune->options->is_facing || greedy_counts(&table->facing, sample));
}

static void ask(struct prune *prune, int v)
{
	const struct greedy_view *view = &prune->greedy->view[v];
	struct table *table = &prune->table[v];
	const float tolerance = (float)prune->options->depth_tolerance;

	for (size_t i = 0; i < (size_t)prune->n_tests * prune->n_pixels; i++)
		table->need[i] = -INFINITY;
	for (uint32_t i = 0; i < view->n_samples; i++) {
		struct trials_seen seen = trials_project(view->projection.axis, view->sample[i].position);
		float least = seen.z - tolerance * trials_depth_tolerance(view->sample[i].cosine, prune->greedy->ds);

		for (int t = 0; t < prune->n_tests; t++) {
			float *need = &table->need[(size_t)t * prune->n_pixels + greedy_pixel(&prune->grid[t], &seen)];

			*need = least > *need ? least : *need;
		}
	}
	for (size_t i = 0; i < (size_t)prune->n_tests * prune->n_pixels; i++)
		table->need[i] = table->need[i] == -INFINITY ? INFINITY : table->need[i];
}

/* Which samples a view asks for, and how often each is there. */
static void fill_table(int v, void *userdata)
{
	struct prune *prune = userdata;
	struct table *table = &prune->table[v];
	const float (*axis)[3] = prune->greedy->view[v].projection.axis;

	if (prune->greedy->view[v].n_samples == 0)
		return;
	greedy_facing_init(&table->facing, axis);
	ask(prune, v);
	memset(table->count, 0, (size_t)prune->n_tests * prune->n_pixels * sizeof *table->count);
	for (int w = 0; w < prune->greedy->n_views; w++) {
		const struct greedy_view *from = &prune->greedy->view[w];

		for (uint32_t i = 0; i < from->n_samples; i++) {
			struct trials_seen seen;

			if (!sees(prune, table, &from->sample[i]))
				continue;
			seen = trials_project(axis, from->sample[i].position);
			for (int t = 0; t < prune->n_tests; t++) {
				size_t at = (size_t)t * prune->n_pixels + greedy_pixel(&prune->grid[t], &seen);

				table->count[at] = (uint16_t)(table->count[at] + (seen.z >= table->need[at]));
			}
		}
	}
}

/* Takes a unit's samples out of a view's counts; 0 as soon as a pixel would lose its last one. */
static int take_out(struct prune *prune, const struct unit *unit, int v)
{
	struct table *table = &prune->table[v];
	const float (*axis)[3] = prune->greedy->view[v].projection.axis;
	const struct greedy_sample *sample = prune->greedy->view[unit->view].sample;
	uint32_t n = 0;

	if (table->need == NULL)
		return 1;
	for (uint32_t i = unit->first; i < unit->first + unit->n; i++)
		if (sees(prune, table, &sample[i]))
			prune->seen[n++] = trials_project(axis, sample[i].position);
	for (int t = 0; t < prune->n_tests; t++) {
		for (uint32_t i = 0; i < n; i++) {
			size_t at = (size_t)t * prune->n_pixels + greedy_pixel(&prune->grid[t], &prune->seen[i]);

			if (!(prune->seen[i].z >= table->need[at]))
				continue;
			prune->taken[prune->n_taken++] = &table->count[at];
			if (--table->count[at] == 0)
				return 0;
		}
	}
	return 1;
}

static int is_needed(struct prune *prune, const struct unit *unit)
{
	int n_views = prune->greedy->n_views, is_free = 1;

	prune->n_taken = 0;
	/* Its own view, where it is seen best, decides most often. */
	for (int i = 0; is_free && i < n_views; i++)
		is_free = take_out(prune, unit, (int)((unit->view + (uint32_t)i) % (uint32_t)n_views));
	if (!is_free)
		for (size_t i = 0; i < prune->n_taken; i++)
			++*prune->taken[i];
	return !is_free;
}

static int compare_units(const void *a, const void *b)
{
	const struct unit *x = a, *y = b;

	if (x->score != y->score)
		return x->score < y->score ? -1 : 1;
	if (x->view != y->view)
		return x->view < y->view ? -1 : 1;
	return (x->first > y->first) - (x->first < y->first);
}

static void add_unit(struct prune *prune, uint32_t view, uint32_t block, uint32_t first, uint32_t n)
{
	const struct greedy_sample *sample = prune->greedy->view[view].sample;
	struct unit *unit = &prune->unit[prune->n_units++];
	double sum = 0;

	for (uint32_t i = first; i < first + n; i++)
		sum += (double)sample[i].cosine;
	*unit = (struct unit){ (float)(sum / n), view, block, first, n };
}

static void list_units(struct prune *prune, int is_by_sample)
{
	for (int v = 0; v < prune->greedy->n_views; v++) {
		const struct greedy_view *view = &prune->greedy->view[v];

		for (uint32_t b = 0; b < view->n_blocks; b++) {
			const struct greedy_block *block = &view->block[b];

			if (!block->is_kept)
				continue;
			if (!is_by_sample)
				add_unit(prune, (uint32_t)v, b, block->first, block->n);
			for (uint32_t i = block->first; is_by_sample && i < block->first + block->n; i++)
				if (view->sample[i].is_kept)
					add_unit(prune, (uint32_t)v, b, i, 1);
		}
	}
	qsort(prune->unit, prune->n_units, sizeof *prune->unit, compare_units);
}

static void drop(struct greedy *greedy, const struct unit *unit)
{
	struct greedy_view *view = &greedy->view[unit->view];
	struct greedy_block *block = &view->block[unit->block];
	uint8_t is_left = 0;

	for (uint32_t i = unit->first; i < unit->first + unit->n; i++)
		view->sample[i].is_kept = 0;
	for (uint32_t i = block->first; i < block->first + block->n; i++)
		is_left |= view->sample[i].is_kept;
	block->is_kept = is_left;
}

static int prune_alloc(struct prune *prune, int is_by_sample)
{
	size_t n_units = 0, most = is_by_sample ? 1 : (size_t)prune->greedy->side * (size_t)prune->greedy->side;

	prune->table = calloc((size_t)prune->greedy->n_views, sizeof *prune->table);
	if (prune->table == NULL)
		return PSR_ERR_MEMORY;
	for (int v = 0; v < prune->greedy->n_views; v++) {
		const struct greedy_view *view = &prune->greedy->view[v];
		struct table *table = &prune->table[v];

		n_units += is_by_sample ? view->n_samples : view->n_blocks;
		if (view->n_samples == 0)
			continue;
		table->need = psr_alloc_array((size_t)prune->n_tests * prune->n_pixels, sizeof *table->need);
		table->count = psr_alloc_array((size_t)prune->n_tests * prune->n_pixels, sizeof *table->count);
		if (table->need == NULL || table->count == NULL)
			return PSR_ERR_MEMORY;
	}
	prune->unit = psr_alloc_array(n_units, sizeof *prune->unit);
	prune->seen = psr_alloc_array(most, sizeof *prune->seen);
	prune->taken = psr_alloc_array(most * (size_t)prune->n_tests * (size_t)prune->greedy->n_views,
	                               sizeof *prune->taken);
	return prune->unit == NULL || prune->seen == NULL || prune->taken == NULL ? PSR_ERR_MEMORY : PSR_OK;
}

static void prune_fini(struct prune *prune)
{
	for (int v = 0; prune->table != NULL && v < prune->greedy->n_views; v++) {
		psr_free(prune->table[v].need);
		psr_free(prune->table[v].count);
	}
	free(prune->table);
	psr_free(prune->unit);
	psr_free(prune->seen);
	psr_free(prune->taken);
}

int greedy_prune(struct greedy *greedy, const struct greedy_select_options *options, int is_by_sample)
{
	struct prune prune = { .greedy = greedy, .options = options, .n_tests = options->n_rotations * options->n_shifts };
	int rc;

	for (int t = 0; t < prune.n_tests; t++)
		greedy_grid_init(&prune.grid[t], t, options->n_shifts, greedy->ds);
	prune.n_pixels = (size_t)prune.grid[0].side * prune.grid[0].side;
	rc = prune_alloc(&prune, is_by_sample);
	if (rc == PSR_OK) {
		psr_pool_for(greedy->pool, greedy->n_views, fill_table, &prune);
		list_units(&prune, is_by_sample);
		for (size_t i = 0; i < prune.n_units; i++)
			if (!is_needed(&prune, &prune.unit[i]))
				drop(greedy, &prune.unit[i]);
	}
	prune_fini(&prune);
	return rc;
}
