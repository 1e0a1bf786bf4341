/* Materials of Assimp's scene as materials of the mesh. */
#ifndef PSR_IMPORT_ASSIMP_MATERIAL_H
#define PSR_IMPORT_ASSIMP_MATERIAL_H

#include <assimp/scene.h>
#include "io.h"

/* Colors of these formats are numbers for a screen: sRGB-coded. 8-bit codes are all that they mean. */
float assimp_linear(float c);

/* Index of the mesh's material for material `m` of the scene, or a negative code. With vertex colors, the gray that
 * Assimp makes up for files without materials becomes white. uv_source[set] is the scene's set of coordinates that the
 * mesh's set is to hold, -1: none. */
int assimp_material(struct assimp_io *io, const struct aiScene *scene, unsigned m, int has_color,
                    int uv_source[PSR_UV_SETS], struct psr_error *err);

#endif
