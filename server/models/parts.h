/* Files that a source of a model names: buffers and images of glTF, the texture of a PLY, material libraries of an OBJ
 * and their textures. Found by their words in the text, without reading the model. */
#ifndef PSRD_PARTS_H
#define PSRD_PARTS_H

#include <stdint.h>

struct parts {
	uint32_t n_named; /* by the source itself, there or not; UINT32_MAX if it cannot be told */
	uint64_t bytes;   /* of those that are there, in the source's folder or below, each once */
};

/* Of other formats, and of files that cannot be read, 0 and 0. On any thread. */
void parts_find(struct parts *parts, const char *source);

#endif
