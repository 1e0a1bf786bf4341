/* Octrees for psr-model build: from clouds as they come, and from meshes. */
#ifndef MODELS_OCTREE_H
#define MODELS_OCTREE_H

#include "octree/build/build.h"
#include "psr/mesh.h"

struct octree_wish {
	int levels;          /* 0: by `spacing`, */
	double spacing;      /* or if that is 0 by the number of points, or for a mesh by `resolution` */
	uint32_t resolution; /* pixels; if it decides, a part of a cloud is enough up to PSR_PREVIEW_RESOLUTION */
	uint64_t memory;     /* bytes to sort in */
	int with_scan;       /* leaves keep what a laser scan tells, struct octree_scan */
	void (*on_progress)(const char *stage, uint64_t done, uint64_t total, void *userdata);
	void *userdata;
};

/* Where octrees come from. */
struct octree_input {
	const char *path;
	int is_direct;        /* points are read from the file as they are needed; else `mesh` has them, or triangles */
	const struct psr_mesh *mesh;
	/* Set by octree_make(): */
	uint64_t n_points, n_left_out; /* 0 of triangles; n_left_out: those without a finite place, not among n_points */
	double up[3];
};

/* Tells by its first bytes and its ending whether a file's points are read as they are needed. */
int octree_is_direct(const char *path);

/* Makes a tree in units of the file, which the caller destroys. ARG, NOT_FOUND, IO, FORMAT, UNSUPPORTED, LIMIT,
 * MEMORY. */
int octree_make(struct octree **out, struct octree_input *input, const struct octree_wish *wish, struct psr_error *err);

#endif
