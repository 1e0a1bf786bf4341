/* Meshes and clouds to candidates and cells. */
#ifndef PSR_DPOINT_MESH_H
#define PSR_DPOINT_MESH_H

#include "psr/mesh.h"
#include "surface.h"

struct dpoint_mesh_options {
	double origin[3], scale; /* inner units are (place - origin) * scale */
	double cell;             /* triangles are cut into cells of sides of at most this, in inner units */
	double turn;             /* and normals turn by at most this along them, radians, but within a quarter of `cell`; 0: by
	                          * any angle */
	float delta;             /* the most that a rectangle may reach: 0 < delta <= 1 */
	/* How finely looks are seen, by material: pieces whose looks differ by more than `looks` 255ths of a channel
	 * (look.h) are cut into quarters until they are of this size; 0: not at all. NULL: as if all were 0. */
	const double *grain_of;
	int looks;
	/* With an error: cells are cut further until rectangles around them can be within it. NULL, or 0: they are not. */
	const struct dpoint_cover_options *cover;
	/* Tells the attributes of the place v0 + u (v1 - v0) + v (v2 - v0) of a triangle, without a normal. Returns 0 where
	 * there is no surface: then the cell is beyond it. NULL: attributes are 0. */
	int (*look)(void *userdata, uint32_t triangle, double u, double v, uint64_t *attr);
	void *userdata;
};

/* Adds facets, those of triangles, or of the cells that are there where a material has alpha; and a candidate and a
 * cell for each piece of a triangle, with the shape of its corners' curvatures between them.
 * Corners that share place and normal are one: so creases, where a mesh has several normals at a place or none, and
 * borders part the surface, and a strip beyond them keeps rectangles from reaching over. Parts are materials.
 * Triangles of patches are facets alone: dpoint_sample_trimmed() has their pieces. Corners without curvatures (of
 * slivers) count as bad, and flat. MEMORY; LIMIT: more than 2^22 pieces, 2^27 looks, or 4096 pieces along a side; of
 * these only pieces that colours or an error ask for are counted late, as they come. */
int dpoint_sample_mesh(struct dpoint_surface *surface, const struct psr_mesh *mesh,
                       const struct dpoint_mesh_options *options, struct psr_error *err);

#endif
