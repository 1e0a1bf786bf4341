/* An octree as what is drawn: cubes of 4x4x4 leaves, of the tree and of coarser ones that end higher. */
#ifndef PSR_MODEL_CUBES_H
#define PSR_MODEL_CUBES_H

#include <string.h>
#include "model/blocks.h"
#include "octree/octree.h"
#include "psr/tint.h"

#define CUBES_MOST_LEVELS 5 /* those of a cluster: one cube of the coarsest covers 64x64x64 leaves */
#define CUBES_RUN 64        /* cubes that store their codes' and leaves' places relative to those of the first one */
#define CUBES_DIAGONAL 1.7320508075688772 /* a leaf's, in edges */
/* From a cube's middle to its farthest leaf's, that leaf's offset, and half the distance of neighbours; in edges. */
#define CUBES_RADIUS (CUBES_DIAGONAL * (1.5 + 0.375 + 0.5))
/* Where a pixel is at least so many edges of leaves wide, each pixel of a surface has the middle of one that the
 * surface meets: a plane's leaves at 45 degrees to the picture's rows need so many, and no plane or view has been found
 * that needs more (decision 0106). */
#define CUBES_SPACING 1.4142135623730951
/* The same for choosing levels, where depth buffers close what stays open between samples: a plane along an axis meets
 * one leaf an edge squared, every other plane more, and so dense is a block's lattice of this spacing. sqrt(2/sqrt(3)).
 */
#define CUBES_LEVEL_SPACING 1.0745699318235418
#define CUBES_PLACE_BITS 18 /* of a coordinate, in edges of a cube */
#define CUBES_GRAY UINT64_C(0xcbcbcb) /* of leaves without colour, as of all such surfaces: 0.6 in linear light */

struct psr_cube_run {
	uint32_t code, leaf;
};

/* Of a run's cubes: a sphere around their leaves, inner units; a cone that holds their cones, as a block's. */
struct psr_cube_bound {
	float center[3], radius;
	int8_t axis[3];
	uint8_t sine; /* PSR_CONE_ANY without cones */
};

#define CUBES_BUNCH 64 /* groups of clusters that follow each other */
/* Holds the spheres of a bunch's clusters of all levels, inner units. */
struct psr_cube_bunch {
	float center[3], radius;
};

struct psr_cube_level {
	const struct octree *tree; /* of level 0 the model's; each further one has a level less, and averaged attributes */
	uint32_t first, n;         /* its cubes */
	double edge;               /* of a leaf, inner units */
	const struct psr_cube_run *run;
	const struct psr_cube_bound *bound; /* one a run */
};

/* Read together: in one line of the cache, most often. */
struct psr_cube {
	uint32_t place[2];   /* as 64 bits: CUBES_PLACE_BITS a coordinate, x lowest; then the level */
	uint16_t code, leaf; /* less those of the cube's run */
};

/* Cubes are numbered by level, the finest first, then in Morton order. Cubes of one cluster follow each other. A
 * cluster is a node of at most 64x64x64 leaves of level 0; it has a cluster at each level, which are a group. Clusters
 * are numbered by level, then by group. */
struct psr_cubes {
	/* What culling reads. Has clusters, flags, and where the tree has normals of one side, cones; levels are those of
	 * blocks. Has no projections, spheres, masks, depths or attributes. The level in a cube's flags says how wide its
	 * leaves are drawn; where a cloud is sparse, it is above that of the cube. */
	struct psr_blocks groups;
	struct psr_cube_level level[CUBES_MOST_LEVELS];
	const struct psr_cube *cube;
	const struct psr_cube_bunch *bunch; /* one for CUBES_BUNCH groups */
	struct psr_scan scan;
	uint64_t n_bytes;
};

/* Makes the cubes of a valid tree, which must outlive them. Threads of the pool, which may be NULL, share the work.
 * LIMIT: more than 2^26 cubes, or 2^32 codes or leaves; MEMORY. */
int psr_cubes_create(struct psr_cubes **out, const struct octree *tree, struct psr_pool *pool, struct psr_error *err);
void psr_cubes_destroy(struct psr_cubes *cubes); /* NULL is fine */

/* Estimates psr_cubes' n_bytes by a tree's counts alone, an eighth off at most on surfaces, clouds and dust. leaf: bytes of
 * the attributes of one. */
uint64_t psr_cubes_guess(const struct octree *tree, unsigned leaf);

/* Makes the cubes of a model's octree, if it has one and they are not there yet: programs that draw nothing have no use for
 * them. psr_scene_validate(), and so a frame, does it; who does it before does not wait there. Any number of threads may
 * call it. LIMIT, MEMORY. */
