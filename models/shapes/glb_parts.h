/* Shared by the parts of the GLB writer. */
#ifndef MODELS_GLB_PARTS_H
#define MODELS_GLB_PARTS_H

#include <stdint.h>
#include "shape.h"

/* Vertices and triangles sorted by part and, within it, by material: group = part * n_materials + material. */
struct glb_sorted {
	uint32_t n_groups;
	uint32_t n_vertices;   /* a vertex that two groups use counts twice */
	uint32_t *vertex;      /* sorted index -> index in the shape */
	uint32_t *index;       /* 3 a triangle, relative to the first vertex of its group */
	uint32_t *vertex_first, *index_first; /* n_groups + 1 */
};

/* The buffer's parts, one after the other. */
enum { GLB_POSITIONS, GLB_NORMALS, GLB_INDICES, GLB_PLACES, GLB_IMAGES };

struct glb_layout {
	uint32_t n_views, bytes;
	uint32_t start[GLB_IMAGES + SHAPE_MAX_IMAGES + 1]; /* n_views + 1 */
};

/* The JSON chunk's text, to be freed with cJSON_free; NULL if memory ran out. */
char *glb_json(const struct shape *shape, const struct glb_sorted *sorted, const struct glb_layout *layout,
               const char *name);

#endif
