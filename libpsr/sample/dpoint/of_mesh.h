/* Differential points of meshes and clouds ([K] 4). */
#ifndef PSR_SAMPLE_DPOINT_OF_MESH_H
#define PSR_SAMPLE_DPOINT_OF_MESH_H

#include "base/pool.h"
#include "dpoint/group.h"
#include "psr/mesh.h"
#include "psr/model.h"

struct dpoint_build_options {
	uint32_t resolution; /* pixels across the unit sphere: what textures and vertex colours are kept for */
	double epsilon;      /* of [K] 4.1, 1e-6..0.5 */
	double delta;        /* the most that a rectangle reaches, inner units: 2^-15..1 */
	double degrees;      /* normals may be off by so much in the middle of a piece of the surface, 0.1..90 */
	double height;       /* and heights by so much, inner units; > 0 */
	double piece;        /* the surface is covered in pieces of this size at most, inner units; > 0 */
	double error;        /* above 0: a bound in pixels of the resolution, see dpoint_of_mesh(); 3.55e-5 of the resolution
	                      * at least, 1 of it at most. Epsilon, delta, height are then lowered where it asks for that */
	struct psr_pool *pool; /* may be NULL */
	const struct psr_cancel *cancel; /* asked between pieces of work; may be NULL */
	/* Called before each step; total is 1. May be NULL. */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata);
	void *userdata;
};
void dpoint_build_options_default(struct dpoint_build_options *options, uint32_t resolution);

struct dpoint_build_report {
	uint64_t n_candidates, n_kept;
	uint64_t n_open;        /* pieces that no point covers: without an area, or bent as much as their sides are long */
	uint64_t n_bad;         /* curvatures that could not be told; such places are flat */
	uint64_t n_flat;        /* of these, points of a cloud whose neighbours are too few, or along a line */
	double normal_rms, normal_worst; /* radians */
	double height_worst;    /* inner units */
	double off_worst;       /* no drawn place is further from the surface, pixels of the resolution */
	uint64_t n_over;        /* points that are not within the error that was asked for */
	double seconds;
};

/* Chooses points of a mesh's triangles, in inner units of `info`, whose origin, scale, box, spacing and resolution it
 * fills in. Rectangles end at creases, borders, and where the mesh bends otherwise than they do. Where textures
 * (filtered over a pixel of the resolution) or colours at vertices change they end as well: at cells whose look differs
 * from their point's by more than 8 255ths of a channel, but for an overhang of 5e-4. Alpha-tested places that are not
 * there have no points; surfaces of BLEND materials have those of opaque ones. A closed surface is seen from its
 * outside alone, another one as its materials say. The caller calls dpoint_set_fini(), on failure too.
 *
 * With an error no place of what is drawn, the points' quadrics over their rectangles, is further from the surface: the
 * triangles as they are, less what alpha cuts out. Pieces are cut until that holds around each, down to a quarter of the
 * error or a step of a word's place; report->n_over counts points for which it does not hold even there.
 * set->height is proven, with an error and without: at most a sixteenth too great.
 *
 * A mesh without triangles is a cloud (dpoint/cloud.h): pieces are the squares around its points' discs, and what is
 * told of the surface holds for these, where the points were. It is closed if it has no border and its neighbours face
 * the same side; then, too, it is seen from its outside alone.
 *
 * ARG: options out of range, no extent; FORMAT: nothing is opaque, or no point of a cloud has a surface around it; LIMIT:
 * as of dpoint_sample_mesh(), or more than DPOINT_MOST_CLOUD points; MEMORY; CANCELLED. */
int dpoint_of_mesh(struct dpoint_set *set, struct psr_model_info *info, struct dpoint_build_report *report,
                   const struct psr_mesh *mesh, const struct dpoint_build_options *options, struct psr_error *err);

/* The end of it: makes the set of a surface's choice, and its greatest error. two_sided: by part, or NULL. MEMORY,
 * LIMIT, CANCELLED. */
int dpoint_finish(struct dpoint_set *set, struct dpoint_build_report *report, struct dpoint_surface *surface,
                  const uint8_t *two_sided, const struct dpoint_build_options *options);

#endif
