/* Assimp's entry point; catches exceptions and assertions. */
#ifndef PSR_IMPORT_ASSIMP_WALL_H
#define PSR_IMPORT_ASSIMP_WALL_H

#include <assimp/cfileio.h>
#include <assimp/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

#define ASSIMP_WHY 300

/* Returns the unprocessed scene, for aiReleaseImport; or NULL, and why. */
const struct aiScene *assimp_read(const char *path, struct aiFileIO *io, char why[ASSIMP_WHY]);

#ifdef __cplusplus
}
#endif
#endif
