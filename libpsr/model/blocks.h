/* The blocks of a model: the structures of a file in memory, the lattice they stand on, and models made of them. */
#ifndef PSR_MODEL_BLOCKS_H
#define PSR_MODEL_BLOCKS_H

#include "psr/model.h"

#define PSR_BLOCK_SIDE 8
#define PSR_BLOCK_SAMPLES 64 /* [G] 5.1: 8x8 */

/* One orthographic projection ([G] 5.1). Rows of `axis` are projection space's x, y, z in the model's inner
 * coordinates, a right-handed orthonormal frame; z points to the viewer of the projection, and samples' depths grow
 * along it. Lattice sample (col, row) of level 0 stands at x = (col + (row & 1) / 2) * spacing, y = row * sqrt(3)/2 *
 * spacing: equilateral ([G] 4.4), with every second row shifted by half a step, so that blocks are nearly square. */
struct psr_projection {
	float axis[3][3];
	float spacing; /* at level 0, at least 2^-14; level l has spacing * 2^l */
};

#define PSR_MAX_LEVELS 8

/* How far a sample may be from the surface that it shows, before its depth is rounded, in spacings of its level
 * (psr_model_info): the modeller moves some to lattice points. FAR: in blocks that say so. OLD: in files before 6.6. */
#define PSR_SAMPLE_OFF 0.25
#define PSR_SAMPLE_FAR_OFF 0.4
#define PSR_SAMPLE_OLD_OFF 0.55

/* A byte a block. */
enum psr_block_flag {
	PSR_BLOCK_LEVEL = 7,       /* these bits are the level, 0 the finest */
	PSR_BLOCK_DEPTH = 15 << 3, /* these times an eighth are n: the step of its depths is 2^-(14 + n) */
	PSR_BLOCK_TWO_SIDED = 1 << 7 /* seen from its back it is shaded with its normals turned; else it is not seen ([G]
	                              * 7.3.2) */
};

/* Properties that only few models' blocks have: a byte a block, in models where some block has one. */
enum psr_block_trait {
	/* Some samples' shading normals are far from their faces' normals, so they cannot tell how these face: the block's
	 * cone tells it of the whole block. The renderer draws all of the block unless its cone faces away. It sees a
	 * two-sided block from the front where the cone's normal nearest to the shading normal faces the eye. */
	PSR_BLOCK_BENT = 1,
	/* Some samples let a part of the light through, by their opacity. */
	PSR_BLOCK_SHEER = 2,
	/* A sheer block of things narrower than a sample's cell: an opacity is the share that they cover of a disc about
	 * the sample, as wide as a step of the lattice. */
	PSR_BLOCK_THIN = 4,
	/* Some samples are up to PSR_SAMPLE_FAR_OFF off the surface. */
	PSR_BLOCK_OFF = 8,
	/* Up to PSR_SAMPLE_OLD_OFF. Of all blocks of a file, which does not say so. */
	PSR_BLOCK_OLD = 16
};

/* A run is PSR_RUN_BLOCKS blocks in a row: their numbers have the same quotient. It stores what is equal or near for
 * all of them. */
#define PSR_RUN_BLOCKS 1024

struct psr_run {
	uint32_t attr_first;       /* of the first block */
	uint32_t visibility_first; /* the first block's; 0 in a model without visibility masks */
};

#define PSR_CONE_ANY 255

/* Blocks ([G] 5.1), as structures of arrays: what culling, warping and shading read is apart. Block b's lattice
 * origin is where psr_blocks_place() says; sample s = 8 * r + c of it is valid iff bit s of mask[b]; its depth along z
 * is psr_place_depth() of depth[k], its attributes are attr[k], with k = psr_blocks_attr_first() + number of lower set
 * bits. Blocks of one cluster follow each other, and clusters are in the order of their blocks, without gaps.
 *
 * Checked wherever a model is made or opened (docs/format.md has every rule): lengths and coordinates inside of a
 * model are finite and at most 1024, axes are orthonormal to 2^-20, counts and indices fit each other; at most
 * 2^26 blocks, 256 projections, 8 levels. */
