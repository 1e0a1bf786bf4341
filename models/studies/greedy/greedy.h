/* The modeller of [G] 5, as the peer that the product's own (psr/build.h) is compared with in docs/studies.md.
 *
 * Every projection is sampled once on its lattice; then any number of selections, with any block side, can be made of
 * these samples. One departure from [G] 5.2: the truth of a test view is its projection's own samples, 1.4 a pixel,
 * instead of rays traced anew through the pixels of each of the sixteen grids. Lengths are inner units
 * (model/blocks.h). */
#ifndef MODELS_STUDIES_GREEDY_GREEDY_H
#define MODELS_STUDIES_GREEDY_GREEDY_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/mesh.h"
#include "model/blocks.h"
#include "base/pool.h"
#include "models/studies/lib/study.h"
#include "ray/ray.h"

#define GREEDY_MOST_VIEWS 320
#define GREEDY_MOST_SIDE 32
#define GREEDY_MOST_ROTATIONS 4
#define GREEDY_MOST_SHIFTS 4

/* A block costs this in our file, and its validity mask a bit a lane; a valid sample 16 bits of depth and 64 of
 * attributes: sphere 8 (which says its place, too), projection 1, level and flags 1, first attribute 2, cone 4,
 * visibility mask 5, of which 4 are its part of the table. */
#define GREEDY_BLOCK_BYTES 21
#define GREEDY_SAMPLE_BYTES 10

enum greedy_lattice {
	GREEDY_EQUILATERAL, /* as model/blocks.h has it */
	GREEDY_SQUARE,      /* x = col * spacing, y = row * spacing. The spacing is ds cos(tolerance) here too: it is the
	                     * tolerance angle that makes it as dense as it must be ([G] 5.3, figure 5.7) */
};

enum greedy_directions {
	GREEDY_THESIS,      /* [G] 5.1: the centres of the 32 triangles of the sphere subdivided once. No normal is
	                     * further than 32.4 degrees from one */
	GREEDY_ICOSAHEDRAL, /* the 12 corners of an icosahedron and the 20 of the dodecahedron: 22.6 degrees */
	GREEDY_CORNERS,     /* the 32 of the thesis, the 66 corners of the sphere subdivided twice, and as scouts the 192
	                     * new ones of the sphere subdivided three times */
};

struct greedy_sample {
	float position[3], z; /* z: along the projection's, to its viewer */
	float cosine;         /* of the angle between geometric normal and projection; 0..1 */
	int16_t col, row;     /* of the lattice */
	uint32_t surface;     /* primitive, and GREEDY_BACK */
	uint64_t attr;        /* model/blocks.h */
	uint8_t two_sided;    /* of a primitive that is seen from both sides */
	uint8_t is_kept;
};
#define GREEDY_BACK 0x80000000u

struct greedy_block {
	int16_t col, row;  /* of its first lattice point */
	uint32_t first, n; /* its samples in the view's */
	uint8_t is_kept;
};

struct greedy_view {
	struct psr_projection projection;
	uint32_t n_samples, n_blocks;
	struct greedy_sample *sample; /* by blocks, within a block by rows, then columns */
	struct greedy_block *block;   /* by rows, then columns */
};

struct greedy_scan_options {
	uint32_t resolution; /* ds = 2 / resolution */
	double tolerance;    /* radians, 0 <= tolerance < pi/2 */
	enum greedy_lattice lattice;
	enum greedy_directions directions;
};

struct greedy {
	const struct psr_mesh *mesh;
	const struct ray_scene *scene;
	struct psr_pool *pool;
	struct greedy_scan_options options;
	double scale;               /* object units an inner unit */
	double ds;
	int side;                   /* of blocks, in samples */
	int n_views, n_scouts;      /* scouts are the last n_scouts of the views, without samples until they are needed */
	struct greedy_view view[GREEDY_MOST_VIEWS];
	uint8_t *is_two_sided;      /* by primitives */
	double seconds_scan;
};

