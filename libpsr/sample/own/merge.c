#include "base/vec.h"
#include "owner.h"

/* Patches that own fewer samples than this give them away, fewest first, to projections that face them at an angle of
 * at least this cosine: a block costs as much as some ten samples. Beyond the tolerance angle samples lie too far
 * apart, and mending adds some, fewer than a block costs. */
static const struct {
	int least;
	float cosine;
} ROUND[] = { { 3, 0.85f }, { 6, 0.85f }, { 9, 0.85f }, { 12, 0.85f }, { 16, 0.85f },
	          { 6, 0.7f },  { 10, 0.7f }, { 6, 0.5f }, { 8, 0.5f } };
#define N_ROUNDS (int)(sizeof ROUND / sizeof *ROUND)
#define MOST_TRIES 8

struct job {
	struct ownership *ownership;
	const struct sampling *sampling;
	const struct sheets *sheets;
	const struct field *field;
	int least; /* the fewest samples that a patch may own in this round */
	float cosine;
};

struct claim {
	struct owned *owned; /* NULL: none */
	uint64_t bit;
};

/* Finds the nearest corner of projection q's lattice triangle with this surface, in a patch that owns enough. */
static struct claim find_claim(const struct job *job, unsigned q, const float p[3], uint32_t surface)
{
	const struct sheets *sheets = &job->sheets[q];
	struct claim claim = { NULL, 0 };
	struct lattice_point corner[3];
	float at[3], nearest = 1e30f, n[3], n_found[3];

	projection_project(&sheets->projection, p, at);
	sampling_normal(job->sampling, surface, n);
	sheets_triangle(sheets, (double)at[0], (double)at[1], corner);
	for (int i = 0; i < 3; i++) {
		struct sheet_ref ref = sheets_find(sheets, corner[i], at[2], SHEET_STEPS * sheets->projection.spacing);
		struct owned *owned = ref.patch != SHEET_NONE ? &job->ownership->patch[q][ref.patch] : NULL;
		float found[3], d[3], distance;

		if (owned == NULL || __builtin_popcountll(owned->mask) < job->least || (owned->hidden >> ref.sample & 1) != 0)
			continue;
		sampling_normal(job->sampling, sheets->sample[ref.patch][ref.sample].surface, n_found);
		sheets_position(sheets, ref, found);
		v3f_sub(d, found, p);
		distance = v3f_dot(d, d);
		if (v3f_dot(n, n_found) > 0 && distance < nearest) {
			nearest = distance;
			claim = (struct claim){ owned, UINT64_C(1) << ref.sample };
		}
	}
	return claim;
}

static struct claim find_other(const struct job *job, unsigned projection, const float p[3], uint32_t surface)
{
	float n[3], smooth[3], tried_above = 2;
	struct claim claim = { NULL, 0 };

	sampling_normal(job->sampling, surface, n);
	field_normal(job->field, p, n, smooth);
	v3f_normalize(smooth, smooth);
	for (int tries = 0; tries < MOST_TRIES && claim.owned == NULL; tries++) {
		unsigned best = N_PROJECTIONS;
		float most = job->cosine;

		for (unsigned q = 0; q < N_PROJECTIONS; q++) {
			const float *axis = job->sampling->projection[q].axis[2];
			float g = v3f_dot(axis, smooth);

			if (q != projection && g < tried_above && g > most && v3f_dot(axis, n) >= 0.4f) {
				most = g;
				best = q;
			}
		}
		if (best == N_PROJECTIONS)
			break;
		tried_above = most;
		claim = find_claim(job, best, p, surface);
	}
	return claim;
}

static void give_away(const struct job *job, unsigned projection, uint32_t p)
{
	const struct sheets *sheets = &job->sheets[projection];
	struct owned *owned = &job->ownership->patch[projection][p];
	struct claim claim[PSR_BLOCK_SAMPLES];
	int n = 0;

	for (uint64_t left = owned->mask; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		float position[3];

		sheets_position(sheets, (struct sheet_ref){ p, s }, position);
		claim[n] = find_other(job, projection, position, sheets->sample[p][s].surface);
		if (claim[n++].owned == NULL)
			return;
	}
	for (int i = 0; i < n; i++)
		claim[i].owned->mask |= claim[i].bit;
	owned->mask = 0;
}

/* Drops samples alone in their blocks: mending covers their places. */
static void drop_single(const struct job *job)
{
	for (unsigned i = 0; i < N_PROJECTIONS; i++) {
		struct owned *owned = job->ownership->patch[i];

		for (uint32_t p = 0; p < job->sheets[i].n_patches; p++)
			if (__builtin_popcountll(owned[p].mask) == 1)
				owned[p].mask = 0;
	}
}

void owner_merge(struct ownership *ownership, const struct sampling *sampling, const struct sheets *sheets,
                 const struct field *field)
{
	struct job job = { ownership, sampling, sheets, field, 0, 0 };

	for (int round = 0; round < N_ROUNDS; round++) {
		job.least = ROUND[round].least;
		job.cosine = ROUND[round].cosine;
		for (unsigned i = 0; i < N_PROJECTIONS; i++) {
			for (uint32_t p = 0; p < sheets[i].n_patches; p++) {
				int n = __builtin_popcountll(ownership->patch[i][p].mask);

				if (n > 0 && n < job.least)
					give_away(&job, i, p);
			}
		}
	}
	drop_single(&job);
}