struct psr_blocks {
	uint32_t n_blocks, n_projections, n_clusters, n_levels;
	uint32_t n_masks;                       /* length of visibility_mask, at most n_blocks; 0 without */
	uint64_t n_samples;                     /* valid samples of all blocks; == length of attr and depth */
	const struct psr_projection *projection;
	const struct psr_cluster *cluster;
	const struct psr_run *run;              /* psr_blocks_runs() of them */
	const int16_t *sphere_x, *sphere_y, *sphere_z; /* see psr_blocks_sphere() */
	const uint16_t *sphere_r;
	const uint8_t *block_projection;
	const uint8_t *flags;                   /* enum psr_block_flag */
	const uint64_t *mask;                   /* never 0 */
	const uint16_t *attr_offset;            /* see psr_blocks_attr_first() */
	const uint16_t *depth;                  /* readable for 64 elements beyond the last; these have no meaning */
	const uint64_t *attr;                   /* see PSR_ATTR_* */
	/* Optional, NULL if absent ([G] 6.3, 6.4). The cone: all normals of the block's faces, and but in a bent block
	 * those of its samples, are within an angle below 90 degrees, of sine cone_sine / 255, of the direction of (cone_x,
	 * cone_y, cone_z); the greatest magnitude of these is 127. */
	const int8_t *cone_x, *cone_y, *cone_z;
	const uint8_t *cone_sine;               /* PSR_CONE_ANY: any normals, and the axis means nothing */
	const uint8_t *traits;                  /* enum psr_block_trait; not without cones */
	uint8_t traits_of_all;                  /* those that all blocks have: PSR_BLOCK_OLD of files before 6.6, or 0 */
	const uint8_t *opacity;                 /* a sample, of PSR_OPAQUE; not without traits. NULL: all are opaque */
	const uint8_t *visibility_index;        /* see psr_blocks_visibility() */
	const uint64_t (*visibility_mask)[2];   /* 128 bits, one a triangle of directions; many blocks share one */
};

static inline uint32_t psr_blocks_runs(const struct psr_blocks *blocks)
{
	return blocks->n_blocks / PSR_RUN_BLOCKS + (blocks->n_blocks % PSR_RUN_BLOCKS != 0);
}

static inline unsigned psr_blocks_level(const struct psr_blocks *blocks, uint32_t block)
{
	return blocks->flags[block] & PSR_BLOCK_LEVEL;
}

static inline unsigned psr_blocks_traits(const struct psr_blocks *blocks, uint32_t block)
{
	return blocks->traits_of_all | (blocks->traits != NULL ? blocks->traits[block] : 0u);
}

#define PSR_OPAQUE 255

/* Returns whether a block's samples have opacities. */
static inline int psr_blocks_is_sheer(const struct psr_blocks *blocks, uint32_t block)
{
	return blocks->opacity != NULL && (psr_blocks_traits(blocks, block) & PSR_BLOCK_SHEER) != 0;
}

/* Returns the index of a block's first sample. */
static inline uint32_t psr_blocks_attr_first(const struct psr_blocks *blocks, uint32_t block)
{
	return blocks->run[block / PSR_RUN_BLOCKS].attr_first + blocks->attr_offset[block];
}

/* Returns the index of a block's mask in visibility_mask, in a model that has masks. */
static inline uint32_t psr_blocks_visibility(const struct psr_blocks *blocks, uint32_t block)
{
	return blocks->run[block / PSR_RUN_BLOCKS].visibility_first + blocks->visibility_index[block];
}

/* Computes the sphere that bounds the samples of a block and reaches half a step beyond: its centre is (sphere_x,
 * sphere_y, sphere_z) / 2^14, its radius sphere_r / 2^15, in inner units. All are exact. */
static inline void psr_blocks_sphere(const struct psr_blocks *blocks, uint32_t block, float center[3], float *radius)
{
	center[0] = (float)blocks->sphere_x[block] * (1.0f / 16384);
	center[1] = (float)blocks->sphere_y[block] * (1.0f / 16384);
	center[2] = (float)blocks->sphere_z[block] * (1.0f / 16384);
	*radius = (float)blocks->sphere_r[block] * (1.0f / 32768);
}

/* A block's place on the lattice of its projection and level l, which follows from its sphere: of all windows of 8 x 8
 * lattice points that begin in an even row, the one whose middle is nearest to the sphere's center, 3.75 columns and
 * 3.5 rows from its first point. The center's depth is the origin of depths. */
struct psr_place {
	double col, row; /* the first lattice point in those of level 0: multiples of 2^l, and of twice that */
	double z;        /* the center's depth, in inner units */
	float step;      /* a step of `depth` in inner units, a power of two */
};

/* Columns, rows and depth for a length of 2^-14 along x, y and z. They turn a sphere into its place in one
 * projection. */
struct psr_placing {
	double of[3][3];
};

