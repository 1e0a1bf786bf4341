#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/maths.h"
#include "../base/mem.h"
#include "../base/vec.h"
#include "cover.h"
#include "projection.h"
#include "sample.h"
#include "select.h"

#define N_ROTATIONS 4
#define TURN 0.39269908169872414 /* 22.5 degrees */
#define N_SHIFTS 4
#define N_TESTS (N_ROTATIONS * N_SHIFTS)
#define N_SWEEPS 2
#define SCOUT_STRIDE 4

/* A sample of the projection under way, as a test wants it. */
struct candidate {
	struct cover_seen seen;
	float least_z;  /* a picture with less at this place misses it, */
	int is_lenient; /* unless, with this, it has the same surface within half a pixel more */
};

/* Which samples may choose blocks, by the cosine of the angle at which their projection sees them. */
struct strictness {
	float least_cosine, lenient_below;
};

/* Outlines differ in part of a pixel from every side, and each projection sees its own at a steep angle. */
#define OUTLINE_COSINE 0.5f

struct select {
	const struct select_input *input;
	struct selection *selection;
	struct cover cover;
	uint8_t *is_two_sided; /* by primitives */

	/* The projection under way: */
	unsigned projection;
	const struct lattice *lattice;
	struct strictness strictness;
	struct candidate (*candidate)[PSR_BLOCK_SAMPLES];
	uint64_t *eligible, *missed;
	int failed;
	size_t first_new; /* of the selection's blocks */
};

static int note_sides(struct select *select)
{
	enum { FRONT = 1, BACK = 2 };
	uint32_t n = select->input->mesh->n_triangles;

	select->is_two_sided = psr_alloc_array(n, 1);
	if (select->is_two_sided == NULL)
		return PSR_ERR_MEMORY;
	memset(select->is_two_sided, 0, n);
	for (unsigned p = 0; p < N_PROJECTIONS; p++) {
		const struct lattice *lattice = &select->input->lattice[p];

		for (uint32_t b = 0; b < lattice->n_blocks; b++) {
			for (uint64_t left = lattice->mask[b]; left != 0; left &= left - 1) {
				uint32_t surface = lattice->sample[b][__builtin_ctzll(left)].surface;

				select->is_two_sided[surface & ~LATTICE_BACK] |= (surface & LATTICE_BACK) != 0 ? BACK : FRONT;
			}
		}
	}
	for (uint32_t i = 0; i < n; i++)
		select->is_two_sided[i] = select->is_two_sided[i] == (FRONT | BACK);
	return PSR_OK;
}

/* A surface at an angle a to the view falls by tan a a pixel, and two points of a pixel are up to 1.42 pixels apart. */
static float tolerance_of(float cosine, double ds)
{
	float c = cosine > 0.03f ? cosine : 0.03f;

	return (float)ds * (1 + 1.5f * sqrtf(1 - c * c) / c);
}

static void prepare_block(int b, void *userdata)
{
	struct select *select = userdata;
	const struct lattice *lattice = select->lattice;

	select->missed[b] = select->eligible[b] = 0;
	for (uint64_t left = lattice->mask[b]; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		float cosine = sample_cosine(select->input->scene, &lattice->projection, &lattice->sample[b][s]), position[3];
		struct candidate *candidate = &select->candidate[b][s];

		if (cosine < select->strictness.least_cosine)
			continue;
		select->eligible[b] |= UINT64_C(1) << s;
		sample_position(lattice, (uint32_t)b, s, position);
		candidate->seen = cover_project(lattice->projection.axis, position);
		candidate->least_z = candidate->seen.z - tolerance_of(cosine, select->input->ds);
		candidate->is_lenient = cosine < select->strictness.lenient_below;
	}
}

/* Whether S has a point as near as this candidate in its pixel; or one of the same surface in those at the corners of a
 * pixel around it. */
