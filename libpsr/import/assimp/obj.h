/* OBJ's vertices in doubles. Assimp reads them as floats, which lose the triangles of a scan at survey coordinates.
 * So it gets a text whose vertices are numbered: each line "v ..." says a place in a table of what the file says. */
#ifndef PSR_IMPORT_ASSIMP_OBJ_H
#define PSR_IMPORT_ASSIMP_OBJ_H

#include "import/import.h"

struct obj {
	uint8_t *text; /* for Assimp; all lines but the vertices' are the file's */
	size_t n_text;
	double (*position)[3]; /* of each vertex in the order of the file; may be not finite */
	uint32_t n;
};

int obj_is(const char *path); /* by its ending, as Assimp does */

/* `bytes` may go afterwards. FORMAT with the line, LIMIT, MEMORY. Nothing to free on failure. */
int obj_read(struct obj *obj, const char *path, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);
void obj_fini(struct obj *obj);

/* The position that the text's coordinates x and y stand for; NAN if they stand for none. */
void obj_position(double out[3], const struct obj *obj, float x, float y);

#endif
