/* What leaves have beside their places, packed: a stream each for normals, offsets, colours and materials. Every value
 * is foretold from the leaves around it that come earlier, so a decoder needs the codes of all levels first. */
#ifndef PSR_OCTREE_ATTRIBUTES_H
#define PSR_OCTREE_ATTRIBUTES_H

#include "coder.h"
#include "levels.h"

/* Of the leaves below some roots, in Morton order; as in struct octree. */
struct octree_attributes {
	uint16_t *normal;
	uint8_t *offset;
	uint8_t (*color)[3];
	uint8_t (*material)[3];
};

enum octree_stream {
	OCTREE_NORMAL_STREAM,
	OCTREE_OFFSET_STREAM, /* by the normals, if there are any: these are unpacked first */
	OCTREE_COLOR_STREAM,
	OCTREE_MATERIAL_STREAM,
	OCTREE_STREAMS
};

/* Appends a stream to a coder that has begun, or reads it into the array, which has room for all leaves; the caller
 * checks coder_is_at_end(). Packing only reads the arrays.
 * Whatever the bytes are, normals are below PSR_DIRECTIONS and offsets below OCTREE_OFFSETS.
 * A normal of 13 bits, its last two zero, takes next to nothing for these two.
 * is_older: 1 reads what ways 0 and 4 of a packed tree have (docs/format.md). MEMORY. */
int octree_attributes_pack(struct coder *coder, const struct octree_levels *levels,
                           const struct octree_attributes *attributes, enum octree_stream stream);
int octree_attributes_unpack(struct octree_attributes *attributes, struct coder *coder,
                             const struct octree_levels *levels, enum octree_stream stream, int is_older);

#endif
