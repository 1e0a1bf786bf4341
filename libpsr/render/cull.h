/* Cull: blocks in view, one level of each group of clusters, sorted into tiles ([G] 6). */
#ifndef PSR_RENDER_CULL_H
#define PSR_RENDER_CULL_H

#include "bins.h"
#include "ewa.h"
#include "simd/discs.h"

/* Fills the bins. Completes the plan: what shading needs for the blocks in view. MEMORY, LIMIT, CANCELLED. */
int cull_blocks(struct bins *bins, const struct simd *simd, struct plan *plan, struct psr_pool *pool,
                struct psr_report *report);

/* ---- for the files of the cull ---- */

#define CULL_MOST_CHUNK 2048 /* blocks, or chosen cubes, of a chunk */

/* Blocks first_block .. first_block + n_blocks - 1, of cubes of one level the chosen ones among these; first_cluster
 * holds the first, or comes before the cluster that does. n_drawn: blocks or cubes; n_hits: of runs, entries. */
struct cull_chunk {
	uint32_t instance, first_cluster, first_block, n_blocks, first_hit, n_hits, n_drawn;
	uint32_t levels, n_tested, n_clamped, n_masked, n_mixed;
	uint8_t flags, traits; /* of all hits, OR-ed */
	uint64_t n_samples;
	float place_error; /* greatest of its blocks, in pixels */
};

/* A chunk whose blocks are being tested, and where its results go. */
struct cull_counting {
	const struct bins *bins;
	const struct simd *simd;
	const struct plan *plan;
	struct cull_chunk *chunk;
	uint32_t *count;
	struct cull_hit *hit; /* the next one */
	uint64_t *cubes;      /* likewise; NULL in plans without runs */
};

static inline void cull_count_tiles(const struct cull_counting *to, const struct cull_hit *hit)
{
	const uint32_t stride = to->plan->tiles_x * BIN_KINDS, wide = (uint32_t)(hit->tile_x1 - hit->tile_x0) * BIN_KINDS;
	uint32_t *count = to->count + hit->tile_y0 * stride + hit->tile_x0 * BIN_KINDS + hit->kind;

	if (hit->tile_x0 == hit->tile_x1 && hit->tile_y0 == hit->tile_y1) { /* most often */
		count[0]++;
		return;
	}
	for (const uint32_t *end = count + (hit->tile_y1 - hit->tile_y0) * stride; count <= end; count += stride)
		for (uint32_t x = 0; x <= wide; x += BIN_KINDS)
			count[x]++;
}

/* Tests the cubes of a chunk, by runs. */
void cull_count_runs(struct cull_counting *to);

struct cull_group {
	uint8_t level; /* of the cluster that is drawn */
	uint8_t fits;
	uint8_t is_out; /* of cubes: nothing of it is in view */
	uint8_t n_alike; /* of cubes: so many groups from this one on are alike; 1 if that is not known */
};

static inline int cull_is_chosen(const struct bins *bins, const struct plan_instance *in, const struct psr_cluster *k)
{
	return bins->group[in->first_group + k->group].level == k->level;
}

/* Makes the chunks, given levels. MEMORY, CANCELLED. */
int cull_make_chunks(struct bins *bins, const struct plan *plan, uint32_t *n_chunks);

