/* The octree of a model, and models made of one. */
#ifndef PSR_MODEL_TREE_H
#define PSR_MODEL_TREE_H

#include "octree/pack.h"
#include "psr/model.h"

struct psr_blocks;

/* Returns NULL if the model has no octree. The tree's cube is in inner coordinates. Checked wherever a model is made or
 * opened (docs/format.md has every rule): what octree_check() says, all attributes in their ranges, the cube within 1024
 * of the origin, at most 2^32 leaves. It is only read, and the model owns it: the arrays are not octree_destroy()'s. */
const struct octree *psr_model_octree(const struct psr_model *model);

/* Returns whether the file that the model was opened from has a packed octree; *shares: of how many bytes. */
int psr_model_octree_shares(const struct psr_model *model, struct octree_shares *shares);

/* As psr_model_create(), of an octree whose cube is in inner coordinates. Copies the tree. */
int psr_model_create_octree(struct psr_model **out, const struct psr_model_info *info, const struct octree *tree,
                            const struct psr_presets *presets, struct psr_error *err);

/* The same of all that a model can have, of one object; one part at least is not NULL. Points are in inner
 * coordinates. */
struct dpoint_set;
struct psr_model_parts {
	const struct psr_blocks *blocks;
	const struct octree *tree;
	const struct dpoint_set *points;
};
int psr_model_create_of(struct psr_model **out, const struct psr_model_info *info, const struct psr_model_parts *parts,
                        const struct psr_presets *presets, struct psr_error *err);

/* The same of blocks and an octree; either may be NULL, but not both. */
int psr_model_create_both(struct psr_model **out, const struct psr_model_info *info, const struct psr_blocks *blocks,
                          const struct octree *tree, const struct psr_presets *presets, struct psr_error *err);

/* Fills in what a tree in units of its source says of a model: origin, scale, box, spacing (the greatest distance of
 * leaves that touch), resolution; up is +y, the rest 0 and "". All leaves are in the unit sphere. */
void psr_octree_info(struct psr_model_info *info, const struct octree *tree);

/* Makes a copy with the cube in inner coordinates; its arrays stay the tree's. */
void psr_octree_to_inner(struct octree *inner, const struct octree *tree, const struct psr_model_info *info);

#endif
