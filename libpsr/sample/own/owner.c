#include <string.h>
#include "base/vec.h"
#include "sample/level.h"
#include "base/direction.h"
#include "psr/error.h"

/* A projection that sees the face itself at over 50 degrees does not own it, however the surface around it lies. */
#define LEAST_OWNER_COSINE 0.64f

static const float *axis_of(const struct level *level, unsigned projection)
{
	return level->sheets[projection].projection.axis[2];
}

static unsigned best_facing(const struct level *level, const float smooth[3], const float n[3])
{
	unsigned best = 0;
	float most = -1;

	for (unsigned q = 0; q < level->n_projections; q++) {
		float g = v3f_dot(axis_of(level, q), smooth);

		if (g > most && v3f_dot(axis_of(level, q), n) >= LEAST_OWNER_COSINE) {
			most = g;
			best = q;
		}
	}
	return best;
}

unsigned owner_of(const struct level *level, const float p[3], const float n[3])
{
	float smooth[3];

	field_normal(&level->field, p, n, smooth);
	return best_facing(level, smooth, n);
}

static int is_seen(const struct level *level, const struct sheets *sheets, uint32_t patch, unsigned s, int turned)
{
	float p[3], n[3];

	sheets_position(sheets, (struct sheet_ref){ patch, s }, p);
	level_normal(level, sheets->sample[patch][s].surface, n);
	if (turned)
		v3f_scale(n, n, -1);
	return seen_is(&level->seen, p, n);
}

/* By the faces' own normals first: these are what the field is made of, each place once. */
static void mark_faced(int i, void *userdata)
{
	struct level *level = userdata;
	struct sheets *sheets = &level->sheets[i];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		struct patch *patch = &sheets->patch[p];

		patch->owned = 0;
		for (uint64_t left = patch->mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			float n[3];

			level_normal(level, sheets->sample[p][s].surface, n);
			patch->owned |= (uint64_t)(best_facing(level, n, n) == (unsigned)i) << s;
		}
	}
}

static int make_field(struct level *level)
{
	for (unsigned i = 0; i < level->n_projections; i++) {
		const struct sheets *sheets = &level->sheets[i];

		for (uint32_t p = 0; p < sheets->n_patches; p++) {
			for (uint64_t left = sheets->patch[p].owned; left != 0; left &= left - 1) {
				unsigned s = (unsigned)__builtin_ctzll(left);
				float position[3], n[3];

				sheets_position(sheets, (struct sheet_ref){ p, s }, position);
				level_normal(level, sheets->sample[p][s].surface, n);
				if (field_add(&level->field, position, n, 1 / v3f_dot(n, axis_of(level, i))) != PSR_OK)
					return PSR_ERR_MEMORY;
			}
		}
	}
	return PSR_OK;
}

static void mark_owned(int i, void *userdata)
{
	struct level *level = userdata;
	struct sheets *sheets = &level->sheets[i];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		struct patch *patch = &sheets->patch[p];

		patch->owned = 0;
		for (uint64_t left = patch->mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			float position[3], n[3];

			level_normal(level, sheets->sample[p][s].surface, n);
			if (v3f_dot(axis_of(level, (unsigned)i), n) < LEAST_OWNER_COSINE
			    || (i % 2 != 0 && level_is_thin(level, sheets->sample[p][s].surface)))
				continue;
			sheets_position(sheets, (struct sheet_ref){ p, s }, position);
			patch->owned |= (uint64_t)(owner_of(level, position, n) == (unsigned)i) << s;
		}
	}
}

static void note_side(struct level *level, uint32_t surface, int is_seen)
{
	enum side side = (surface & SHEET_BACK) != 0 ? (is_seen ? SIDE_BACK_SEEN : SIDE_BACK_HIDDEN)
	                                             : (is_seen ? SIDE_FRONT_SEEN : SIDE_FRONT_HIDDEN);

	__atomic_fetch_or(&level->sides[surface & ~SHEET_BACK], (uint8_t)side, __ATOMIC_RELAXED);
}

static void mark_seen(int i, void *userdata)
{
	struct level *level = userdata;
	struct sheets *sheets = &level->sheets[i];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		struct patch *patch = &sheets->patch[p];

		patch->seen = patch->first;
		for (uint64_t left = patch->owned & ~patch->first; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);

			patch->seen |= (uint64_t)is_seen(level, sheets, p, s, 0) << s;
		}
		patch->hidden = patch->owned & ~patch->seen;
		for (uint64_t left = patch->mask & (patch->seen | patch->hidden); left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);

			note_side(level, sheets->sample[p][s].surface, (int)(patch->seen >> s & 1));
		}
	}
}

/* A sheet that is seen from both sides is sampled once, on its front; one that is hidden is not sampled; and samples of
 * what is narrow are chosen when places are tested. */
static void drop_hidden(int i, void *userdata)
{
	struct level *level = userdata;
	struct sheets *sheets = &level->sheets[i];
	const uint8_t both = SIDE_FRONT_SEEN | SIDE_BACK_SEEN;

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		struct patch *patch = &sheets->patch[p];

		for (uint64_t left = patch->owned; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			uint32_t surface = sheets->sample[p][s].surface;
			int is_both = (level->sides[surface & ~SHEET_BACK] & both) == both;
			int is_kept = (int)(patch->seen >> s & 1);

			if (is_both)
				is_kept = (surface & SHEET_BACK) == 0 && (is_kept || is_seen(level, sheets, p, s, 1));
			else if (level_is_thin(level, surface))
				is_kept = is_kept || is_seen(level, sheets, p, s, 1);
			if (!is_kept || (level->sides[surface & ~SHEET_BACK] & SIDE_NARROW) != 0)
				patch->owned &= ~(UINT64_C(1) << s);
		}
	}
}

/* What rays met first is seen, here and at coarser levels, though of thin things few views meet anything. */
static int see_first(struct level *level)
{
	for (unsigned i = 0; i < level->n_projections; i++) {
		const struct sheets *sheets = &level->sheets[i];

		for (uint32_t p = 0; p < sheets->n_patches; p++) {
			for (uint64_t left = sheets->patch[p].owned & sheets->patch[p].first; left != 0; left &= left - 1) {
				unsigned s = (unsigned)__builtin_ctzll(left);
				float position[3], n[3];

				sheets_position(sheets, (struct sheet_ref){ p, s }, position);
				level_normal(level, sheets->sample[p][s].surface, n);
				if (seen_add(&level->seen, position, n) != PSR_OK)
					return PSR_ERR_MEMORY;
			}
		}
	}
	return PSR_OK;
}

int owner_mark(struct level *level)
{
	int n = (int)level->n_projections;

	psr_pool_for(level->pool, n, mark_faced, level);
	if (make_field(level) != PSR_OK)
		return PSR_ERR_MEMORY;
	psr_pool_for(level->pool, n, mark_owned, level);
	if (see_first(level) != PSR_OK)
		return PSR_ERR_MEMORY;
	psr_pool_for(level->pool, n, mark_seen, level);
	psr_pool_for(level->pool, n, drop_hidden, level);
	return PSR_OK;
}