/* Counts ones; __builtin_popcountll is a library call where the compiler cannot assume the instruction. */
static inline uint32_t cull_count_bits(uint64_t word)
{
	word -= word >> 1 & UINT64_C(0x5555555555555555);
	word = (word & UINT64_C(0x3333333333333333)) + (word >> 2 & UINT64_C(0x3333333333333333));
	word = (word + (word >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f);
	return (uint32_t)(word * UINT64_C(0x0101010101010101) >> 56);
}

/* Of a block or cube. */
static inline uint32_t cull_n_samples(const struct plan_instance *in, uint32_t block)
{
	return in->cull.cubes != NULL ? psr_cubes_n_leaves(in->cull.cubes, block)
	                              : cull_count_bits(in->cull.blocks->mask[block]);
}

/* How many of the blocks first .. end - 1 of a cluster the kernel takes next: of cubes, those of one run. */
static inline uint32_t cull_next_batch(const struct plan_instance *in, uint32_t first, uint32_t end)
{
	const struct psr_cubes *cubes = in->cull.cubes;
	uint32_t most = CULL_BATCH;

	if (cubes != NULL)
		most = CUBES_RUN - (first - psr_cubes_level(cubes, first)->first) % CUBES_RUN;
	return end - first < most ? end - first : most;
}

/* A sphere of inner coordinates, or a cluster's, in camera space. */
struct cull_sphere {
	float c[3], r;
};
struct cull_sphere cull_view_sphere(const struct plan_instance *in, const float center[3], float radius);
struct cull_sphere cull_view_cluster(const struct plan_instance *in, const struct psr_cluster *k);

/* Returns 0 if nothing within the sphere can draw: it is outside of the picture, grown by the guard band of the
 * coarsest depth buffer. */
int cull_sees_sphere(const struct plan *plan, const struct cull_sphere *sphere);
/* Returns whether all of the sphere is in the picture. */
int cull_holds_sphere(const struct plan *plan, const struct cull_sphere *sphere);
/* Finds what pixels a sphere may cover, as coordinates: bound[0] of x, least and greatest. It must reach beyond
 * near_z. */
void cull_bound_sphere(float bound[2][2], const struct plan *plan, const struct cull_sphere *sphere);
/* Finds how the leaves of a run face, MIXED if that is not known; flags: those of one of its cubes, all of which are of
 * one side or of two. */
enum cull_facing { CULL_AWAY, CULL_MIXED, CULL_FACES_EYE };
enum cull_facing cull_run_faces(const struct plan_instance *in, const struct psr_cube_bound *bound, uint8_t flags);
/* Returns 0 if nothing of the run that holds this cube can draw: it is outside of the picture, or faces away. */
int cull_sees_run(const struct plan *plan, const struct plan_instance *in, uint32_t cube);

/* Chooses of each group of clusters the coarsest level whose level_spacing is at most a pixel, or the settings'
 * spacing, where its blocks are nearest. Blocks of such a level need no depth buffer but the picture's, cubes one of
 * 2x2 pixels at most. The finest level if none fits.
 * CANCELLED. */
int cull_choose_levels(struct bins *bins, const struct plan *plan, struct psr_pool *pool);

/* How far what a block draws may be from the surface, in pixels: a sample from the surface, and what it draws from the
 * sample. apart, depth_error: as the kernel has them. */
static inline float cull_place_error(const struct plan *plan, const struct plan_instance *in, unsigned traits,
                                     float apart, float depth_error)
{
	const float half = 0.70710678f;
	const float off =
		(float)(traits & PSR_BLOCK_OLD ? PSR_SAMPLE_OLD_OFF : traits & PSR_BLOCK_OFF ? PSR_SAMPLE_FAR_OFF : PSR_SAMPLE_OFF);
	float drawn = half;

	if (plan->with_ewa && in->cull.cubes != NULL)
		drawn = EWA_REACH * apart + EWA_REACH_PIXELS;
	else if (plan->with_splats)
		drawn = DISC_RADIUS * apart > half ? DISC_RADIUS * apart : half;
	else if (traits & PSR_BLOCK_THIN && apart >= 2)
		drawn = half * (apart + 1);
	return drawn + off * apart + depth_error;
}

/* Visibility masks of the screen's regions, for one instance ([G] 6.3): one mask for each of the 10 x 10 ranges of
 * regions that a block can lie in, in place of the smallest tree node that holds the block. */
struct cull_masks {
	uint64_t range[SCREEN_RANGES * SCREEN_RANGES][2];
};
void cull_masks_make(struct cull_masks *masks, const struct plan *plan, const struct plan_instance *in);

/* Whether a block is invisible from the regions of a range. */
static inline int cull_by_mask(const struct cull_masks *masks, const struct psr_blocks *b, uint32_t block,
                               uint32_t range)
{
	const uint64_t *own = b->visibility_mask[psr_blocks_visibility(b, block)], *seen = masks->range[range];

	return !((own[0] & seen[0]) | (own[1] & seen[1]));
}

#endif
