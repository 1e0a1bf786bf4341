/* Packed files during reading: unpack.c reads what comes before the chunks, unpack_chunks.c the chunks, and prefix.c
 * those of a file that ends early. */
#ifndef PSR_MODEL_UNPACK_H
#define PSR_MODEL_UNPACK_H

#include <zstd.h>
#include "pack.h"

/* A packed file during reading. `head`: header, table, hashes of chunks, directory. */
struct unpacker {
	const struct pack_source *source;
	struct psr_error *err;
	uint8_t header[FILE_HEADER_BYTES];
	uint8_t *head;
	uint64_t table_end, head_end, n_image, packing;
	uint64_t n_file;           /* what the whole file has */
	struct octree octree;      /* what OCTR says, checked; zeros without it */
	int is_octree_alone;       /* INFO speaks of it */
	/* In ways 3 and 4: where in `head` its entry is, its length; where in the file it begins. */
	uint64_t octree_entry, n_octree, octree_at;
	uint32_t n_sections;
	ZSTD_DCtx *context;
	uint8_t *packed, *split; /* a chunk each */
};

/* Text for errors; FORMAT. */
#define bad(u, format, ...) psr_fail((u)->err, PSR_ERR_FORMAT, "%s: " format, (u)->source->name, ##__VA_ARGS__)

static inline const uint8_t *unpack_entry(const struct unpacker *u, uint64_t i)
{
	return u->head + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
}

/* Returns whether the file ends within or behind its packed octree. */
static inline int unpack_is_part(const struct unpacker *u)
{
	return u->n_file > u->source->n_bytes;
}

/* Reads n bytes of the file. FORMAT: they are not there; IO. */
int unpack_fetch(const struct unpacker *u, uint8_t *to, uint64_t at, uint64_t n);

/* Reads everything before the first chunk and checks its hash, before it follows any of it. */
int unpack_read_head(struct unpacker *u);

/* Unpacks all chunks of other sections than the packed octree's into an image with its table: in that of a file that
 * ends early, without those behind the octree, which its table has not. */
int unpack_sections(const struct unpacker *u, uint8_t *image);

/* Reads the first n bytes of the packed octree: whole pieces, or all. */
int unpack_read_octree(const struct unpacker *u, uint8_t *bytes, uint64_t n);

/* Makes the image of a file that ends within its packed octree. */
int unpack_prefix(struct unpacker *u, uint8_t **image, struct pack_facts *facts);

/* Checks the offsets of sections in the image and the sizes of chunks in the file; finds where the octree begins. */
int unpack_check_head(struct unpacker *u);

#endif
