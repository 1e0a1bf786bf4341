/* Checks of counts and indices that Assimp trusts. */
#ifndef PSR_IMPORT_ASSIMP_CHECK_H
#define PSR_IMPORT_ASSIMP_CHECK_H

#include <assimp/scene.h>
#include "import/import.h"

/* Before reading: refuses OFF files whose counts exceed the file's size, since Assimp allocates by the counts. Each
 * vertex and face takes at least a byte. */
int assimp_check_counts(const struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

/* After reading: refuses faces that refer to missing vertices. */
int assimp_check_faces(const struct import_mesh *im, const struct aiScene *scene, struct psr_error *err);

#endif
