#include "base/mem.h"
#include "base/vec.h"
#include "owner.h"
#include "psr/error.h"
#include "sample/visible/sides.h"

/* A projection over 50 degrees off the face's own normal does not own it. */
#define LEAST_OWNER_COSINE 0.64f

struct job {
	struct ownership *ownership;
	const struct owner_finds *finds;
	const struct sampling *sampling;
	const struct sheets *sheets;
};

static unsigned best_facing(const struct sampling *sampling, const float smooth[3], const float n[3])
{
	unsigned best = 0;
	float most = -1;

	for (unsigned q = 0; q < N_PROJECTIONS; q++) {
		const float *axis = sampling->projection[q].axis[2];
		float g = v3f_dot(axis, smooth);

		if (g > most && v3f_dot(axis, n) >= LEAST_OWNER_COSINE) {
			most = g;
			best = q;
		}
	}
	return best;
}

unsigned owner_of(const struct sampling *sampling, const struct field *field, const float p[3], const float n[3])
{
	float smooth[3];

	field_normal(field, p, n, smooth);
	return best_facing(sampling, smooth, n);
}

/* Finds position and normal of a hit. */
static void locate(const struct job *job, int i, uint32_t patch, unsigned s, float p[3], float n[3])
{
	sheets_position(&job->sheets[i], (struct sheet_ref){ patch, s }, p);
	sampling_normal(job->sampling, job->sheets[i].sample[patch][s].surface, n);
}

static int is_seen(const struct job *job, int i, uint32_t patch, unsigned s, int turned)
{
	float p[3], n[3];

	locate(job, i, patch, s, p, n);
	if (turned)
		v3f_scale(n, n, -1);
	return turned ? visible_set_has(job->finds->visible, p, n)
	              : visible_set_shows(job->finds->visible, job->sampling->scene, p, n);
}

/* Gives each place at first to the projection that faces the face's own normal best: the field is made of these places,
 * each once. */
static void mark_faced(int i, void *userdata)
{
	const struct job *job = userdata;
	const struct sheets *sheets = &job->sheets[i];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		uint64_t mask = 0;

		for (uint64_t left = sheets->patch[p].mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			float n[3];

			sampling_normal(job->sampling, sheets->sample[p][s].surface, n);
			mask |= (uint64_t)(best_facing(job->sampling, n, n) == (unsigned)i) << s;
		}
		job->ownership->patch[i][p] = (struct owned){ mask, 0 };
	}
}

static int make_field(const struct job *job)
{
	for (int i = 0; i < N_PROJECTIONS; i++) {
		for (uint32_t p = 0; p < job->sheets[i].n_patches; p++) {
			for (uint64_t left = job->ownership->patch[i][p].mask; left != 0; left &= left - 1) {
				float position[3], n[3];

				locate(job, i, p, (unsigned)__builtin_ctzll(left), position, n);
				if (field_add(job->finds->field, position, n, 1 / v3f_dot(n, job->sampling->projection[i].axis[2]))
				    != PSR_OK)
					return PSR_ERR_MEMORY;
			}
		}
	}
	return PSR_OK;
}

static void mark_owned(int i, void *userdata)
{
	const struct job *job = userdata;
	const struct sheets *sheets = &job->sheets[i];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		uint64_t mask = 0;

		for (uint64_t left = sheets->patch[p].mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			uint32_t surface = sheets->sample[p][s].surface;
			float position[3], n[3];

			sampling_normal(job->sampling, surface, n);
			if (v3f_dot(job->sampling->projection[i].axis[2], n) < LEAST_OWNER_COSINE
			    || (i % 2 != 0 && sampling_is_thin(job->sampling, surface)))
				continue;
			sheets_position(sheets, (struct sheet_ref){ p, s }, position);
			mask |= (uint64_t)(owner_of(job->sampling, job->finds->field, position, n) == (unsigned)i) << s;
		}
		job->ownership->patch[i][p].mask = mask;
	}
}

static void mark_hidden(int i, void *userdata)
{
	const struct job *job = userdata;
	const struct sheets *sheets = &job->sheets[i];

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		struct owned *owned = &job->ownership->patch[i][p];
		uint64_t first = sheets->patch[p].first;

		for (uint64_t left = owned->mask & ~first; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);

			owned->hidden |= (uint64_t)!is_seen(job, i, p, s, 0) << s;
		}
		for (uint64_t left = sheets->patch[p].mask & (first | owned->mask); left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);

			sides_note(job->finds->sides, sheets->sample[p][s].surface, !(owned->hidden >> s & 1));
		}
	}
}

/* A sheet seen from both sides is sampled once, on its front, a hidden sheet not at all. Mending chooses the samples of
 * narrow primitives. */
static void drop_hidden(int i, void *userdata)
{
	const struct job *job = userdata;
	const struct sheets *sheets = &job->sheets[i];
	const struct sampling *sampling = job->sampling;

	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		struct owned *owned = &job->ownership->patch[i][p];

		for (uint64_t left = owned->mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			uint32_t surface = sheets->sample[p][s].surface, prim = surface & ~SURFACE_BACK;
			int is_kept = !(owned->hidden >> s & 1);

			if ((job->finds->sides[prim] & SIDES_SEEN) == SIDES_SEEN)
				is_kept = surface == prim && (is_kept || is_seen(job, i, p, s, 1));
			else if (sampling_is_thin(sampling, surface))
				is_kept = is_kept || is_seen(job, i, p, s, 1);
			if (!is_kept || (sampling->thin != NULL && (sampling->thin[prim] & THIN_NARROW) != 0))
				owned->mask &= ~(UINT64_C(1) << s);
		}
	}
}

/* Records first hits as seen, here and at coarser levels: few views meet thin things. */
static int see_first(const struct job *job)
{
	for (int i = 0; i < N_PROJECTIONS; i++) {
		for (uint32_t p = 0; p < job->sheets[i].n_patches; p++) {
			uint64_t left = job->ownership->patch[i][p].mask & job->sheets[i].patch[p].first;

			for (; left != 0; left &= left - 1) {
				float position[3], n[3];

				locate(job, i, p, (unsigned)__builtin_ctzll(left), position, n);
				if (visible_set_add(job->finds->visible, position, n) != PSR_OK)
					return PSR_ERR_MEMORY;
			}
		}
	}
	return PSR_OK;
}

int owner_mark(struct ownership *ownership, const struct owner_finds *finds, const struct sampling *sampling,
               const struct sheets *sheets)
{
	struct job job = { ownership, finds, sampling, sheets };

	*ownership = (struct ownership){ { NULL } };
	for (int i = 0; i < N_PROJECTIONS; i++) {
		ownership->patch[i] = psr_alloc_array(sheets[i].n_patches, sizeof **ownership->patch);
		if (ownership->patch[i] == NULL)
			return PSR_ERR_MEMORY;
	}
	psr_pool_for(sampling->pool, N_PROJECTIONS, mark_faced, &job);
	if (make_field(&job) != PSR_OK)
		return PSR_ERR_MEMORY;
	psr_pool_for(sampling->pool, N_PROJECTIONS, mark_owned, &job);
	if (see_first(&job) != PSR_OK)
		return PSR_ERR_MEMORY;
	psr_pool_for(sampling->pool, N_PROJECTIONS, mark_hidden, &job);
	psr_pool_for(sampling->pool, N_PROJECTIONS, drop_hidden, &job);
	return PSR_OK;
}

void ownership_fini(struct ownership *ownership)
{
	for (int i = 0; i < N_PROJECTIONS; i++)
		psr_free(ownership->patch[i]);
	*ownership = (struct ownership){ { NULL } };
}
