/* Visibility masks ([G] 6.3), and the samples that culling by them and by cones loses. */
#ifndef PSR_SAMPLE_PACK_VISIBILITY_MASK_H
#define PSR_SAMPLE_PACK_VISIBILITY_MASK_H

#include <stddef.h>
#include <stdint.h>
#include "base/direction.h"
#include "base/pool.h"
#include "model/blocks.h"
#include "ray/ray.h"

/* Masks of all blocks of all levels: bit t is set iff one of the block's samples is seen from some direction in
 * triangle t (level 2 of base/direction.h; bit t & 63 of word t >> 6), from outside of the convex hull of the object.
 *
 * As in [G] the blocks of a level are drawn orthographically, at about a sample a pixel, without samples that face
 * away. The 1,026 directions are the corners of the triangles of level 4, 15 a triangle: a normal that faces any
 * direction of a triangle faces one of its corners. Only occlusion is left to chance: a sample counts as seen unless
 * it is behind the farthest of the 25 pixels around it.
 *
 * `blocks` needs all arrays but cones and masks. The same masks whatever the number of threads. MEMORY. */
int visibility_mask_make(const struct psr_blocks *blocks, struct psr_pool *pool, uint64_t (*mask)[2]);

/* Makes masks with the triangles of any level, 0..3, from directions two levels finer: `words` words a block, enough
 * for 8 * 4^level bits. */
int visibility_mask_make_at(const struct psr_blocks *blocks, int level, size_t words, struct psr_pool *pool,
                        uint64_t *mask);

/* Returns whether all bits of all masks are set: such masks are not worth storing. */
int visibility_mask_is_full(uint32_t n_blocks, const uint64_t (*mask)[2]);

/* Measures the loss. Level 0 is drawn without culling from random places outside of the unit sphere, half of them
 * infinitely far away, the nearest sample a pixel. Of n_trials pixels with a sample, *n_lost have one whose block its
 * cone or mask would cull although a ray from the eye reaches it. (A sample that no ray reaches is seen through a hole
 * between others.) Masks are looked up in the direction from the sample to the eye: a renderer's screen masks hold
 * that and more. `scene` is of the object, in inner coordinates. Cones and masks may be NULL. The same count whatever
 * the number of threads. MEMORY. */
int visibility_mask_lost(const struct psr_blocks *blocks, const struct ray_scene *scene, uint64_t n_trials,
                    struct psr_pool *pool, uint64_t *n_lost);

#endif
