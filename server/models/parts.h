/* Files that a source of a model names: buffers and images of glTF, the texture of a PLY, material libraries of an OBJ
 * and their textures. Found by their words in the text, without reading the model. */
#ifndef PSRD_PARTS_H
#define PSRD_PARTS_H

#include <stdint.h>

struct parts {
	uint32_t n_named; /* named by the source, existing or not; UINT32_MAX: unknown */
	uint64_t bytes;   /* of existing ones in the source's folder or below, each once */
};

/* 0 and 0 for other formats and unreadable files. Any thread. */
void parts_find(struct parts *parts, const char *source);

#endif
