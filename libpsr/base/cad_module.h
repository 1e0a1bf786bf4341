/* The CAD module psr-cad-occ.so, for exact surfaces in STEP and IGES: it stands on Open CASCADE, dozens of libraries.
 * Loaded on demand. */
#ifndef PSR_BASE_CAD_MODULE_H
#define PSR_BASE_CAD_MODULE_H

#include <stdint.h>
#include <stdlib.h>
#include "psr/error.h"
#include "psr/mesh.h"

enum cad_module_doing { CAD_MODULE_PARSES, CAD_MODULE_SHAPES, CAD_MODULE_CUTS };

/* What reading came to; true at any time, also if it never ends. */
struct cad_module_report {
	volatile enum cad_module_doing doing;
	uint32_t n_lacking;      /* entities of shapes with a parameter that refers to nothing, or to what it should not */
	char first_lacking[160]; /* the first one's number, its type, and what is wrong; printable */
};

struct cad_module_source {
	const char *path;
	int is_iges;            /* else STEP */
	double deflection;      /* triangles are off the surface by so much at most, as a part of the longest side */
	double angle;           /* and surface normals turn by so much along a side, radians; both > 0 */
	double rim;             /* above 0: faces come as patches, too, and sides of triangles along edges of faces are off the
	                         * edge by so much at most, likewise as a part of the longest side */
	double patch_deflection; /* with a rim: the first two of parts whose faces all are patches, which tell more of the
	                          * surface than their triangles */
	double patch_angle;
	int most_degree;        /* of patches */
	int n_threads;          /* that may cut faces, of all cores; other readings at the same time change it. The result does
	                         * not depend on it */
	uint64_t max_triangles;
	struct cad_module_report *report;
};

/* Triangles of all faces, in millimetres, with the surface's own normals at their corners. Faces that meet share
 * places, bit by bit, and the normal where they meet smoothly. */
struct cad_module_mesh {
	uint32_t n_vertices, n_triangles, n_colors;
	double (*position)[3];   /* n_vertices */
	float (*normal)[3];      /* of unit length, or 0,0,0 where there is none */
	uint32_t (*triangle)[3]; /* n_triangles, counter-clockwise seen from the outside */
	uint32_t *color_of;      /* n_triangles, < n_colors */
	float (*color)[4];       /* linear; alpha -1: the file has none for these faces */
	uint32_t n_faces, n_left_out; /* faces of the file; those that could not be cut into triangles with an area */
	uint32_t n_patches;
	struct psr_patch *patch; /* n_patches; what they point at is from malloc(); material: < n_colors */
	uint32_t *patch_of;      /* n_triangles: of the triangle's face, or UINT32_MAX; NULL: there are no patches */
	uint32_t n_unlike;       /* faces with triangles, whose surface no such patch is: they have none */
	uint32_t n_open;         /* solids and shells whose faces do not close, by the file's own tolerances */
	char first_left_out[128]; /* the first one's number, and its part's name; printable */
};

/* Frees what a patch points at, on either side of the door: patches may pass through it. */
static inline void cad_patch_free(struct psr_patch *patch)
{
	free(patch->knot[0]);
	free(patch->knot[1]);
	free(patch->control);
	free(patch->corner);
	free(patch->triangle);
	free(patch->rim);
}

/* The types of the module's functions. Reads a file; *out is the caller's, for the function below. FORMAT, LIMIT,
 * MEMORY; then `message` says why, in a few words. */
typedef int cad_module_read(struct cad_module_mesh **out, const struct cad_module_source *source, char *message,
                            unsigned message_size);
typedef void cad_module_destroy(struct cad_module_mesh *mesh); /* NULL is fine */

/* The module exports one of these, named psr_cad_module. Raise the version with every change of this file. */
#define CAD_MODULE_VERSION 5
struct cad_module {
	uint32_t version; /* CAD_MODULE_VERSION of the module's own build; first in every version */
	cad_module_read *read;
	cad_module_destroy *destroy;
};

/* Loads the module, from any thread, as base/module.h says; PSR_CAD_MODULE can name it. Later calls return the same. */
int cad_module_open(const struct cad_module **out, struct psr_error *err);

#endif
