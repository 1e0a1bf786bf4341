/* OBJ's vertices in double precision. Assimp reads floats, too coarse for scans at survey coordinates. So it gets a
 * text whose vertices are indices into a table of the file's positions. */
#ifndef PSR_IMPORT_ASSIMP_OBJ_H
#define PSR_IMPORT_ASSIMP_OBJ_H

#include "import/import.h"

struct obj {
	uint8_t *text; /* for Assimp; lines other than vertices are the file's */
	size_t n_text;
	double (*position)[3]; /* in the order of the file; need not be finite */
	uint32_t n;
};

int obj_is(const char *path); /* by its ending, as Assimp does */

/* Keeps no reference to `bytes`. FORMAT with the line, LIMIT, MEMORY. Nothing to free on failure. */
int obj_read(struct obj *obj, const char *path, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
void obj_fini(struct obj *obj);

/* Returns the position for the text's coordinates x and y; NAN if there is none. */
void obj_position(double out[3], const struct obj *obj, float x, float y);

/* obj_plain.c: reads files that have nothing but vertices of three numbers, faces of 3 to 64 of them, comments, and
 * names before the first face, as scans do: the same mesh as through Assimp, in a third of the time. Returns 1; 0 for
 * other or broken files, and leaves the mesh empty, which must be; MEMORY, LIMIT. Materials are 0: add that of
 * OBJ_TRIANGLE, as Assimp reads it. */
int obj_read_plain(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
#define OBJ_TRIANGLE "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

#endif
