/* The files that a source names: buffers and images of glTF, the texture of a PLY, material libraries of an OBJ and
 * their textures. parts.c finds the words that name them, without reading the model. */
#ifndef PSRD_PARTS_H
#define PSRD_PARTS_H

#include <stdint.h>

struct parts {
	uint32_t n_named; /* files that the source names, existing or not; UINT32_MAX: unknown */
	uint64_t bytes;   /* size of the existing ones in the source's folder or below, each counted once */
};

/* Finds 0 files and 0 bytes for other formats and unreadable files. Any thread. */
void parts_find(struct parts *parts, const char *source);

#endif
