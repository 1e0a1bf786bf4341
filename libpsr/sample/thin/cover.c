#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/cell.h"
#include "base/mem.h"
#include "choose.h"
#include "cover.h"
#include "psr/error.h"

/* The finest level has to be adequate between tested places, too. */
#define FINEST_NEAR (0.85 * KEPT_NEAR)

/* Side of a cube; hits inside of it cover its places. */
#define SIDE_PIXELS 32
#define LEAST_SIDE 0.125 /* of the unit sphere's radius */

/* Narrow primitives are sampled in three projections, any two 63 degrees apart (lines through corners of the
 * icosahedron), so that blocks are full: a needle has few hits in any. */
static const unsigned NARROW_PROJECTION[] = { 0, 4, 8 };
#define N_NARROW (sizeof NARROW_PROJECTION / sizeof *NARROW_PROJECTION)

struct cube {
	struct place *place;
	size_t n_places;
	uint32_t first, n_hits;
	struct thin_candidates chosen;
	int failed;
};

struct job {
	const struct keeper *keeper;
	double radius, side; /* radius that a sample covers; side of a cube */
	int n_side;          /* cubes along a side of all */
	uint32_t n_cubes;
	struct cube *cube;
	struct thin_candidate *hit; /* by cube, then by projection */
	uint32_t *count;            /* of hits, by projection and cube; then their places */
};

static uint32_t cube_of(const struct job *job, const float p[3])
{
	uint32_t cube = 0;

	for (int k = 2; k >= 0; k--) {
		int at = cell_floor((double)p[k] / job->side) + job->n_side / 2;

		at = at < 0 ? 0 : at < job->n_side ? at : job->n_side - 1;
		cube = cube * (uint32_t)job->n_side + (uint32_t)at;
	}
	return cube;
}

/* A leaf keeps the hits that it owns, and covers its rim by hits from all around. */
static int is_leaf(const struct keeper *keeper, uint32_t surface)
{
	const uint8_t *thin = keeper->sampling->thin;

	return thin != NULL && (thin[surface & ~SURFACE_BACK] & (THIN | THIN_NARROW)) == THIN;
}

static void each_hit(struct job *job, unsigned projection, int is_counting)
{
	const struct sheets *sheets = &job->keeper->sheets[projection];
	uint32_t *count = &job->count[(size_t)projection * job->n_cubes];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		const struct patch *patch = &sheets->patch[p];

		for (uint64_t left = patch->two_sided ? patch->mask & ~patch->kept : 0; left != 0; left &= left - 1) {
			uint32_t s = (uint32_t)__builtin_ctzll(left), cube;
			struct thin_candidate hit = { .ref = { projection, { p, s } } };

			if (!is_leaf(job->keeper, sheets->sample[p][s].surface))
				continue;
			sheets_position(sheets, hit.ref.at, hit.position);
			cube = cube_of(job, hit.position);
			if (job->cube[cube].n_places == 0)
				continue;
			if (!is_counting)
				job->hit[count[cube]] = hit;
			count[cube]++;
		}
	}
}

/* Of each pair of opposite projections, the first. */
static void count_hits(int line, void *job)
{
	each_hit(job, 2 * (unsigned)line, 1);
}

static void list_hits(int line, void *job)
{
	each_hit(job, 2 * (unsigned)line, 0);
}

static uint32_t place_hits(struct job *job)
{
	uint32_t n = 0;

	for (uint32_t c = 0; c < job->n_cubes; c++) {
		job->cube[c].first = n;
		for (unsigned q = 0; q < N_PROJECTIONS; q += 2) {
			uint32_t *count = &job->count[(size_t)q * job->n_cubes + c], here = *count;

			*count = n;
			n += here;
		}
		job->cube[c].n_hits = n - job->cube[c].first;
	}
	return n;
}

static int list_moved(const struct keeper *keeper, const struct place *place, struct thin_candidates *list)
{
	int rc = PSR_OK;

	for (size_t i = 0; rc == PSR_OK && i < N_NARROW; i++)
		rc = thin_candidates_move(list, &keeper->sheets[NARROW_PROJECTION[i]], NARROW_PROJECTION[i], place,
		                          keeper->sampling->ds);
	return rc;
}

static void cover_cube(int i, void *userdata)
{
	struct job *job = userdata;
	struct cube *cube = &job->cube[i];
	int rc = PSR_OK;

	for (uint32_t k = 0; rc == PSR_OK && k < cube->n_hits; k++)
		rc = thin_candidates_add(&cube->chosen, &job->hit[cube->first + k]);
	for (size_t k = 0; rc == PSR_OK && k < cube->n_places; k++)
		if (!is_leaf(job->keeper, cube->place[k].surface))
			rc = list_moved(job->keeper, &cube->place[k], &cube->chosen);
	if (rc == PSR_OK && cube->chosen.n != 0)
		rc = thin_choose(&cube->chosen, cube->place, &cube->n_places, job->radius);
	cube->failed = rc != PSR_OK;
}

