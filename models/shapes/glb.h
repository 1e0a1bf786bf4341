/* Binary glTF 2.0 (GLB) of a shape: one mesh a part, one primitive a material with positions, normals, 32-bit indices
 * and, where the material has a picture, places in it; a node an instance, all of them children of one; the pictures
 * are embedded as PNG. */
#ifndef MODELS_GLB_H
#define MODELS_GLB_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"
#include "shape.h"

/* *bytes, to be freed by the caller, holds the whole file. The same shape and name give the same bytes. MEMORY; ARG for
 * a shape without triangles. */
int glb_encode(uint8_t **bytes, size_t *n_bytes, const struct shape *shape, const char *name, struct psr_error *err);

#endif