/* Traces every projection but the scouts. The model (mesh, scene, scale) and the pool, which may be NULL, must outlive
 * it. MEMORY. */
int greedy_create(struct greedy **out, const struct study_model *model, const struct greedy_scan_options *options,
                  struct psr_pool *pool, struct psr_error *err);
void greedy_destroy(struct greedy *greedy); /* NULL is fine */

struct greedy_select_options {
	int side;                  /* of blocks: 4, 8, 16 or 32 samples */
	int n_rotations, n_shifts; /* tests of a view: turned by multiples of 22.5 degrees, shifted by half pixels; 1..4 */
	int is_facing;             /* only samples that face the test view count; 0: [G] as it stands */
	int is_strict_first;       /* a sweep before, in which only samples within the tolerance angle choose blocks */
	int forgives_outlines;     /* a sample seen at over 60 degrees chooses only where its surface is not there within
	                            * half a pixel more */
	double depth_tolerance;    /* how far apart depths of one surface may be, as a part of the difference that its slope
	                            * and the size of a pixel explain: 1; [G] does not say */
	int goes_on;               /* begins with the last selection's samples, of the same side: does not repeat the first
	                            * pass, or the order by score */
	int second_pass;           /* [G] 5.2: in the same order, blocks that are no longer needed are removed */
	int by_score;              /* [G] 9.2.2 instead of both passes: all blocks from the worst to the best by the
	                            * deviation of their normals from the projection, each dropped that no test view needs */
	int drops_samples;         /* [G] 9.2.3, at the end: the same with single samples */
};

/* The thesis's: 8, four by four, facing, second pass. */
void greedy_select_default(struct greedy_select_options *options);

struct greedy_result {
	uint64_t n_blocks, n_samples; /* kept; samples: valid ones */
	uint64_t n_lanes;             /* n_blocks * side^2: warping costs that much */
	uint64_t n_bytes;             /* as our file would take, without its fixed parts */
	uint64_t n_first_pass;        /* blocks before the second pass, or before they were dropped by score */
	double seconds;                /* of this call */
};

/* Marks the kept samples. Without goes_on the result does not depend on earlier selections. MEMORY. */
int greedy_select(struct greedy *greedy, const struct greedy_select_options *options, struct greedy_result *result,
                  struct psr_error *err);

/* A model's blocks of level 0 as a selection to measure beside the others; greedy_select is not for it. LIMIT,
 * MEMORY. */
int greedy_take_model(struct greedy **out, const struct psr_blocks *blocks, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err);

/* Does the same for a draft (sample/levels/draft.h) of one level and these projections, GREEDY_MOST_VIEWS at most.
 * MEMORY. */
struct draft;
int greedy_take_draft(struct greedy **out, const struct draft *draft, unsigned n_projections, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err);

/* The kept samples, in the order of views, blocks and samples: n_samples of the result. */
void greedy_samples(const struct greedy *greedy, struct trials_sample *sample);

/* ---- warp.c: what warping a selection costs ([G] 7.1), for block sides and lattices that the renderer does not have.
 *
 * A loop in the manner of the renderer's: perspective frames at magnification 1, blocks outside of their visibility
 * cones ([G] 6.4, about the mean normal) left out, a set-up for each of the others, a row and a lane at a time, the
 * minimum of 64-bit words. Neither level buffers nor tiles nor the test of single normals are in it. ---- */

struct greedy_warp;

/* Copies the kept blocks. MEMORY. */
int greedy_warp_create(struct greedy_warp **out, const struct greedy *greedy, struct psr_error *err);
void greedy_warp_destroy(struct greedy_warp *warp); /* NULL is fine */

struct greedy_warp_time {
	double seconds; /* of this thread's processor time, a frame; the least of some repetitions */
	double culled;  /* fraction of the blocks that cones left out */
};

/* Frames of options.resolution^2 pixels from n_frames directions, evenly spread. MEMORY. */
int greedy_warp_run(struct greedy_warp *warp, int n_frames, struct greedy_warp_time *time, struct psr_error *err);

#endif
