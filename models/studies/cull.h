/* The studies of [G] 6.5 and table 8.3: what frustum, visibility cones and visibility masks cull, what that saves, and
 * what rays find to be visible. Only level 0 of a model takes part; everything is in its inner coordinates. */
#ifndef PSR_MODELS_STUDIES_CULL_H
#define PSR_MODELS_STUDIES_CULL_H

#include <stdint.h>
#include "ray/ray.h"
#include "render/screen.h"
#include "psr/model.h"
#include "base/pool.h"

#define CULL_NO_MASK (-1)
#define CULL_FINEST 3 /* level of the triangles of directions: 512 of them */

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

struct cull_set;

/* What tests need of level 0, with masks of triangles of `finest` and all coarser levels: a bit of a coarser mask is
 * set iff one of the four that it is made of is. The model's own masks are not read; its cones are, and the set keeps
 * a reference to it. ARG for a model without blocks at level 0, MEMORY. */
int cull_set_create(struct cull_set **out, const struct psr_model *model, int finest, struct psr_pool *pool,
                    struct psr_error *err);
void cull_set_destroy(struct cull_set *set); /* NULL is fine */
uint32_t cull_set_n_blocks(const struct cull_set *set);

/* A model of level 0 alone, without cones and masks: its block b is the set's. Lives as long as the set. */
const struct psr_model *cull_set_base(const struct cull_set *set);

/* is_kept[b] = 1 for blocks that stay: their spheres are not wholly outside of one side of the frustum ([G] 6.1), the
 * cone does not turn them away (6.4, cone_culls), and their mask has a bit in common with that of the smallest node of
 * the screen's tree that holds their sphere (6.3). Uses buffers of the set: one thread at a time. */
void cull_set_test(struct cull_set *set, const struct cull_eye *eye, const struct cull_choice *choice,
                   uint8_t *is_kept);

/* The truth: n_seen[b] is how many of a block's samples are in the picture, do not face away as the renderer sees it,
 * and are reached by a ray from the eye, which meets nothing that is before them by more than a quarter of the
 * lattice's step. scene: of the same object. */
void cull_set_look(const struct cull_set *set, const struct ray_scene *scene, const struct cull_eye *eye,
                   struct psr_pool *pool, uint8_t *n_seen);

struct cull_views {
	int n;
	double zoom;
	int is_timed; /* frames are drawn and tests are timed, which wants zoom 1 */
};

/* Over all views; what is a share is of all blocks (samples) of level 0. */
struct cull_figures {
	double blocks, samples;  /* share that is culled */
	double wrong;            /* share of blocks that are culled though rays find them */
	double test_seconds;     /* a view: of testing all blocks, screen's masks included, frustum included */
	double frame_seconds;    /* a view: drawing what is kept, and what the tests take longer than the frustum alone */
};
struct cull_truth {
	double blocks, samples; /* share that no ray finds */
};

/* figures[i] for choice[i]; truth and wrong if scene is given, else 0. Shares are the same whatever the number of
 * threads. Times are of one thread, the least of three: the renderer draws each view at the model's resolution, from
 * models that have just the blocks that are kept. MEMORY. */
int cull_measure(struct cull_set *set, const struct ray_scene *scene, const struct cull_views *views,
                 const struct cull_choice *choice, int n_choices, struct psr_pool *pool, struct cull_figures *figures,
                 struct cull_truth *truth, struct psr_error *err);

#endif