static int is_there(const float *z, const struct cover_grid *grid, const struct candidate *candidate)
{
	static const float corner[4][2] = { { -0.5f, -0.5f }, { 0.5f, -0.5f }, { -0.5f, 0.5f }, { 0.5f, 0.5f } };

	if (z[cover_pixel(grid, &candidate->seen)] >= candidate->least_z)
		return 1;
	for (int i = 0; candidate->is_lenient && i < 4; i++) {
		struct cover_grid moved = *grid;
		float beside;

		moved.shift[0] += corner[i][0];
		moved.shift[1] += corner[i][1];
		beside = z[cover_pixel(&moved, &candidate->seen)];
		if (beside >= candidate->least_z && beside <= 2 * candidate->seen.z - candidate->least_z)
			return 1;
	}
	return 0;
}

/* One rotation and one shift of the view: S is drawn and the samples that it lacks are marked. */
static void test_view(int test, void *userdata)
{
	struct select *select = userdata;
	struct cover_grid grid;
	float *z;

	cover_grid_init(&grid, test / N_SHIFTS * TURN, test % 2 / 2.0, test / 2 % 2 / 2.0, select->input->ds);
	z = psr_alloc_array((size_t)grid.side * grid.side, sizeof *z);
	if (z == NULL) {
		__atomic_store_n(&select->failed, 1, __ATOMIC_RELAXED);
		return;
	}
	cover_draw(&select->cover, &grid, z);
	for (uint32_t b = 0; b < select->lattice->n_blocks; b++) {
		uint64_t missed = 0;

		for (uint64_t left = select->eligible[b]; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			const struct candidate *candidate = &select->candidate[b][s];

			missed |= (uint64_t)!is_there(z, &grid, candidate) << s;
		}
		if (missed != 0)
			__atomic_fetch_or(&select->missed[b], missed, __ATOMIC_RELAXED);
	}
	psr_free(z);
}

static int grow_selection(struct selection *selection, size_t n_blocks, size_t n_samples)
{
	if (n_blocks > selection->capacity) {
		size_t capacity = n_blocks + n_blocks / 2;
		void *block = realloc(selection->block, capacity * sizeof *selection->block);

		if (block == NULL)
			return PSR_ERR_MEMORY;
		selection->block = block;
		selection->capacity = capacity;
	}
	if (n_samples > selection->attr_capacity) {
		size_t capacity = n_samples + n_samples / 2;
		void *attr = realloc(selection->attr, capacity * sizeof *selection->attr);

		if (attr == NULL)
			return PSR_ERR_MEMORY;
		selection->attr = attr;
		selection->attr_capacity = capacity;
	}
	return PSR_OK;
}

static void choose_block(struct select *select, uint32_t b)
{
	const struct lattice *lattice = select->lattice;
	struct selection *selection = select->selection;
	struct selected_block *block = &selection->block[selection->n_blocks++];

	*block = (struct selected_block){ .projection = (uint16_t)select->projection, .block = b, .mask = lattice->mask[b],
		                              .first = selection->n_samples };
	for (unsigned s = 0; s < PSR_BLOCK_SAMPLES; s++) {
		const struct lattice_sample *sample = &lattice->sample[b][s];

		if ((block->mask >> s & 1) != 0)
			block->two_sided |= select->is_two_sided[sample->surface & ~LATTICE_BACK];
	}
	selection->n_samples += (size_t)__builtin_popcountll(block->mask);
}

/* Makes the attributes of a new block, and its part of S. */
static void fill_block(int i, void *userdata)
{
	struct select *select = userdata;
	const struct selected_block *block = &select->selection->block[select->first_new + (size_t)i];
	size_t at = block->first;

	for (uint64_t left = block->mask; left != 0; left &= left - 1, at++) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		uint32_t surface = select->lattice->sample[block->block][s].surface;
		struct cover_point *point = &select->cover.point[at];

		select->selection->attr[at] = sample_attr(select->input->mesh, select->input->scene, select->lattice,
		                                          block->block, s);
		sample_position(select->lattice, block->block, s, point->position);
		point->normal = (uint16_t)PSR_ATTR_NORMAL(select->selection->attr[at]);
		point->two_sided = select->is_two_sided[surface & ~LATTICE_BACK];
	}
}

