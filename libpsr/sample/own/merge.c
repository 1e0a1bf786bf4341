#include "base/vec.h"
#include "sample/level.h"

/* Patches that own fewer samples than this give them away, fewest first, to projections that face them at an angle of
 * at least this cosine: a block costs as much as some ten samples. Beyond the tolerance angle samples lie further apart
 * than they should: dicing adds what is missing then, which for few samples is less than a block. */
static const struct {
	int least;
	float cosine;
} ROUND[] = { { 3, 0.85f }, { 6, 0.85f }, { 9, 0.85f }, { 12, 0.85f }, { 16, 0.85f },
	          { 6, 0.7f },  { 10, 0.7f }, { 6, 0.5f }, { 8, 0.5f } };
#define N_ROUNDS (int)(sizeof ROUND / sizeof *ROUND)
#define MOST_TRIES 8

struct claim {
	struct patch *patch;
	uint64_t bit;
};

/* The nearest corner of the lattice triangle of q that has this surface, in a patch that owns enough. */
static struct claim find_claim(struct level *level, unsigned q, const float p[3], uint32_t surface, int least)
{
	struct sheets *sheets = &level->sheets[q];
	struct claim claim = { NULL, 0 };
	struct lattice_point corner[3];
	float at[3], nearest = 1e30f, n[3], n_found[3];

	level_project(&sheets->projection, p, at);
	level_normal(level, surface, n);
	sheets_triangle(sheets, (double)at[0], (double)at[1], corner);
	for (int i = 0; i < 3; i++) {
		struct sheet_ref ref = sheets_find(sheets, corner[i], at[2], SHEET_STEPS * sheets->projection.spacing);
		float found[3], d[3], distance;

		if (ref.patch == SHEET_NONE || __builtin_popcountll(sheets->patch[ref.patch].owned) < least
		    || (sheets->patch[ref.patch].hidden >> ref.sample & 1) != 0)
			continue;
		level_normal(level, sheets->sample[ref.patch][ref.sample].surface, n_found);
		sheets_position(sheets, ref, found);
		v3f_sub(d, found, p);
		distance = v3f_dot(d, d);
		if (v3f_dot(n, n_found) > 0 && distance < nearest) {
			nearest = distance;
			claim = (struct claim){ &sheets->patch[ref.patch], UINT64_C(1) << ref.sample };
		}
	}
	return claim;
}

static struct claim find_other(struct level *level, unsigned projection, const float p[3], uint32_t surface, int least,
                               float cosine)
{
	float n[3], smooth[3], tried_above = 2;

	level_normal(level, surface, n);
	field_normal(&level->field, p, n, smooth);
	v3f_normalize(smooth, smooth);
	for (int tries = 0; tries < MOST_TRIES; tries++) {
		unsigned best = level->n_projections;
		float most = cosine;
		struct claim claim;

		for (unsigned q = 0; q < level->n_projections; q++) {
			float g = v3f_dot(level->sheets[q].projection.axis[2], smooth);

			if (q != projection && g < tried_above && g > most
			    && v3f_dot(level->sheets[q].projection.axis[2], n) >= 0.4f) {
				most = g;
				best = q;
			}
		}
		if (best == level->n_projections)
			break;
		tried_above = most;
		claim = find_claim(level, best, p, surface, least);
		if (claim.patch != NULL)
			return claim;
	}
	return (struct claim){ NULL, 0 };
}

static void give_away(struct level *level, unsigned projection, uint32_t p, int least, float cosine)
{
	struct sheets *sheets = &level->sheets[projection];
	struct claim claim[PSR_BLOCK_SAMPLES];
	int n = 0;

	for (uint64_t left = sheets->patch[p].owned; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		float position[3];

		sheets_position(sheets, (struct sheet_ref){ p, s }, position);
		claim[n] = find_other(level, projection, position, sheets->sample[p][s].surface, least, cosine);
		if (claim[n++].patch == NULL)
			return;
	}
	for (int i = 0; i < n; i++)
		claim[i].patch->owned |= claim[i].bit;
	sheets->patch[p].owned = 0;
}

/* A sample that is left alone in a block: dicing finds what covers its place. */
static void drop_single(struct level *level)
{
	for (unsigned i = 0; i < level->n_projections; i++)
		for (uint32_t p = 0; p < level->sheets[i].n_patches; p++)
			if (__builtin_popcountll(level->sheets[i].patch[p].owned) == 1)
				level->sheets[i].patch[p].owned = 0;
}

void merge_patches(struct level *level)
{
	for (int round = 0; round < N_ROUNDS; round++) {
		for (unsigned i = 0; i < level->n_projections; i++) {
			for (uint32_t p = 0; p < level->sheets[i].n_patches; p++) {
				int owned = __builtin_popcountll(level->sheets[i].patch[p].owned);

				if (owned > 0 && owned < ROUND[round].least)
					give_away(level, i, p, ROUND[round].least, ROUND[round].cosine);
			}
		}
	}
	drop_single(level);
}
