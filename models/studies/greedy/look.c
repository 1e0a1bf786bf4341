#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "parts.h"
#include "base/direction.h"

#define TURN 0.39269908169872414 /* 22.5 degrees */

/* A sample of the view under test, as a test wants it. */
struct candidate {
	struct trials_seen seen;
	float least_z;  /* a picture with less at this place misses it, */
	int is_lenient; /* unless, with this, it has the same surface within half a pixel more */
	uint32_t block;
};

struct look {
	const struct greedy *greedy;
	const struct greedy_select_options *options;
	int view;
	struct greedy_facing facing;
	struct trials_seen *seen; /* of each view's kept samples the ones that count, from first[view] on */
	size_t first[GREEDY_MOST_VIEWS];
	uint32_t n_seen[GREEDY_MOST_VIEWS];
	struct candidate *candidate;
	uint32_t n_candidates;
	uint8_t *is_missed;
	int failed;
};

void greedy_grid_init(struct greedy_grid *grid, int test, int n_shifts, double ds)
{
	/* A pixel more on each side for the shift and one for rounding. */
	uint32_t middle = (uint32_t)ceil(1 / ds) + 2;
	int shift = test % n_shifts;
	double sine, cosine;

	psr_sincos(test / n_shifts * TURN, &sine, &cosine);
	grid->cosine = (float)(cosine / ds);
	grid->sine = (float)(sine / ds);
	grid->shift[0] = (float)middle + (float)(shift % 2) / 2;
	grid->shift[1] = (float)middle + (float)(shift / 2) / 2;
	grid->side = 2 * middle;
}

void greedy_facing_init(struct greedy_facing *facing, const float axis[3][3])
{
	const float (*normal)[3] = psr_direction_table();

	memset(facing, 0, sizeof *facing);
	for (uint32_t n = 0; n < PSR_DIRECTIONS; n++)
		facing->bit[n / 64] |= (uint64_t)(trials_project(axis, normal[n]).z > 0) << n % 64;
}

static void look_at_view(int v, void *userdata)
{
	struct look *look = userdata;
	const struct greedy_view *view = &look->greedy->view[v];
	const float (*axis)[3] = look->greedy->view[look->view].projection.axis;
	uint32_t n = 0;

	for (uint32_t b = 0; v != look->view && b < view->n_blocks; b++) {
		const struct greedy_block *block = &view->block[b];

		for (uint32_t i = block->first; block->is_kept && i < block->first + block->n; i++) {
			const struct greedy_sample *sample = &view->sample[i];

			if (sample->is_kept && (!look->options->is_facing || greedy_counts(&look->facing, sample)))
				look->seen[look->first[v] + n++] = trials_project(axis, sample->position);
		}
	}
	look->n_seen[v] = n;
}

static void take_candidates(struct look *look, struct greedy_strictness strictness)
{
	const struct greedy_view *view = &look->greedy->view[look->view];
	const float tolerance = (float)look->options->depth_tolerance;

	for (uint32_t b = 0; b < view->n_blocks; b++) {
		const struct greedy_block *block = &view->block[b];

		if (strictness.kept_only && !block->is_kept)
			continue;
		for (uint32_t i = block->first; i < block->first + block->n; i++) {
			const struct greedy_sample *sample = &view->sample[i];
			struct candidate *candidate = &look->candidate[look->n_candidates];

			if (sample->cosine < strictness.least_cosine)
				continue;
			candidate->seen = trials_project(view->projection.axis, sample->position);
			candidate->least_z = candidate->seen.z
			                     - tolerance * trials_depth_tolerance(sample->cosine, look->greedy->ds);
			candidate->is_lenient = sample->cosine < strictness.lenient_below;
			candidate->block = b;
			look->n_candidates++;
		}
	}
}

/* Whether S has a point as near as this candidate in its pixel, or a point of the same surface in the pixels at the
 * corners of a pixel around it. */
static int is_there(const float *z, const struct greedy_grid *grid, const struct candidate *candidate)
{
	static const float corner[4][2] = { { -0.5f, -0.5f }, { 0.5f, -0.5f }, { -0.5f, 0.5f }, { 0.5f, 0.5f } };

	if (z[greedy_pixel(grid, &candidate->seen)] >= candidate->least_z)
		return 1;
	for (int i = 0; candidate->is_lenient && i < 4; i++) {
		struct greedy_grid moved = *grid;
		float beside;

		moved.shift[0] += corner[i][0];
		moved.shift[1] += corner[i][1];
		beside = z[greedy_pixel(&moved, &candidate->seen)];
		if (beside >= candidate->least_z && beside <= 2 * candidate->seen.z - candidate->least_z)
			return 1;
	}
	return 0;
}

/* One rotation and one shift of the view: S is drawn and the blocks whose samples it lacks are marked. */
static void test_view(int test, void *userdata)
{
	struct look *look = userdata;
	struct greedy_grid grid;
	float *z;

	greedy_grid_init(&grid, test, look->options->n_shifts, look->greedy->ds);
	z = psr_alloc_array((size_t)grid.side * grid.side, sizeof *z);
	if (z == NULL) {
		__atomic_store_n(&look->failed, 1, __ATOMIC_RELAXED);
		return;
	}
	for (size_t i = 0; i < (size_t)grid.side * grid.side; i++)
		z[i] = -INFINITY;
	for (int v = 0; v < look->greedy->n_views; v++) {
		const struct trials_seen *seen = look->seen + look->first[v];

		for (uint32_t i = 0; i < look->n_seen[v]; i++) {
			float *pixel = &z[greedy_pixel(&grid, &seen[i])];

			*pixel = seen[i].z > *pixel ? seen[i].z : *pixel;
		}
	}
	for (uint32_t i = 0; i < look->n_candidates; i++) {
		const struct candidate *candidate = &look->candidate[i];

		if (!__atomic_load_n(&look->is_missed[candidate->block], __ATOMIC_RELAXED) && !is_there(z, &grid, candidate))
			__atomic_store_n(&look->is_missed[candidate->block], 1, __ATOMIC_RELAXED);
	}
	psr_free(z);
}

int greedy_find_missed(const struct greedy *greedy, int view, const struct greedy_select_options *options,
                       struct greedy_strictness strictness, int n_tests, uint8_t *is_missed)
{
	struct look look = { .greedy = greedy, .options = options, .view = view, .is_missed = is_missed };
	size_t n = 0;

	for (int v = 0; v < greedy->n_views; v++) {
		look.first[v] = n;
		n += greedy->view[v].n_samples;
	}
	memset(is_missed, 0, greedy->view[view].n_blocks);
	look.seen = psr_alloc_array(n, sizeof *look.seen);
	look.candidate = psr_alloc_array(greedy->view[view].n_samples, sizeof *look.candidate);
	if (look.seen == NULL || look.candidate == NULL) {
		look.failed = 1;
	} else {
		greedy_facing_init(&look.facing, greedy->view[view].projection.axis);
		psr_pool_for(greedy->pool, greedy->n_views, look_at_view, &look);
		take_candidates(&look, strictness);
		psr_pool_for(greedy->pool, n_tests, test_view, &look);
	}
	psr_free(look.seen);
	psr_free(look.candidate);
	return look.failed ? PSR_ERR_MEMORY : PSR_OK;
}
