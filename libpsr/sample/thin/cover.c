#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "base/cell.h"
#include "psr/error.h"
#include "choose.h"
#include "cover.h"

#define NARROW 0.5 /* pixels */

/* The finest level has to be adequate, and between places that are tested there are others. */
#define FINEST_NEAR (0.85 * LEVEL_NEAR)

/* Of a cube: what is in it is covered by hits in it. */
#define SIDE_PIXELS 32
#define LEAST_SIDE 0.125 /* of the unit sphere's radius */

/* What is narrow is sampled in three projections, any two of which are 63 degrees apart (lines through corners of the
 * icosahedron), so that blocks are full: a needle has too few hits in any. */
static const unsigned NARROW_PROJECTION[] = { 0,4,8 };
#define N_NARROW (sizeof NARROW_PROJECTION / sizeof *NARROW_PROJECTION)

struct cube {
	struct surface_spot *spot;
	size_t n_spots;
	uint32_t first, n_hits;
	struct thin_candidates chosen;
	int failed;
};

struct job {
	struct level *level;
	double radius, side; /* of what a sample covers; of a cube */
	int n_side;          /* cubes along a side of all */
	uint32_t n_cubes;
	struct cube *cube;
	struct thin_candidate *hit; /* by cube, then by projection */
	uint32_t *count;            /* of hits, by projection and cube; then where they go */
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

/* A leaf keeps what faces it, and gets what its rim lacks from hits of all around. */
static int is_leaf(const struct level *level, uint32_t surface)
{
	return (level->sides[surface & ~SHEET_BACK] & (SIDE_THIN | SIDE_NARROW)) == SIDE_THIN;
}

static void each_hit(struct job *job, unsigned projection, int is_counting)
{
	const struct level *level = job->level;
	const struct sheets *sheets = &level->sheets[projection];
	uint32_t *count = &job->count[(size_t)projection * job->n_cubes];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		const struct patch *patch = &sheets->patch[p];

		for (uint64_t left = patch->two_sided ? patch->mask & ~patch->kept : 0; left != 0; left &= left - 1) {
			uint32_t s = (uint32_t)__builtin_ctzll(left), cube;
			struct thin_candidate hit = { .ref = { projection, { p, s } } };

			if (!is_leaf(level, sheets->sample[p][s].surface))
				continue;
			sheets_position(sheets, hit.ref.at, hit.position);
			cube = cube_of(job, hit.position);
			if (job->cube[cube].n_spots == 0)
				continue;
			if (!is_counting)
				job->hit[count[cube]] = hit;
			count[cube]++;
		}
	}
}

/* Of projections from both ends of a line the first one's. */
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
		for (unsigned q = 0; q < job->level->n_projections; q += 2) {
			uint32_t *count = &job->count[(size_t)q * job->n_cubes + c], here = *count;

			*count = n;
			n += here;
		}
		job->cube[c].n_hits = n - job->cube[c].first;
	}
	return n;
}

static int list_moved(const struct level *level, const struct surface_spot *spot, struct thin_candidates *list)
{
	int rc = PSR_OK;

	for (size_t i = 0; rc == PSR_OK && i < N_NARROW && NARROW_PROJECTION[i] < level->n_projections; i++)
		rc = thin_candidates_move(list, level, spot, NARROW_PROJECTION[i]);
	return rc;
}

static void cover_cube(int i, void *userdata)
{
	struct job *job = userdata;
	struct cube *cube = &job->cube[i];
	int rc = PSR_OK;

	for (uint32_t k = 0; rc == PSR_OK && k < cube->n_hits; k++)
		rc = thin_candidates_add(&cube->chosen, &job->hit[cube->first + k]);
	for (size_t k = 0; rc == PSR_OK && k < cube->n_spots; k++)
		if (!is_leaf(job->level, cube->spot[k].surface))
			rc = list_moved(job->level, &cube->spot[k], &cube->chosen);
	if (rc == PSR_OK && cube->chosen.n != 0)
		rc = thin_choose(&cube->chosen, cube->spot, &cube->n_spots, job->radius);
	cube->failed = rc != PSR_OK;
}

static uint32_t count_chosen(const struct job *job)
{
	uint32_t n = 0;

	for (uint32_t c = 0; c < job->n_cubes; c++)
		n += job->cube[c].chosen.n;
	return n;
}

