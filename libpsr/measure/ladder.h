/* What settings cost and what they give: frames of the same views, drawn with each of many settings in turn, timed, and
 * compared with the truth. */
#ifndef PSR_MEASURE_LADDER_H
#define PSR_MEASURE_LADDER_H

#include <stdint.h>
#include "measure.h"
#include "render/stages.h"
#include "simd/isa.h"

/* ---- views (ladder_views.c) ---- */

enum ladder_kind {
	LADDER_AROUND,  /* all of the object in the picture, from any side */
	LADDER_CLOSE,   /* a place of its surface, within 40 degrees of the normal; samples are two pixels apart there */
	LADDER_GRAZING, /* a place of its surface, 75 to 85 degrees from the normal; samples are a pixel apart there */
	LADDER_FAR,     /* as around, from five times as far */
	LADDER_N_KINDS
};
const char *ladder_kind_name(enum ladder_kind kind); /* "around" */

/* A picture of one model at its own place, in the light of psr_light_key(), dimmed so that white does not saturate, and
 * ambient light; views 4 to 7, 12 to 15, ... have shadows. Plain data but for the truth, which ladder_view_fini()
 * frees. */
struct ladder_view {
	enum ladder_kind kind;
	struct psr_camera camera;
	struct psr_light light;
	uint32_t width, height;
	uint8_t *truth;      /* 3 * width * height, sRGB */
	uint64_t n_covered;  /* pixels where a ray meets the object */
};

struct ladder_look {
	struct psr_truth *truth;           /* finds places of the surface */
	struct psr_source *source;         /* draws the truth; only ladder_view_trace() needs it */
	const struct psr_model_info *info; /* of the model at the ladder's usual resolution: box, way up, spacing */
	uint32_t width, height;
	uint64_t seed;                     /* other seeds give other views */
	int n_threads;
};

/* Makes n views; view i is of kind i % LADDER_N_KINDS, and does not depend on n. They have no truth yet. MEMORY. */
int ladder_views_make(struct ladder_view *view, uint32_t n, const struct ladder_look *look, struct psr_error *err);

/* Traces the truth of a view: rays * rays a pixel, 1..16. MEMORY. */
int ladder_view_trace(struct ladder_view *view, const struct ladder_look *look, uint32_t rays, struct psr_error *err);
void ladder_view_fini(struct ladder_view *view); /* a zeroed one is fine */

/* ---- settings, measured (ladder.c) ---- */

/* Makes the scene that shows the instance in the view; NULL: none. It points to both. */
void ladder_scene(struct psr_scene *scene, const struct ladder_view *view, const struct psr_instance *instance);

/* A coder whose loss counts as the frame's, and whose time of encoding counts as the frame's. Both functions return
 * PSR_OK or an error. */
struct ladder_coder {
	int (*encode)(uint64_t *n_bytes, const uint8_t *rgb, uint32_t width, uint32_t height, void *userdata);
	int (*decode)(uint8_t *rgb, uint32_t width, uint32_t height, void *userdata); /* of what was encoded last */
	void *userdata;
};

#define LADDER_BEST_ISA PSR_N_ISAS

struct ladder_rung {
	const struct psr_model *model;   /* of the object that all rungs draw */
	struct render_settings settings; /* width, height and cancel are the ladder's own */
	int no_shadows;                  /* 1: the light shines through */
	enum psr_isa isa;                /* LADDER_BEST_ISA: the best of the machine. simd_of() must have it */
	int n_threads;                   /* 1..256; 0: the ladder's */
	const struct ladder_coder *coder; /* NULL: none */
};

/* A rung's frames of one view. The first rung is the one that others are compared with. Times of one thread are its
 * processor time, which others on the machine take less from; those of several are wall time. */
struct ladder_row {
	double ms, ms_low, ms_high;          /* of a frame: median and quartiles. Shadow maps stand from frames before */
	double ratio, ratio_low, ratio_high; /* to the first rung's frame of the same round: median and quartiles */
	double shadow_ms;                    /* that drawing the shadow maps took, once */
	double rmse; /* codes of sRGB: root of the sum of squares over the whole picture, by the pixels that the object
	              * covers in the truth; 0 if it covers none and none is drawn */
	uint64_t n_bytes;                    /* that the coder made */
	uint32_t n_rounds;                   /* with this rung: a slow one is left out of later rounds */
	int is_same;                         /* the picture equals the first rung's, byte by byte */
};

/* Returns the peak signal to noise ratio of this error, dB; +inf for 0. */
double ladder_psnr(double rmse);

struct ladder_options {
	int n_threads;       /* 1..256 */
	uint32_t n_rounds;   /* >= 1: timed frames of each rung and view, after one that is not timed */
	double most_seconds; /* a rung that has taken so long in a view sits out its other rounds; > 0 */
	uint64_t seed;       /* of the order within rounds */
};

struct ladder; /* renderers, pools and buffers; one thread at a time */
int ladder_create(struct ladder **out, const struct ladder_options *options, struct psr_error *err); /* MEMORY */
void ladder_destroy(struct ladder *ladder); /* NULL is fine */

/* Draws the view n_rounds times with each rung, all rungs in a new order each round, and fills row[0..n-1]. The view
 * must have its truth. Errors as of psr_render(), and the coder's. */
int ladder_measure(struct ladder_row *row, struct ladder *ladder, const struct ladder_view *view,
                   const struct ladder_rung *rung, uint32_t n, struct psr_error *err);

/* Draws the view once, and codes it. rgb: 3 * width * height. */
int ladder_draw(uint8_t *rgb, struct ladder *ladder, const struct ladder_view *view, const struct ladder_rung *rung,
                struct psr_error *err);

/* ---- what the rows say (ladder_pick.c) ---- */

struct ladder_point {
	double ms, rmse;
};

/* Joins one rung's rows of several views, row[0], row[stride], ...: the mean of times, the root mean square of errors.
 * n >= 1. */
struct ladder_point ladder_join(const struct ladder_row *row, uint32_t stride, uint32_t n);

/* Sets is_unbeaten[i] to 1 where no other point is at most as slow and at most as wrong, and better in one of them
 * (Pareto). Of equal points the first one stands. */
void ladder_unbeaten(uint8_t *is_unbeaten, const struct ladder_point *point, uint32_t n);

/* Return the index of the least error within a time, of the least time within an error; of equal ones the better in the
 * other, then the first. n: there is none. */
uint32_t ladder_best_within(const struct ladder_point *point, uint32_t n, double ms);
uint32_t ladder_cheapest_within(const struct ladder_point *point, uint32_t n, double rmse);

#endif
