/* Packed .psr files (docs/format.md, "Packed files"): the table of the plain file, a directory of chunks, and the
 * compressed chunks. They unpack to the plain file, byte for byte. */
#ifndef PSR_MODEL_PACK_H
#define PSR_MODEL_PACK_H

#include "file.h"
#include "octree/pack.h"

enum { HEADER_PACKING = 28, HEADER_PACKED_SIZE = 48 }; /* zeros in a plain file */
#define PACKING_ZSTD 1
#define PACKING_OCTREE 3 /* the same, and the sections of an octree as octree_pack() makes them, in steps */
#define PACKING_SCAN 4   /* the same, and the scan's sections behind the octree */

/* An entry of the directory. */
#define PACK_ENTRY_BYTES 16
enum { PACK_LENGTH = 0, PACK_METHOD = 4, PACK_STRIDE = 5, PACK_HASH = 8 };

enum pack_method {
	PACK_STORED,      /* the chunk itself */
	PACK_PLAIN,       /* zstd of the chunk */
	PACK_PLANES,      /* zstd of its byte planes */
	PACK_DIFFERENCES, /* zstd of the byte planes of the differences of successive words */
	PACK_XOR,         /* the same with exclusive or */
	PACK_N_METHODS
};
#define PACK_LEVEL 9 /* level 19 saves 2 to 9 % more in ten times the time */

/* Greatest ratio of unpacked to packed size, so that a small file cannot claim all memory. */
#define PACK_MAX_RATIO 64
static inline uint64_t pack_max_image(uint64_t file_bytes)
{
	return PACK_MAX_RATIO * file_bytes + FILE_CHUNK_BYTES;
}

static inline uint64_t pack_chunks(uint64_t length)
{
	return (length + FILE_CHUNK_BYTES - 1) / FILE_CHUNK_BYTES;
}

/* The packed octree is hashed in pieces: a file that ends early is used up to the last whole one. */
#define PACK_PIECE_BYTES ((uint64_t)1 << 14)
static inline uint64_t pack_pieces(uint64_t length)
{
	return length / PACK_PIECE_BYTES + (length % PACK_PIECE_BYTES != 0);
}

/* Words of a chunk: 1, 2, 4 or 8 bytes; no method moves bytes beyond the last whole word. Differences are to the word
 * before, modulo 2^(8 stride), the first word's to 0. */
static inline int pack_is_stride(uint32_t stride)
{
	return stride == 1 || stride == 2 || stride == 4 || stride == 8;
}
void pack_split(uint8_t *out, const uint8_t *chunk, size_t n_bytes, uint32_t stride, enum pack_method method);
void pack_join(uint8_t *chunk, const uint8_t *in, size_t n_bytes, uint32_t stride, enum pack_method method);

/* Ways 3 and 4: behind the directory's entries of other sections are the length of the packed octree and 8 zeros, then
 * an entry for each of its pieces of PACK_PIECE_BYTES, all stored. In way 4 entries of a scan's chunks follow, as the
 * chunks follow the octree: a file that ends early has no scan. */
static inline int pack_has_steps(uint64_t packing)
{
	return packing == PACKING_OCTREE || packing == PACKING_SCAN;
}

enum pack_place { PACK_BEFORE, PACK_IN_OCTREE, PACK_BEHIND };
enum pack_place pack_place(uint64_t packing, const uint8_t *entry); /* of the table */

/* Finds the octree of an image whose sections are inside of it; arrays point there, and have the lengths that its counts
 * ask for. Returns 0 if it has none, or not so. Nothing else is checked. */
int pack_find_octree(struct octree *tree, const uint8_t *image);

/* The source of a packed file: a descriptor, or memory if that is -1. */
struct pack_source {
	int fd;
	const uint8_t *bytes;
	uint64_t n_bytes;
	const char *name;
	const struct psr_cancel *cancel; /* who may stop the unpacking of its octree; NULL: nobody */
};

int pack_is_packed(const uint8_t *header); /* FILE_HEADER_BYTES of them */

/* What a packed file tells beside its image. */
struct pack_facts {
	struct octree_shares shares;    /* of its octree; zeros if that was not packed as one */
	struct psr_model_prefix prefix; /* zeros if the file is whole */
};

/* Unpacks to the plain image, in memory of psr_alloc_huge(), unchecked by file_parse(). A file of an octree that ends
 * early becomes the image of the model of its last whole step. FORMAT, VERSION, IO, MEMORY,
 * CANCELLED. */
int pack_open(uint8_t **image, size_t *n_image, struct pack_facts *facts, const struct pack_source *source,
              struct psr_error *err);

/* The beginnings of a packed octree's file that are models, coarse first: its steps but for the last. */
struct pack_beginning {
	uint32_t levels;
	uint64_t end;  /* of the file: so many bytes are there */
	double part;   /* of the whole octree's leaves */
	uint64_t n_rest; /* of the image: bytes of all but the octree's arrays, the same in each beginning */
};
/* Finds them; *beginning has OCTREE_MOST_STEPS. Returns their number: 0 of a file that is no whole packed octree, or is
 * damaged before them. */
int pack_beginnings(struct pack_beginning *beginning, const struct pack_source *source);

/* For a new model, which nobody else knows: the size of the file that it came from; facts NULL: a plain one. */
void model_set_source(struct psr_model *model, uint64_t file_bytes, const struct pack_facts *facts);
size_t model_own_bytes(void); /* that a model takes beside its image, cubes and points */

/* Reads OCTR of a packed file. Returns 0 if there is none, or anything is wrong with the file. */
int pack_read_octree(uint8_t octree[OCTREE_BYTES], const struct pack_source *source);

/* Packs an image: *n_bytes in memory of psr_alloc_huge() of *capacity bytes. */
int pack_image(uint8_t **out, size_t *n_bytes, size_t *capacity, const uint8_t *image, size_t n_image,
               struct psr_error *err);

/* As file_seal(), for a packed file: hashes of chunks and header. */
void pack_seal(uint8_t *bytes, size_t n_bytes);

#endif
