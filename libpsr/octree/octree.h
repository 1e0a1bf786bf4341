/* Octrees of byte codes ([B] 2): a cube, split `levels` times into octants, and which of its smallest cells, the
 * leaves, hold points. A byte code is a node: bit j says that octant j is not empty; j is x + 2y + 4z, where x is 1 for
 * the upper half. So no code is 0. A path names a node: the octants from the root, three bits each, the last one
 * lowest. Paths of one depth, sorted, are in Morton order. */
#ifndef PSR_OCTREE_OCTREE_H
#define PSR_OCTREE_OCTREE_H

#include <stdint.h>
#include "base/pool.h"
#include "psr/error.h"

#define OCTREE_LEAST_LEVELS 2
#define OCTREE_MOST_LEVELS 20
#define OCTREE_SKIP_LEVELS 6 /* from a node of the skip index to its leaves: some 4,000 leaves of a surface */
#define OCTREE_OFFSETS 4     /* steps of a leaf's offset */
#define OCTREE_MATTE 0xff0000u /* the material of leaves that have none: rough, open, mirrors nothing */
#define OCTREE_UNLIT 0x0003e0u /* of leaves that are drawn in their colour: no sample has such a reflectance */

/* Where the subtree of a node OCTREE_SKIP_LEVELS above the leaves begins; the root's in a tree of fewer levels. */
struct octree_skip {
	uint64_t path, code, leaf; /* of the node; of its code; of its first leaf */
};

/* What a laser scan tells of each leaf, by streams that each may be NULL: the mean of intensities, and all else of the
 * first of the leaf's points in the order of their source. Inner nodes have none. */
struct octree_scan {
	uint16_t *intensity;
	uint8_t *class;          /* as the ASPRS numbers them: 2 is ground */
	uint8_t *returns;        /* low 4 bits: the number of the return in its pulse; high 4 bits: of how many */
	uint32_t *time;          /* GPS time, in steps */
	double (*time_scale)[2]; /* the time of 0, and seconds of a step; not NULL where `time` is not */
};

#define OCTREE_LEAN_DEPTH 4
#define OCTREE_LEAN_CELLS 4096

struct octree {
	int levels;
	int is_one_sided;          /* 1: normals point out of a solid, and leaves are not seen from their backs */
	int is_cloud;              /* 1: leaves are where points are; a surface may pass between them */
	double low[3], edge;       /* the cube, in units of the source: its low corner, its edge */
	uint64_t n_codes, n_leaves, n_skips;
	uint8_t *code;             /* depth first: a node's code, then its children with all that is below them. So the
	                            * code of a cell of 4x4x4 leaves stands right before its children's. */
	struct octree_skip *skip;  /* in Morton order */
	uint16_t *normal;          /* of each leaf in Morton order: base/direction.h; NULL: none */
	uint8_t (*color)[3];       /* sRGB; NULL: none */
	uint8_t *offset;           /* [B] 5.1: 0..OCTREE_OFFSETS - 1, octree_offset(); NULL: none */
	uint8_t (*material)[3];    /* of each leaf: bits 40 to 63 of a sample's attributes (model/blocks.h), lowest byte first */
	uint8_t *lean;             /* of one-sided trees, by path of the OCTREE_LEAN_CELLS nodes of depth OCTREE_LEAN_DEPTH, 255
	                            * times a sine: so far normals of leaves lean from the faces that they are of, which
	                            * then cannot be told by them. NULL: all 0 */
	uint8_t (*one_material)[3]; /* of all leaves, where that is NULL; both NULL: OCTREE_MATTE */
	struct octree_scan scan;
};

void octree_destroy(struct octree *tree); /* NULL is fine */

/* ---- making one from leaves in Morton order ---- */

struct octree_maker {
	struct octree *tree;
	uint64_t codes_room, skips_room, last; /* last: the path of the newest leaf */
	uint64_t at[OCTREE_MOST_LEVELS];       /* the newest code of each depth */
};

/* Begins a tree without attributes. ARG: levels out of range; MEMORY. */
int octree_maker_init(struct octree_maker *maker, int levels, struct psr_error *err);
void octree_maker_fini(struct octree_maker *maker); /* destroys the tree unless octree_maker_take() took it */

/* Adds a leaf. ARG: its path is not above the last one's, or longer than the tree is deep; MEMORY. */
int octree_maker_put(struct octree_maker *maker, uint64_t path, struct psr_error *err);

/* Returns the tree, of the cube from 0 to 1, to the caller. NULL if there is no leaf. */
struct octree *octree_maker_take(struct octree_maker *maker);

/* ---- reading ---- */

struct octree_node {
	uint64_t path, code, leaf; /* code: its place, undefined for a leaf; leaf: the first one below, or itself */
};

/* Visits the nodes of a depth, 0 (the root) to `levels` (the leaves), in Morton order. A visitor that returns something
 * else than 0 ends the walk, which returns it. */