static inline void psr_placing_make(struct psr_placing *placing, const struct psr_projection *projection)
{
	const double steps = 1 / (double)projection->spacing, length[3] = { steps, steps * 1.1547005383792515, 1 };

	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			placing->of[i][k] = (double)projection->axis[i][k] * length[i] * (1.0 / 16384);
}

/* Computes the place of a block of that projection. */
static inline void psr_placing_find(const struct psr_placing *placing, const struct psr_blocks *blocks, uint32_t block,
                                    struct psr_place *place)
{
	const double x = blocks->sphere_x[block], y = blocks->sphere_y[block], z = blocks->sphere_z[block];

	const double (*of)[3] = placing->of;
	const unsigned flags = blocks->flags[block], level = flags & PSR_BLOCK_LEVEL;
	const double scale = (double)(1u << level), whole = 0x1.8p52 * scale; /* next to this, doubles are 2^level apart */

	place->col = ((x * of[0][0] - 3.75 * scale) + (y * of[0][1] + z * of[0][2])) + whole - whole;
	place->row = ((x * of[1][0] - 3.5 * scale) + (y * of[1][1] + z * of[1][2])) + 2 * whole - 2 * whole;
	place->z = x * of[2][0] + (y * of[2][1] + z * of[2][2]);
	place->step = 1.0f / (float)(1u << (14 + ((flags & PSR_BLOCK_DEPTH) >> 3)));
}

static inline void psr_blocks_place(const struct psr_blocks *blocks, uint32_t block, struct psr_place *place)
{
	struct psr_placing placing;

	psr_placing_make(&placing, &blocks->projection[blocks->block_projection[block]]);
	psr_placing_find(&placing, blocks, block, place);
}

/* Returns a sample's depth along the projection's z, in inner units. */
static inline float psr_place_depth(const struct psr_place *place, uint16_t depth)
{
	return (float)(place->z + (double)place->step * (depth - 32768));
}

/* A spatial cluster at one level: blocks first_block .. first_block + n_blocks - 1. Clusters of one `group` are the
 * same piece of the object at different levels; a frame draws exactly one of them. */
struct psr_cluster {
	float center[3], radius; /* holds its blocks' spheres */
	uint32_t first_block, n_blocks;
	uint32_t group; /* < n_clusters; the clusters of a group have different levels */
	uint8_t level, zero[3]; /* level: that of its blocks */
};

/* Attributes of a sample, one word ([G] table 5.1):
 *   bits  0-14  normal, index of the subdivided sphere (base/direction.h)
 *   bit   15    unlit: drawn in its base colour whatever the lights
 *   bits 16-39  base colour R, G, B, 8 bits each, sRGB-coded (R lowest)
 *   bits 40-44  metallic, 31sts
 *   bits 45-49  r: what is not metal reflects F0 = (r / 30)^2, at most 1, of light from ahead
 *   bits 50-55  shut, 63rds: ambient light that does not reach the sample
 *   bits 56-63  roughness, 255ths
 * Where bits 40-55 are 0 the sample only scatters light, in all directions alike. Unlit samples have zeros in 40-63. */
#define PSR_ATTR_NORMAL(a) ((uint32_t)((a) & 0x7fff))
#define PSR_ATTR_UNLIT(a) ((uint32_t)((a) >> 15 & 1))
#define PSR_ATTR_BASE(a) ((uint32_t)((a) >> 16 & 0xffffff)) /* r | g << 8 | b << 16 */
#define PSR_ATTR_GLOSS(a) ((uint32_t)((a) >> 40 & 0xffff))  /* metallic, reflectance and shut */
#define PSR_ATTR_METALLIC(a) ((uint32_t)((a) >> 40 & 31))
#define PSR_ATTR_REFLECTANCE(a) ((uint32_t)((a) >> 45 & 31))
#define PSR_ATTR_SHUT(a) ((uint32_t)((a) >> 50 & 63))
#define PSR_ATTR_ROUGHNESS(a) ((uint32_t)((a) >> 56))

/* psr_model_read() from bytes in memory, which it copies: for tests and fuzzers. */
int psr_model_parse(struct psr_model **out, const void *bytes, size_t n_bytes, struct psr_error *err);

/* Makes a model from the caller's arrays. Copies and validates them like a file's; presets may be NULL. ARG for missing
 * arrays, LIMIT for counts, FORMAT for values that break a rule, MEMORY. */
int psr_model_create(struct psr_model **out, const struct psr_model_info *info, const struct psr_blocks *blocks,
                     const struct psr_presets *presets, struct psr_error *err);

/* Returns NULL if the model has no such representation. */
const struct psr_blocks *psr_model_blocks(const struct psr_model *model);

#endif
