/* Visibility masks ([G] 6.3), and what culling by them and by cones costs. */
#ifndef PSR_SAMPLE_PACK_VISIBILITY_MASK_H
#define PSR_SAMPLE_PACK_VISIBILITY_MASK_H

#include <stddef.h>
#include <stdint.h>
#include "base/direction.h"
#include "model/blocks.h"
#include "base/pool.h"
#include "ray/ray.h"

/* Masks of all blocks, whatever their level: bit t of a block is set iff one of its samples is seen from some direction
 * in triangle t (level 2 of psr/direction.h; bit t & 63 of word t >> 6), from outside of the convex hull of the object.
 *
 * As in [G] the blocks of a level are drawn orthographically, at about a sample a pixel, without those samples that
 * face away, as the renderer leaves them out. The 1,026 directions are the corners of the triangles of level 4: 15 a
 * triangle, those on its sides being shared with its neighbours. Since a normal that faces any direction of a triangle
 * faces one of its corners, only occlusion is left to chance; and there a sample counts as seen unless it is behind the
 * farthest of the 25 pixels around it. (Four times the directions set 2 in 100 more bits; OR-ing whole neighbouring
 * triangles in loses a third of the culling, and neither makes a difference to visibility_lost.)
 *
 * `blocks` needs all arrays but cones and masks. The same masks whatever the number of threads. MEMORY. */
int visibility_masks(const struct psr_blocks *blocks, struct psr_pool *pool, uint64_t (*mask)[2]);

/* The same with the triangles of any level, 0..3, from directions two levels finer: `words` words a block, enough for
 * 8 * 4^level bits. */
int visibility_masks_at(const struct psr_blocks *blocks, int level, size_t words, struct psr_pool *pool,
                        uint64_t *mask);

/* Whether all bits of all masks are set: then they are not worth storing. */
int visibility_is_full(uint32_t n_blocks, const uint64_t (*mask)[2]);

/* What is lost by culling. Level 0 is drawn from random places outside of the unit sphere, half of them infinitely far
 * away, a sample a pixel for what is nearest, and nothing is culled. Of n_trials pixels that hold a sample *n_lost hold
 * one whose block the cone or the mask would cull although a ray from the eye reaches it (else it is
 * seen through a hole between samples). The mask is looked up in the very direction from the sample to the eye, where
 * a renderer's screen masks hold that and more. `scene` is of the object, in inner coordinates. Cones and masks may be
 * NULL. The same count whatever the number of threads. MEMORY. */
int visibility_lost(const struct psr_blocks *blocks, const struct ray_scene *scene, uint64_t n_trials,
                    struct psr_pool *pool, uint64_t *n_lost);

#endif