int octree_walk(const struct octree *tree, int depth, int (*visit)(const struct octree_node *node, void *userdata),
                void *userdata);

/* Returns which leaves of a node of depth levels - 2 there are: bit 8 i + j stands for octant j of its octant i. code:
 * the place of its code. */
uint64_t octree_mask(const struct octree *tree, uint64_t code);

/* Computes the middle of a node of this depth, in units of the source. */
void octree_center(const struct octree *tree, uint64_t path, int depth, double center[3]);

/* Returns how far along its normal a leaf's point is from the leaf's middle, in edges of a leaf: the middles of
 * OCTREE_OFFSETS equal parts of -sqrt(3)/2..sqrt(3)/2. */
double octree_offset(unsigned step);
/* Returns the nearest step. */
unsigned octree_offset_step(double offset);

/* Checks codes and skip index, whatever bytes they are, against each other and the counts. Threads of the pool, which may
 * be NULL, share the work. FORMAT. */
int octree_check(const struct octree *tree, struct psr_pool *pool, struct psr_error *err);

/* ---- attributes of inner nodes, from those of their 1 to 8 children, in the order of these ---- */

uint16_t octree_mean_normal(const uint16_t *normal, unsigned n);
void octree_mean_color(uint8_t mean[3], const uint8_t (*color)[3], unsigned n); /* in the codes' scale */

/* Returns where the mean of the children's points is along the mean normal, as a step of a leaf of the node's size.
 * code: the node's, which lists its children. */
unsigned octree_mean_offset(unsigned code, uint16_t mean, const uint16_t *normal, const uint8_t *offset);

static inline uint32_t octree_get_material(const uint8_t at[3])
{
	return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16;
}

/* Returns a leaf's material, bits 40 to 63 of a sample's attributes, or OCTREE_UNLIT. */
static inline uint32_t octree_material(const struct octree *tree, uint64_t leaf)
{
	const uint8_t *one = tree->one_material != NULL ? *tree->one_material : NULL;
	const uint8_t *at = tree->material != NULL ? tree->material[leaf] : one;

	return at != NULL ? octree_get_material(at) : OCTREE_MATTE;
}

static inline void octree_put_material(uint8_t at[3], uint32_t material)
{
	for (int i = 0; i < 3; i++)
		at[i] = (uint8_t)(material >> 8 * i);
}

/* Returns the mean of the materials of n leaves from `first` on: of metal and of openness; of reflectances, by what is
 * not metal; and the root of the mean of lobes' squared widths, by F0, where metal counts as white. A lobe that mirrors
 * is widened by the spread of the leaves' normals ([Toksvig]), as those of blocks are (surface/blend.h). */
uint32_t octree_mean_material(const struct octree *tree, uint64_t first, unsigned n);

/* Makes the tree whose leaves are the nodes right above those of `finer`, of more than OCTREE_LEAST_LEVELS levels: with
 * the means of their normals, colours and materials, and, where leaves have normals and offsets, the offsets of their
 * mean places. One material of all stays it. NULL without memory. */
struct octree *octree_coarser(const struct octree *finer);

/* ---- paths ---- */

/* Spreads 21 bits to every third one. */
static inline uint64_t octree_spread(uint32_t x)
{
	uint64_t v = x & 0x1fffff;

	v = (v | v << 32) & 0x001f00000000ffffu;
	v = (v | v << 16) & 0x001f0000ff0000ffu;
	v = (v | v << 8) & 0x100f00f00f00f00fu;
	v = (v | v << 4) & 0x10c30c30c30c30c3u;
	return (v | v << 2) & 0x1249249249249249u;
}

static inline uint32_t octree_gather(uint64_t v)
{
	v &= 0x1249249249249249u;
	v = (v | v >> 2) & 0x10c30c30c30c30c3u;
	v = (v | v >> 4) & 0x100f00f00f00f00fu;
	v = (v | v >> 8) & 0x001f0000ff0000ffu;
	v = (v | v >> 16) & 0x001f00000000ffffu;
	return (uint32_t)((v | v >> 32) & 0x1fffff);
}

static inline uint64_t octree_path(const uint32_t at[3])
{
	return octree_spread(at[0]) | octree_spread(at[1]) << 1 | octree_spread(at[2]) << 2;
}

/* Returns the first node of depth OCTREE_LEAN_DEPTH that is the one of this path and depth, above it, or below it. */
static inline uint64_t octree_lean_first(uint64_t path, int depth)
{
	return depth > OCTREE_LEAN_DEPTH ? path >> 3 * (depth - OCTREE_LEAN_DEPTH) : path << 3 * (OCTREE_LEAN_DEPTH - depth);
}

static inline void octree_place(uint64_t path, uint32_t at[3])
{
	for (int c = 0; c < 3; c++)
		at[c] = octree_gather(path >> c);
}

#endif