static int add_missed(struct select *select)
{
	struct selection *selection = select->selection;
	size_t n_new = 0, most;

	for (uint32_t b = 0; b < select->lattice->n_blocks; b++)
		n_new += select->missed[b] != 0;
	most = selection->n_samples + n_new * PSR_BLOCK_SAMPLES;
	if (grow_selection(selection, selection->n_blocks + n_new, most) != PSR_OK
	    || cover_reserve(&select->cover, most) != PSR_OK)
		return PSR_ERR_MEMORY;
	select->first_new = selection->n_blocks;
	for (uint32_t b = 0; b < select->lattice->n_blocks; b++)
		if (select->missed[b] != 0)
			choose_block(select, b);
	select->cover.n_points = selection->n_samples;
	psr_pool_for(select->input->pool, (int)n_new, fill_block, select);
	return PSR_OK;
}

/* Marks what S misses of a projection's samples in the first n_tests. */
static int find_missed(struct select *select, const struct lattice *lattice, struct strictness strictness, int n_tests)
{
	select->lattice = lattice;
	select->strictness = strictness;
	select->candidate = psr_alloc_array(lattice->n_blocks, sizeof *select->candidate);
	select->missed = psr_alloc_array(lattice->n_blocks, sizeof *select->missed);
	select->eligible = psr_alloc_array(lattice->n_blocks, sizeof *select->eligible);
	if (select->candidate == NULL || select->missed == NULL || select->eligible == NULL)
		return PSR_ERR_MEMORY;
	cover_look(&select->cover, lattice->projection.axis, select->input->pool);
	psr_pool_for(select->input->pool, (int)lattice->n_blocks, prepare_block, select);
	psr_pool_for(select->input->pool, n_tests, test_view, select);
	return select->failed ? PSR_ERR_MEMORY : PSR_OK;
}

static void forget_missed(struct select *select)
{
	psr_free(select->candidate);
	psr_free(select->missed);
	psr_free(select->eligible);
	select->candidate = NULL;
	select->missed = select->eligible = NULL;
}

static int visit_projection(struct select *select, unsigned projection, struct strictness strictness)
{
	int rc = find_missed(select, &select->input->lattice[projection], strictness, N_TESTS);

	select->projection = projection;
	if (rc == PSR_OK)
		rc = add_missed(select);
	forget_missed(select);
	return rc;
}

static int is_any_missed(const struct select *select)
{
	for (uint32_t b = 0; b < select->lattice->n_blocks; b++)
		if (select->missed[b] != 0)
			return 1;
	return 0;
}

static int visit_scout(struct select *select, unsigned projection)
{
	const struct strictness lenient = { .least_cosine = 0, .lenient_below = INFINITY };
	const struct select_input *input = select->input;
	struct lattice part;
	int is_needed, rc = lattice_trace(&part, input->scene, &input->projection[projection], SCOUT_STRIDE, input->pool);

	if (rc != PSR_OK)
		return rc;
	rc = find_missed(select, &part, lenient, 1);
	is_needed = rc == PSR_OK && is_any_missed(select);
	forget_missed(select);
	lattice_fini(&part);
	if (!is_needed)
		return rc;
	rc = lattice_trace(&input->lattice[projection], input->scene, &input->projection[projection], 1, input->pool);
	return rc == PSR_OK ? visit_projection(select, projection, lenient) : rc;
}

int select_blocks(struct selection *selection, const struct select_input *input)
{
	struct select select = { .input = input, .selection = selection };
	const struct strictness sweep[N_SWEEPS] = { { input->cosine, 0 }, { 0, OUTLINE_COSINE } };
	unsigned n_visits = N_SWEEPS * N_PROJECTIONS + N_SCOUTS;
	int rc;

	memset(selection, 0, sizeof *selection);
	rc = note_sides(&select);
	for (unsigned i = 0; rc == PSR_OK && i < n_visits; i++) {
		if (i < N_SWEEPS * N_PROJECTIONS)
			rc = visit_projection(&select, i % N_PROJECTIONS, sweep[i / N_PROJECTIONS]);
		else
			rc = visit_scout(&select, i - (N_SWEEPS - 1) * N_PROJECTIONS);
		if (input->on_progress != NULL)
			input->on_progress(i + 1, n_visits, input->userdata);
	}
	psr_free(select.is_two_sided);
	cover_fini(&select.cover);
	return rc;
}

void selection_fini(struct selection *selection)
{
	free(selection->block);
	free(selection->attr);
	memset(selection, 0, sizeof *selection);
}
