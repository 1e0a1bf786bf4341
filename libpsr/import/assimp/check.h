/* What Assimp takes on trust, checked on both sides of it. */
#ifndef PSR_IMPORT_ASSIMP_CHECK_H
#define PSR_IMPORT_ASSIMP_CHECK_H

#include <assimp/scene.h>
#include "import/import.h"

/* Before: OFF files tell their counts first, and Assimp allocates whatever they say. Each vertex and face takes
 * at least a byte, so a count beyond the file's size is a lie. */
int assimp_check_counts(const struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

/* After reading: no face refers to a vertex that is not there. */
int assimp_check_faces(const struct import_mesh *im, const struct aiScene *scene, struct psr_error *err);

#endif
