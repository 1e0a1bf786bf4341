/* What studies of octrees share (octree_views.c): three views of a model, their truth, and what frames of models of it
 * cost and miss. */
#ifndef MODELS_STUDIES_TABLES_OCTREE_H
#define MODELS_STUDIES_TABLES_OCTREE_H

#include "measure/measure.h"
#include "octree/octree.h"
#include "tables.h"

#define OCTREE_SIDE 512 /* of a picture, as in [B] 6 */
#define OCTREE_VIEWS 3

struct octree_truth {
	struct psr_source_planes view[OCTREE_VIEWS];
	struct psr_frame frame; /* room for one */
};

/* Traces the views. octree_truth_fini() is due even on failure. MEMORY, and errors of the source. */
int octree_truth_init(struct octree_truth *truth, struct study *study, const struct study_model *of);
void octree_truth_fini(struct octree_truth *truth);

struct octree_drawn {
	double fps, db, wrong; /* frames a second; decibels over covered pixels; holes and leaks, of a million inside */
	double inside_db;      /* of octree_score() */
};

#define OCTREE_MOST_WAYS 4

/* A way to show a model. */
struct octree_way {
	const struct psr_model *model;
	int with_splats, is_whole; /* is_whole: down to its leaves, even where the picture needs fewer levels */
};

/* Draws all views in each of n ways, in turn. Needs study->renderer. */
int octree_compare(struct octree_drawn *drawn, struct study *study, const struct study_model *of,
                   const struct octree_way *way, int n, const struct octree_truth *truth);

/* Sums of all views: seconds of a frame, and of its cull and warp (the least of several); points after culling, and those
 * of them that were placed in the picture and do not face away. */
struct octree_rate {
	double seconds, warp_seconds, drawn, warped;
};

/* The same without a truth. */
int octree_rates(struct octree_rate *rate, struct study *study, const struct study_model *of,
                 const struct octree_way *way, int n);

/* Draws all views of a model with these settings, of OCTREE_SIDE pixels. Needs study->renderer. */
int octree_score(struct octree_drawn *drawn, struct study *study, const struct study_model *of,
                 const struct psr_model *model, const struct psr_settings *settings, const struct octree_truth *truth);

/* How many pixels of a view are a unit of the mesh, in the middle of the model. */
double octree_pixels(const struct study_model *of);

/* Makes the model of a tree in units of its source. */
int octree_model(struct psr_model **out, struct study *study, const struct octree *tree);

/* octree_scan.c: builds an octree of points that a scanner would find on a mesh. */
int octree_scanned(struct octree **tree, struct study *study, const struct study_model *of, int levels);

/* Makes the octree of a mesh, or of a scan of it, and the model of it. The caller owns *tree, which is NULL or whole, and
 * *out. */
int octree_points(struct psr_model **out, struct octree **tree, struct study *study, const struct study_model *of,
                  int levels);

/* ---- octree_prefixes.c ---- */

/* A packed file of a model, in memory. */
struct octree_packed {
	uint8_t *bytes;
	size_t n, capacity;
	struct psr_model *whole;
};

/* In any case for octree_packed_fini(). */
int octree_packed_make(struct octree_packed *packed, struct study *study, const struct study_model *of, int levels);
void octree_packed_fini(struct octree_packed *packed);

/* Returns what the first bytes of the file are, and how many these are; NULL where they are no model. */
struct psr_model *octree_packed_part(size_t *n, const struct octree_packed *packed, unsigned percent);

#define OCTREE_PARTS 4
extern const unsigned octree_parts[OCTREE_PARTS]; /* percent, as in [B] */

#endif
