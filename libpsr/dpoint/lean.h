/* Faces that their normals lean from, covered by points that lie in them: a step of dpoint_simplify(). */
#ifndef PSR_DPOINT_LEAN_H
#define PSR_DPOINT_LEAN_H

#include "rectangle.h"

/* [K] has one normal for surface and shading. A mesh of few triangles has two, and rectangles that stand on those of
 * shading are the slats of a blind: who looks flatter along a face than its normals lean sees between them, or sees all
 * of them from behind, which is nothing. Such a face gets flat points in its own plane, whose normals lean (struct
 * dpoint_lean), and points that cover nothing but such faces are left out.
 * A face is one whose cells let rays through that graze it, to half a sample behind it.
 * Adds to surface, choice and cover; is_tiled, by cell: set for those of the faces. MEMORY, CANCELLED. */
int tile_faces(uint8_t *is_tiled, struct dpoint_surface *surface, struct dpoint_choice *choice,
               struct dpoint_cover *cover, const struct dpoint_cover_options *options,
               const struct dpoint_work *work);

/* The same of faces that any cell of is set in is_open, and which are not tiled yet. No other candidates may have been
 * added after tile_faces(). */
int tile_open(uint8_t *is_tiled, struct dpoint_surface *surface, struct dpoint_choice *choice,
              struct dpoint_cover *cover, const struct dpoint_cover_options *options, const uint8_t *is_open,
              const struct dpoint_work *work);

/* Finds how the normals between a face's corners lean from a flat candidate. Where there is none it does not. */
void lean_make(struct dpoint_lean *lean, const struct dpoint_face *face, const struct dpoint_candidate *of);

/* Adds flat candidates that cover a face, and their leans; what is beyond its sides they may reach over by `beyond`,
 * by side. attr: theirs. MEMORY. */
int tile_face(struct dpoint_surface *surface, const struct dpoint_face *face, const float beyond[3], uint64_t attr,
              float delta);

/* The same of a face and its twin, which are a rectangle. beyond: over any of its sides. MEMORY. */
int tile_rectangle(struct dpoint_surface *surface, const struct dpoint_face *face, float beyond, uint64_t attr,
                   float delta);

/* Adds one in a cell's plane, over the cell. MEMORY. */
int tile_cell(struct dpoint_surface *surface, const struct dpoint_face *face, uint32_t cell,
              const struct dpoint_cover_options *options);

#endif
