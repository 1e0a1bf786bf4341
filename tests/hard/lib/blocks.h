/* Models of blocks that a test makes by hand, and frames of them. Include after cmocka.h. */
#ifndef TESTS_HARD_BLOCKS_H
#define TESTS_HARD_BLOCKS_H

#include "model/blocks.h"
#include "render/stages.h"

/* How many random cases a test draws. The sanitizers take ten times as long for each, and see as much in fewer. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HARD_CASES(n) ((n) / 50 + 1)
#else
#define HARD_CASES(n) (n)
#endif

#define HARD_ALL_PLANES ((1u << PSR_N_PLANES) - 1)

void hard_direction(double d[3], uint64_t *seed); /* uniform, of length 1 */

struct hard_block {
	unsigned projection, level;
	int col, row;      /* of sample 0, in steps of the block's level; the row is even */
	uint64_t mask;     /* not 0 */
	double depth[64];  /* along the projection's z, inner units */
	uint64_t attr[64];
	uint8_t flags;     /* PSR_BLOCK_TWO_SIDED or 0 */
	uint8_t traits;
	int8_t cone[3];
	uint8_t cone_sine; /* in models with cones */
	uint32_t group;
};

struct hard_model {
	const struct psr_projection *projection;
	uint32_t n_projections;
	int with_cones;
	double spacing, scale, origin[3]; /* as of psr_model_info; 0: the greatest of the projections, and 1 */
};

/* Makes a model. Blocks of equal group and level that follow each other become a cluster. Depths are rounded to the
 * finest step that spans the block's. */
struct psr_model *hard_model(const struct hard_model *options, const struct hard_block *block, uint32_t n);

/* A projection along dir, of any length but 0. */
struct psr_projection hard_projection(double x, double y, double z, double spacing);

/* An attribute word of a white sample, matt or with the specular colour and exponent. */
uint64_t hard_attr(const double normal[3], uint32_t specular, uint32_t exponent);

/* Full two-sided blocks of random places within the unit sphere, in random projections of the given spacing: the depths
 * of a block lie within `deep` of one another. */
struct psr_model *hard_random_model(uint64_t *seed, uint32_t n_blocks, double spacing, double deep);

/* A flat square about the origin, in the plane z = 0 or another, that faces +z: groups x groups groups, each of blocks
 * of `levels` levels. A group is 8 * 2^(levels - 1) columns and rows of the finest lattice a side. */
struct hard_sheet {
	double spacing, z;
	int groups;
	unsigned levels; /* 1..PSR_MAX_LEVELS */
	uint64_t attr;
};
struct psr_model *hard_sheet(const struct hard_sheet *sheet);
#define HARD_UNLIT (UINT64_C(1) << 15) /* of an attribute */

/* Where a valid sample of a block is, in inner coordinates. */
void hard_position(double at[3], const struct psr_blocks *blocks, uint32_t block, uint32_t sample);

struct psr_instance hard_place(const struct psr_model *model); /* where the model's own coordinates put it */

/* The renderer of all frames of a program, as in psrd: no frame is to spoil it for those that follow. */
struct psr_renderer *hard_renderer(void);

/* Draws all planes of a frame, which psr_frame_free() frees, by default settings or by the caller's. Fails if a depth
 * is NaN or not positive, if a word is no depth, or if the report's error is not finite. */
void hard_draw(struct psr_frame *frame, const struct psr_scene *scene, uint32_t width, uint32_t height);
void hard_draw_with(struct psr_frame *frame, const struct psr_scene *scene, const struct render_settings *settings);

/* The same of colour and depth alone, with what psr_settings offers: smoothing and passes. */
void hard_draw_pass(struct psr_frame *frame, const struct psr_scene *scene, const struct psr_settings *settings);

/* Fails unless the planes, a set of bits 1 << enum psr_plane, have the same bytes in both frames. */
void hard_same_planes(const struct psr_frame *a, const struct psr_frame *b, unsigned planes);
#define HARD_ALL_PLANES ((1u << PSR_N_PLANES) - 1)

#endif