/* Hits first: what is moved may take the place of one that is not kept. */
static int keep_chosen(struct job *job)
{
	struct level *level = job->level;
	struct level_ref *ref = psr_alloc_array(count_chosen(job), sizeof *ref);
	uint32_t n = 0;
	int rc = ref != NULL ? PSR_OK : PSR_ERR_MEMORY;

	for (int are_moved = 0; are_moved < 2; are_moved++) {
		for (uint32_t c = 0; c < job->n_cubes; c++) {
			for (uint32_t i = 0; rc == PSR_OK && i < job->cube[c].chosen.n; i++) {
				struct thin_candidate *chosen = &job->cube[c].chosen.candidate[i];

				if ((chosen->ref.at.patch == SHEET_NONE) != are_moved)
					continue;
				if (are_moved)
					rc = sheets_add(&level->sheets[chosen->ref.projection], chosen->at, chosen->z, chosen->surface, 1,
					                &chosen->ref.at);
				if (rc != PSR_OK || chosen->ref.at.patch == SHEET_NONE)
					continue;
				keep_mark(level, &chosen->ref);
				ref[n++] = chosen->ref;
			}
		}
	}
	if (rc == PSR_OK)
		rc = keep_samples(level, ref, n);
	psr_free(ref);
	return rc;
}

/* Sorts the places by cube. */
static int fill_cubes(struct job *job, struct surface_spot *spot, size_t n)
{
	struct surface_spot *sorted = psr_alloc_array(n, sizeof *sorted);
	size_t at = 0;

	if (sorted == NULL)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < n; i++)
		job->cube[cube_of(job, spot[i].p)].n_spots++;
	for (uint32_t c = 0; c < job->n_cubes; c++) {
		job->cube[c].spot = spot + at;
		at += job->cube[c].n_spots;
		job->cube[c].n_spots = 0;
	}
	for (size_t i = 0; i < n; i++) {
		struct cube *cube = &job->cube[cube_of(job, spot[i].p)];

		sorted[cube->spot - spot + (ptrdiff_t)cube->n_spots++] = spot[i];
	}
	memcpy(spot, sorted, n * sizeof *spot);
	psr_free(sorted);
	return PSR_OK;
}

static int cover_cubes(struct job *job)
{
	struct psr_pool *pool = job->level->pool;
	int n_lines = (int)(job->level->n_projections + 1) / 2;

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

int thin_cover(struct level *level, struct surface_spot *spot, size_t *n)
{
	struct job job = { .level = level, .radius = (level->finer == NULL ? FINEST_NEAR : LEVEL_NEAR) * level->ds,
		               .side = fmax(SIDE_PIXELS * level->ds, LEAST_SIDE) };
	int rc;

	job.n_side = 2 * (int)ceil(1 / job.side);
	job.n_cubes = (uint32_t)(job.n_side * job.n_side * job.n_side);
	job.count = calloc((size_t)level->n_projections * job.n_cubes, sizeof *job.count);
	job.cube = calloc(job.n_cubes, sizeof *job.cube);
	rc = job.count == NULL || job.cube == NULL ? PSR_ERR_MEMORY : fill_cubes(&job, spot, *n);
	if (rc == PSR_OK)
		rc = cover_cubes(&job);
	*n = 0;
	for (uint32_t c = 0; rc == PSR_OK && c < job.n_cubes; c++) {
		memmove(spot + *n, job.cube[c].spot, job.cube[c].n_spots * sizeof *spot);
		*n += job.cube[c].n_spots;
	}
	for (uint32_t c = 0; job.cube != NULL && c < job.n_cubes; c++)
		free(job.cube[c].chosen.candidate);
	free(job.count);
	free(job.cube);
	psr_free(job.hit);
	return rc;
}

#define CHUNK 4096

static void mark_narrow(int i, void *userdata)
{
	struct level *level = userdata;
	uint32_t prim = (uint32_t)i * CHUNK, end = prim + CHUNK;

	end = end < level->mesh->n_triangles ? end : level->mesh->n_triangles;
	for (; prim < end; prim++) {
		double corner[3][3], side[3][3], cross[3], longest = 0;

		if ((level->sides[prim] & SIDE_THIN) == 0)
			continue;
		ray_scene_corners(level->scene, prim, corner);
		for (int k = 0; k < 3; k++) {
			v3d_sub(side[k], corner[(k + 1) % 3], corner[k]);
			longest = fmax(longest, v3d_length(side[k]));
		}
		v3d_cross(cross, side[0], side[1]);
		if (v3d_length(cross) < NARROW * level->ds * longest)
			level->sides[prim] = (uint8_t)((level->sides[prim] | SIDE_NARROW) & ~SIDE_BEHIND);
	}
}

void thin_mark_narrow(struct level *level)
{
	psr_pool_for(level->pool, (int)((level->mesh->n_triangles + CHUNK - 1) / CHUNK), mark_narrow, level);
}
