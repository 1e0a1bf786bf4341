/* Assimp's entry point, with everything caught that it throws and asserts. */
#ifndef PSR_IMPORT_ASSIMP_WALL_H
#define PSR_IMPORT_ASSIMP_WALL_H

#include <assimp/cfileio.h>
#include <assimp/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ASSIMP_WHY 300

/* The scene, unprocessed, to be given to aiReleaseImport; or NULL and why. */
const struct aiScene *assimp_read(const char *path, struct aiFileIO *io, char why[ASSIMP_WHY]);

#ifdef __cplusplus
}
#endif
#endif
