/* Converts textures of Assimp's scene to images and textures of the mesh. */
#ifndef PSR_IMPORT_ASSIMP_TEXTURE_H
#define PSR_IMPORT_ASSIMP_TEXTURE_H

#include <assimp/material.h>
#include <assimp/scene.h>
#include "io.h"

/* Sets *out to the material's first texture of a type; leaves it alone if there is none, or its file is missing (with a
 * warning). uv_source[set]: the scene's set of coordinates for the mesh's set; -1: free. */
int assimp_texture(struct psr_texture *out, struct assimp_io *io, const struct aiMaterial *m, enum aiTextureType type,
                   int uv_source[PSR_UV_SETS], struct psr_error *err);

/* Multiplies an opacity map into the alpha of the base texture, and sets the material's alpha mode. */
int assimp_opacity(struct psr_material *out, struct assimp_io *io, const struct psr_texture *opacity,
                   struct psr_error *err);

/* Makes one texture of two; either may be missing (image -1). */
int assimp_metallic_roughness(struct psr_material *out, struct assimp_io *io, const struct psr_texture *metallic,
                              const struct psr_texture *roughness, struct psr_error *err);

#endif