int psr_model_make_cubes(const struct psr_model *model, struct psr_error *err);

/* Returns NULL if the model has no octree, or its cubes are not made yet. */
const struct psr_cubes *psr_model_cubes(const struct psr_model *model);

/* Returns whether leaves are seen from where their normals point only. */
static inline int psr_octree_is_one_sided(const struct octree *tree)
{
	return tree->is_one_sided && tree->normal != NULL;
}

static inline const struct psr_cube_level *psr_cubes_level(const struct psr_cubes *cubes, uint32_t cube)
{
	return &cubes->level[cubes->cube[cube].place[1] >> (3 * CUBES_PLACE_BITS - 32)];
}

/* Returns the place of a cube's code in its level's tree, and its first leaf. */
static inline uint32_t psr_cubes_code(const struct psr_cubes *cubes, const struct psr_cube_level *level, uint32_t cube)
{
	return level->run[(cube - level->first) / CUBES_RUN].code + cubes->cube[cube].code;
}

static inline uint32_t psr_cubes_leaf(const struct psr_cubes *cubes, const struct psr_cube_level *level, uint32_t cube)
{
	return level->run[(cube - level->first) / CUBES_RUN].leaf + cubes->cube[cube].leaf;
}

static inline uint32_t psr_cubes_n_leaves(const struct psr_cubes *cubes, uint32_t cube)
{
	const struct psr_cube_level *level = psr_cubes_level(cubes, cube);
	const uint32_t first = psr_cubes_leaf(cubes, level, cube);

	return (cube + 1 < level->first + level->n ? psr_cubes_leaf(cubes, level, cube + 1) : (uint32_t)level->tree->n_leaves)
	       - first;
}

/* Computes the middle of a cube, in inner units. */
static inline void psr_cubes_center(const struct psr_cubes *cubes, const struct psr_cube_level *level, uint32_t cube,
                                    double center[3])
{
	const uint32_t *words = cubes->cube[cube].place;
	const uint64_t place = words[0] | (uint64_t)words[1] << 32, most = (1u << CUBES_PLACE_BITS) - 1;

	for (int a = 0; a < 3; a++)
		center[a] = level->tree->low[a]
		            + (double)(int32_t)(4 * (place >> CUBES_PLACE_BITS * a & most) + 2) * level->edge;
}

/* Reads the codes of a cube's children, the first one lowest; those behind it are undefined. code: the cube's. */
static inline uint64_t psr_cubes_children(const struct octree *tree, uint32_t code)
{
	const uint64_t left = tree->n_codes - 1 - code;
	uint64_t children = 0;

	if (left >= sizeof children)
		memcpy(&children, tree->code + code + 1, sizeof children);
	else
		memcpy(&children, tree->code + code + 1, left);
	return children;
}

/* Returns how many leaves of a cube come before this lane: lane 8 i + j is octant j of its octant i. */
static inline uint32_t psr_cubes_rank(const struct octree *tree, uint32_t code, uint32_t lane)
{
	const unsigned before = (unsigned)__builtin_popcount(tree->code[code] & ((1u << (lane >> 3)) - 1));
	const uint64_t below = psr_cubes_children(tree, code) & ((UINT64_C(1) << (8 * before + (lane & 7))) - 1);

	return (uint32_t)__builtin_popcountll(below);
}

/* Builds a leaf's attributes in the form of a block's sample. Without a normal it is unlit. */
static inline uint64_t psr_cubes_attr(const struct octree *tree, uint32_t leaf)
{
	const uint32_t material = tree->normal != NULL ? octree_material(tree, leaf) : OCTREE_UNLIT;
	uint64_t attr = material != OCTREE_UNLIT ? (uint64_t)material << 40 : 1u << 15;
	const uint8_t *color = tree->color != NULL ? tree->color[leaf] : NULL;

	if (tree->normal != NULL)
		attr |= tree->normal[leaf];
	attr |= color != NULL ? (uint64_t)color[0] << 16 | (uint64_t)color[1] << 24 | (uint64_t)color[2] << 32
	                      : CUBES_GRAY << 16;
	return attr;
}

/* The same of a lane of a cube that has it. */
static inline uint64_t psr_cubes_sample(const struct psr_cubes *cubes, uint32_t cube, uint32_t lane)
{
	const struct psr_cube_level *level = psr_cubes_level(cubes, cube);
	const uint32_t code = psr_cubes_code(cubes, level, cube);

	return psr_cubes_attr(level->tree, psr_cubes_leaf(cubes, level, cube) + psr_cubes_rank(level->tree, code, lane));
}

#endif
