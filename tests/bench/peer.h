/* What the peers draw: the mesh and the samples as plain arrays, and the camera as they take it.
 *
 * Positions are the model's inner coordinates ([G] 5): relative to its origin, within the unit sphere, so that floats
 * serve. Colors are linear. Textures and vertex colors are left out: none of the benchmark's models has any. */
#ifndef TESTS_BENCH_PEER_H
#define TESTS_BENCH_PEER_H

#include <stdint.h>
#include "scene.h"

struct peer_look {
	float diffuse[3], f0[3], roughness;
};

void peer_look_init(struct peer_look *out, uint64_t attr);

struct peer_mesh {
	uint32_t n_vertices, n_triangles, n_looks;
	float (*position)[3], (*normal)[3]; /* of vertices */
	uint32_t (*triangle)[3];            /* counter-clockwise from the front, look by look */
	uint16_t *triangle_look;
	struct peer_look *look;
};
void peer_mesh_init(struct peer_mesh *out, const struct psr_mesh *mesh, const struct psr_model *model);
void peer_mesh_order(struct peer_mesh *mesh); /* for caches; look by look, then by place; done by init */
/* Makes a mesh whose vertices are the means of those in the same cell of a grid of so many, at most 1024, a side, and of
 * whose triangles those are left that still have three. */
void peer_mesh_merge(struct peer_mesh *out, const struct peer_mesh *of, uint32_t cells);
void peer_mesh_fini(struct peer_mesh *mesh);

struct peer_points {
	uint64_t n;
	float (*position)[3];
	uint64_t *attr; /* as in model/blocks.h */
};
/* The samples of the levels that psr_render draws in frame 0 of a film, before anything is culled. */
void peer_points_init(struct peer_points *out, const struct scene_film *film);
void peer_points_fini(struct peer_points *points);

struct peer_view {
	uint32_t width, height;
	float eye[3], axis[3][3]; /* right, down, forward */
	float focal;              /* pixels */
	float near_z, far_z;
	float to_light[3], ambient;
};
void peer_view_init(struct peer_view *out, const struct scene_film *film, int frame);

/* Of a frame of a film, measured by a peer. */
struct peer_result {
	double ms;      /* median of the frames, the picture in memory */
	double setup_s; /* before the first frame: buffers, trees, shaders */
	int n_frames;
	char what[128]; /* who drew, in its own words */
};

#endif
