/* The studies of [G] 6.5 and table 8.3: frustum, visibility cones and visibility masks cull blocks; this counts and
 * times them, and finds the visible samples by rays. Only level 0 of a model takes part, in its inner coordinates. */
#ifndef MODELS_STUDIES_CULL_CULL_H
#define MODELS_STUDIES_CULL_CULL_H

#include <stdint.h>
#include "ray/ray.h"
#include "render/screen.h"
#include "model/blocks.h"
#include "base/pool.h"

#define CULL_NO_MASK (-1)
#define CULL_FINEST 3 /* level of the triangles of directions: 512 of them */

/* The thesis's choice: 128 triangles, 4x4 regions. */
#define CULL_THESIS_LEVEL 2
#define CULL_THESIS_N 2

struct cull_choice {
	int cones; /* whether cones are tested */
	int level; /* masks of 8 * 4^level bits, 0..CULL_FINEST, or CULL_NO_MASK */
	int n;     /* the screen has 2^n x 2^n regions with a mask each, 0..SCREEN_MOST */
};

struct cull_eye {
	double place[3];
	double frame[3][3]; /* rows: right, down, forward */
	double tangent;     /* of half the angle that the square picture spans */
};

/* Number `which` of random eyes, at a random roll: the unit sphere just fills a picture that spans 40 degrees. With
 * zoom > 1 the picture shows a part of that, 1 / zoom wide, around a random place in the sphere. */
void cull_eye_place(struct cull_eye *eye, uint32_t which, double zoom);

/* part.c: makes a model of the blocks of level 0 whose is_kept[b] is not 0 (all of them if is_kept is NULL), in their
 * order, without cones and masks; world coordinates of an untransformed instance are inner ones. index (may be NULL):
 * the blocks' numbers in `model`. ARG if no block is kept, MEMORY. */
int cull_part(struct psr_model **out, const struct psr_model *model, const uint8_t *is_kept, uint32_t *index,
              struct psr_error *err);

/* The parts of level 0 that tests need. */
struct cull_set {
	struct psr_model *model; /* with its cones; its own masks are not read */
	struct psr_model *base;  /* level 0 alone, without cones and masks; block b is the set's */
	uint32_t n_blocks, *index; /* of base's blocks in model */
	int finest;
	uint64_t *mask[CULL_FINEST + 1]; /* by level: words of block after block */
	struct screen screen;
};

/* With masks of triangles of `finest` and all coarser levels: a bit of a coarser mask is set iff one of the four that
 * it is made of is. Keeps a reference to the model. ARG for a model without blocks at level 0, MEMORY. */
int cull_set_create(struct cull_set **out, const struct psr_model *model, int finest, struct psr_pool *pool,
                    struct psr_error *err);
void cull_set_destroy(struct cull_set *set); /* NULL is fine */

/* Sets is_kept[b] to 1 for a block whose sphere reaches into each side of the frustum ([G] 6.1), whose cone does not
 * turn it away (6.4, cone_culls), and whose mask has a bit in common with the mask of the smallest node of the screen's
 * tree that holds its sphere (6.3); to 0 for the others. Uses buffers of the set: one thread at a time. */
void cull_set_test(struct cull_set *set, const struct cull_eye *eye, const struct cull_choice *choice,
                   uint8_t *is_kept);

/* look.c, the truth: n_seen[b] is how many of a block's samples are in the picture, do not face away as the renderer
 * sees it, and are reached by a ray from the eye, which meets nothing in front of them by more than a quarter of the
 * lattice's step. scene: of the same object. */
void cull_set_look(const struct cull_set *set, const struct ray_scene *scene, const struct cull_eye *eye,
                   struct psr_pool *pool, uint8_t *n_seen);

#define CULL_MOST_CHOICES 16

struct cull_views {
	int n;
	double zoom;
	int is_timed; /* draws frames and times tests; needs zoom 1 */
	const struct cull_choice *choice;
	int n_choices; /* up to CULL_MOST_CHOICES */
};

/* Over all views; shares are of all blocks (samples) of level 0. */
struct cull_figures {
	double blocks, samples;  /* culled share */
	double wrong;            /* share of blocks that tests cull though rays find a sample */
	double test_seconds;     /* a view: of testing all blocks, screen's masks included, frustum included */
	double frame_seconds;    /* a view: drawing the kept blocks, and testing beyond the frustum */
};
struct cull_result {
	double blocks, samples; /* share that no ray finds */
	struct cull_figures figures[CULL_MOST_CHOICES]; /* of each choice */
};

/* Without a scene the shares that rays find, and `wrong`, are 0. Threads change no share. Times are of one thread, the
 * least of three: the renderer draws each view at the model's resolution, from models of the kept blocks alone.
 * MEMORY. */
int cull_measure(struct cull_result *out, struct cull_set *set, const struct ray_scene *scene,
                 const struct cull_views *views, struct psr_pool *pool, struct psr_error *err);

#endif