static uint32_t count_chosen(const struct job *job)
{
	uint32_t n = 0;

	for (uint32_t c = 0; c < job->n_cubes; c++)
		n += job->cube[c].chosen.n;
	return n;
}

/* Hits first: a moved sample may take the place of a hit that is not kept. Threads then make all marked samples. */
static int keep_chosen(struct job *job)
{
	const struct keeper *keeper = job->keeper;
	struct sample_ref *ref = psr_alloc_array(count_chosen(job), sizeof *ref);
	uint32_t n = 0;
	int rc = ref != NULL ? PSR_OK : PSR_ERR_MEMORY;

	for (int are_moved = 0; are_moved < 2; are_moved++) {
		for (uint32_t c = 0; c < job->n_cubes; c++) {
			for (uint32_t i = 0; rc == PSR_OK && i < job->cube[c].chosen.n; i++) {
				struct thin_candidate *chosen = &job->cube[c].chosen.candidate[i];
				struct sheets *sheets = &keeper->sheets[chosen->ref.projection];

				if ((chosen->ref.at.patch == SHEET_NONE) != are_moved)
					continue;
				if (are_moved)
					rc = sheets_add(sheets, chosen->at, chosen->z, chosen->surface, 1, &chosen->ref.at);
				if (rc != PSR_OK || chosen->ref.at.patch == SHEET_NONE)
					continue;
				sheets_keep(sheets, chosen->ref.at);
				ref[n++] = chosen->ref;
			}
		}
	}
	if (rc == PSR_OK)
		rc = keep_samples(keeper, ref, n);
	psr_free(ref);
	return rc;
}

/* Sorts the places by cube. */
static int fill_cubes(struct job *job, struct place *place, size_t n)
{
	struct place *sorted = psr_alloc_array(n, sizeof *sorted);
	size_t at = 0;

	if (sorted == NULL)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < n; i++)
		job->cube[cube_of(job, place[i].p)].n_places++;
	for (uint32_t c = 0; c < job->n_cubes; c++) {
		job->cube[c].place = place + at;
		at += job->cube[c].n_places;
		job->cube[c].n_places = 0;
	}
	for (size_t i = 0; i < n; i++) {
		struct cube *cube = &job->cube[cube_of(job, place[i].p)];

		sorted[cube->place - place + (ptrdiff_t)cube->n_places++] = place[i];
	}
	memcpy(place, sorted, n * sizeof *place);
	psr_free(sorted);
	return PSR_OK;
}

static int cover_cubes(struct job *job)
{
	struct psr_pool *pool = job->keeper->sampling->pool;
	const int n_lines = N_PROJECTIONS / 2;

	psr_pool_for(pool, n_lines, count_hits, job);
	job->hit = psr_alloc_array(place_hits(job), sizeof *job->hit);
	if (job->hit == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(pool, n_lines, list_hits, job);
	psr_pool_for(pool, (int)job->n_cubes, cover_cube, job);
	for (uint32_t c = 0; c < job->n_cubes; c++)
		if (job->cube[c].failed)
			return PSR_ERR_MEMORY;
	return keep_chosen(job);
}

int thin_cover(const struct keeper *keeper, struct place *place, size_t *n)
{
	const struct sampling *sampling = keeper->sampling;
	struct job job = { .keeper = keeper, .radius = (sampling->level == 0 ? FINEST_NEAR : KEPT_NEAR) * sampling->ds,
		               .side = fmax(SIDE_PIXELS * sampling->ds, LEAST_SIDE) };
	int rc;

	job.n_side = 2 * (int)ceil(1 / job.side);
	job.n_cubes = (uint32_t)(job.n_side * job.n_side * job.n_side);
	job.count = calloc((size_t)N_PROJECTIONS * job.n_cubes, sizeof *job.count);
	job.cube = calloc(job.n_cubes, sizeof *job.cube);
	rc = job.count == NULL || job.cube == NULL ? PSR_ERR_MEMORY : fill_cubes(&job, place, *n);
	if (rc == PSR_OK)
		rc = cover_cubes(&job);
	*n = 0;
	for (uint32_t c = 0; rc == PSR_OK && c < job.n_cubes; c++) {
		memmove(place + *n, job.cube[c].place, job.cube[c].n_places * sizeof *place);
		*n += job.cube[c].n_places;
	}
	for (uint32_t c = 0; job.cube != NULL && c < job.n_cubes; c++)
		free(job.cube[c].chosen.candidate);
	free(job.count);
	free(job.cube);
	psr_free(job.hit);
	return rc;
}
