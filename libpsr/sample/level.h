/* One level of a model under construction: the object, sampled at one resolution, and what of it is kept.
 *
 * Selection of blocks goes beyond [G] 5.2. There, blocks are added wherever projections, taken one after the other,
 * still show a hole. Here every place of the surface is owned by the projection that faces it best; a block keeps what
 * its projection owns; and then places all over the surface are tested one by one, and what they lack is added. A place
 * is covered when it lies in a lattice triangle of kept samples with sides of at most a pixel ([G] 4.3: some of its
 * corners is in whichever pixel is centred there), or within half a pixel of a kept sample. */
#ifndef PSR_SAMPLE_LEVEL_H
#define PSR_SAMPLE_LEVEL_H

#include <stdint.h>
#include "sample/own/kept.h"
#include "sample/own/field.h"
#include "sample/project/projection.h"
#include "model/blocks.h"
#include "psr/mesh.h"
#include "base/pool.h"
#include "ray/ray.h"
#include "sample/visible/visible_set.h"
#include "sample/project/sheet.h"
#include "surface/surface.h"
#include "surface/texture.h"

/* What is known of a primitive's sides. SIDE_THIN: 0.6 pixels behind all of it, at most, is another face of the same
 * plain material, as of needles and leaves. A sample there stands for the other side, too. SIDE_NARROW: it is thin, and
 * narrower than half a pixel. SIDE_BEHIND: it is thin and not narrow, and its places need no test, as those on its
 * other side have one. */
enum side { SIDE_FRONT_SEEN = 1, SIDE_BACK_SEEN = 2, SIDE_FRONT_HIDDEN = 4, SIDE_BACK_HIDDEN = 8, SIDE_THIN = 16,
            SIDE_NARROW = 32, SIDE_BEHIND = 64 };

struct level {
	const struct psr_mesh *mesh;
	const struct ray_scene *scene;
	const struct surface *surface;
	struct psr_pool *pool;
	double ds;                /* a pixel at this level's resolution, inner units */
	float cosine;             /* of the tolerance angle */
	unsigned n_projections;
	struct sheets *sheets;    /* of each projection */
	struct field field;
	struct seen seen;
	struct cover cover;
	uint8_t *sides;           /* enum side, by primitive */
	const struct cover *finer; /* of the level with half of this one's ds, from which attributes are blended; or NULL */
	const struct seen *finer_seen; /* of the same level, */
	const uint8_t *finer_sides;    /* and: what is thin there is thin here */
	uint64_t n_rays, n_patches;
	double seconds_rays;
};

struct level_ref {
	unsigned projection;
	struct sheet_ref at;
};

/* sample/thin/mark.c: finds what is thin, of a level that will be traced along these. */
void thin_mark(struct level *level, const struct psr_projection *projection);

/* sample/own/owner.c: which projection owns a place that faces n. */
unsigned owner_of(const struct level *level, const float p[3], const float n[3]);

/* Sets `seen` and `owned` of all patches, after tracing. MEMORY. */
int owner_mark(struct level *level);

/* sample/own/merge.c: gives what patches that own less than a quarter of a block own to others that see it as well; what is
 * then alone in its patch is owned no more. */
void merge_patches(struct level *level);

/* sample/own/keep.c: whether a sample of a face of this normal counts for those who look at its back, too: a thin sheet's does. */
int level_is_two_sided(const struct level *level, uint32_t prim, const float p[3], const float n[3]);

/* Keeps what is owned, or a single sample. MEMORY. */
int keep_owned(struct level *level);
int keep_sample(struct level *level, struct level_ref ref);
int keep_samples(struct level *level, const struct level_ref *ref, uint32_t n); /* none of them is kept yet, or only
                                                                                 * marked */

/* Marks a sample as kept, which keep_samples() is to follow. */
void keep_mark(struct level *level, const struct level_ref *ref);

/* After more was seen: which samples are of thin sheets. */
void keep_look_again(struct level *level);

struct surface_spot {
	float p[3], n[3];  /* n: unit, on the side that counts */
	uint32_t surface;  /* as in struct sheet_sample */
};

/* A kept sample within as many pixels is in every pixel that has the place in its middle. */
#define LEVEL_NEAR 0.5

/* sample/mend/dice.c: tests places all over the surface, a third of a pixel apart, and adds what they lack; others in each round, 0
 * or greater. MEMORY. */
int dice_surface(struct level *level, int round);

/* Adds samples so that a place is covered. MEMORY. */
int dice_cover(struct level *level, const struct surface_spot *spot);

/* level.c: traces all projections, of spacing projection[i].spacing, and keeps an adequate sampling. on_progress is
 * called with 0..n_projections / 2 + 4 done; may be NULL. MEMORY; level_fini() either way. */
int level_make(struct level *level, const struct psr_projection *projection,
               void (*on_progress)(unsigned done, unsigned total, void *userdata), void *userdata);
void level_fini(struct level *level);

/* The first part of that: everything is traced and owned, and nothing kept. MEMORY; level_fini() either way. */
int level_own(struct level *level, const struct psr_projection *projection);

/* Normal of a hit on the side that was met. */
static inline void level_normal(const struct level *level, uint32_t surface, float n[3])
{
	const float *front = ray_scene_normal(level->scene, surface & ~SHEET_BACK);
	float sign = (surface & SHEET_BACK) != 0 ? -1 : 1;

	for (int k = 0; k < 3; k++)
		n[k] = sign * front[k];
}

static inline const struct psr_material *level_material(const struct level *level, uint32_t prim)
{
	const struct psr_mesh *mesh = level->mesh;

	return &mesh->material[texture_material(mesh, prim)];
}

static inline int level_is_thin(const struct level *level, uint32_t surface)
{
	return (level->sides[surface & ~SHEET_BACK] & SIDE_THIN) != 0;
}

/* Whether samples of it may count for both sides, so that they go into patches of their own. */
static inline int level_is_sheet(const struct level *level, uint32_t surface)
{
	return level_is_thin(level, surface) || level_material(level, surface & ~SHEET_BACK)->two_sided != 0;
}

/* Projection space. */
static inline void level_project(const struct psr_projection *projection, const float p[3], float out[3])
{
	for (int k = 0; k < 3; k++)
		out[k] = projection->axis[k][0] * p[0] + projection->axis[k][1] * p[1] + projection->axis[k][2] * p[2];
}

#endif
