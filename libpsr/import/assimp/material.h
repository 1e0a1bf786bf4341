/* Converts materials of Assimp's scene. */
#ifndef PSR_IMPORT_ASSIMP_MATERIAL_H
#define PSR_IMPORT_ASSIMP_MATERIAL_H

#include <assimp/scene.h>
#include "io.h"

/* Converts a color, sRGB-coded in these formats and rounded to 8 bits, to linear light. */
float assimp_linear(float c);

/* Adds material `m` of the scene; returns its index, or a negative code. With vertex colors, Assimp's gray for files
 * without materials becomes white. uv_source[set]: the scene's set of coordinates for the mesh's set; -1: none. */
int assimp_material(struct assimp_io *io, unsigned m, int has_color, int uv_source[PSR_UV_SETS],
                    struct psr_error *err);

#endif
