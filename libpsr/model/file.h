/* The .psr file: constants of docs/format.md, the table of known sections, and functions that the files of this folder
 * share. A model in memory is the image of its file, byte for byte, with pointers into it. */
#ifndef PSR_MODEL_FILE_H
#define PSR_MODEL_FILE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include "model/blocks.h"
#include "model/calibration.h"
#include "model/points.h"
#include "model/tree.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "sections are used in place, and they are little-endian");

#define FILE_MAGIC "\x89PSR\r\n\x1a\n"
#define FILE_MAJOR 6
#define FILE_MINOR 0 /* of files without octrees, which are as before these */
#define FILE_MINOR_OCTREE 1
#define FILE_MINOR_POINTS 2
#define FILE_MINOR_SCAN 3
#define FILE_MINOR_MATERIAL 4
#define FILE_MINOR_DELTAS 5
#define FILE_MINOR_OFF 6 /* blocks: but for those of the trait off, samples are within PSR_SAMPLE_OFF */
#define FILE_MINOR_LEAN 7
#define FILE_MINOR_POINT_LEAN 8
#define FILE_ALIGNMENT 64
#define FILE_TAIL_BYTES 128 /* zeros at the end: kernels read up to 64 depths beyond a section */
#define FILE_HEADER_BYTES 64
#define FILE_ENTRY_BYTES 32
#define FILE_CHUNK_BYTES ((uint64_t)1 << 20)
#define FILE_MAX_SECTIONS 256

#define MODEL_MAX_BLOCKS ((uint32_t)1 << 26)
#define MODEL_MAX_PROJECTIONS ((uint32_t)1 << 8)
#define MODEL_LEAST_SPACING 0x1p-14f  /* finer lattices would exceed the precision of spheres */
#define MODEL_MAX_COORDINATE 1024.0f /* magnitude of any length or coordinate inside of a model */
#define MODEL_MAX_LEAVES ((uint64_t)1 << 32)

/* Byte offsets in the header, and in an entry of the table. */
enum { HEADER_MAJOR = 8, HEADER_MINOR = 10, HEADER_N_SECTIONS = 12, HEADER_FILE_SIZE = 16, HEADER_N_CHUNKS = 24,
       HEADER_CONTENT_ID = 32, HEADER_HASH = 56 };
enum { ENTRY_TYPE = 0, ENTRY_VERSION = 4, ENTRY_FLAGS = 6, ENTRY_OFFSET = 8, ENTRY_LENGTH = 16, ENTRY_HASH = 24 };
enum { ENTRY_REQUIRED = 1 };

/* The unit of a section's length. */
enum section_count {
	COUNT_ONE, COUNT_CAMERAS, COUNT_LIGHTS, COUNT_PROJECTIONS, COUNT_CLUSTERS, COUNT_RUNS, COUNT_MASKS, COUNT_BLOCKS,
	COUNT_SAMPLES, COUNT_SKIPS, COUNT_CODES, COUNT_LEAVES, COUNT_CALIBRATED, COUNT_GROUPS, COUNT_POINTS,
	COUNT_DELTAS, COUNT_LEAN, COUNT_POINT_LEAN
};

enum section_id { SECTION_INFO, SECTION_BLOCKS, SECTION_CAMERAS, SECTION_LIGHTS, SECTION_FIRST_ARRAY,
	              SECTION_OCTREE = 25, SECTION_FIRST_OF_OCTREE, SECTION_MATERIAL = 31, SECTION_END_OF_OCTREE,
	              SECTION_CALIBRATION = 32, SECTION_POINTS, SECTION_FIRST_OF_POINTS, SECTION_FIRST_OF_SCAN = 36,
	              SECTION_END_OF_SCAN = 41,
	              SECTION_CALIBRATION_FINE = 41, SECTION_ONE_MATERIAL, SECTION_DELTAS, SECTION_LEAN,
	              SECTION_POINT_LEAN, N_KNOWN_SECTIONS };

static inline int section_is_of_points(int id)
{
	return id == SECTION_DELTAS || id == SECTION_POINT_LEAN || (id >= SECTION_POINTS && id < SECTION_FIRST_OF_SCAN);
}

struct section_spec {
	char type[5];
	uint16_t version, flags;
	enum section_count count;
	uint32_t item_bytes;
	size_t pointer; /* offset of the array's pointer in struct content; 0: not an array */
};

#define INFO_BYTES 184
#define BLOCKS_BYTES 32
#define CAMERA_BYTES 168
#define LIGHT_BYTES 168
#define OCTREE_BYTES 64
#define CALIBRATED_BYTES 96
#define CALIBRATED_FINE_BYTES 8
#define POINTS_BYTES 16

extern const struct section_spec section_table[N_KNOWN_SECTIONS];

static inline uint64_t file_get(const uint8_t *at, int n_bytes)
{
	uint64_t v = 0;

	for (int i = 0; i < n_bytes; i++)
		v |= (uint64_t)at[i] << 8 * i;
	return v;
}

static inline void file_put(uint8_t *at, int n_bytes, uint64_t v)
{
	for (int i = 0; i < n_bytes; i++)
		at[i] = (uint8_t)(v >> 8 * i);
}

static inline double file_get_double(const uint8_t *at)
{
	uint64_t bits = file_get(at, 8);
	double v;

	memcpy(&v, &bits, sizeof v);
	return v;
}

static inline void file_put_double(uint8_t *at, double v)
{
	uint64_t bits;

	memcpy(&bits, &v, sizeof bits);
	file_put(at, 8, bits);
}

static inline uint64_t file_align(uint64_t offset)
{
	return (offset + FILE_ALIGNMENT - 1) / FILE_ALIGNMENT * FILE_ALIGNMENT;
}

/* Returns how many chunk hashes follow the table for a section of this length: one a chunk, none for a single chunk. */
static inline uint64_t file_chunks(uint64_t length)
{
	return length > FILE_CHUNK_BYTES ? (length + FILE_CHUNK_BYTES - 1) / FILE_CHUNK_BYTES : 0;
}

/* The contents of a model: structures by value, arrays by pointer. */
struct content {
	struct psr_model_info info;
	struct psr_presets presets;
	int has_blocks, has_octree, has_points; /* one at least; the other representations are all zeros */
	struct psr_blocks blocks;
	struct octree octree;
	struct dpoint_set points;
	struct psr_calibration calibration;
};

/* The number of items of a known section in this model. section_array(): NULL for what is not an array, too. */
uint64_t section_items(const struct section_spec *spec, const struct content *content);
const void *section_array(const struct section_spec *spec, const struct content *content);

/* Returns whether its representation is not without this section. */
static inline int section_is_needed(const struct section_spec *spec)
{
	return (spec->flags & ENTRY_REQUIRED) != 0 || spec->count == COUNT_SKIPS || spec->count == COUNT_CODES
	       || spec->count == COUNT_GROUPS || spec->count == COUNT_POINTS;
}

/* Returns whether a section belongs to a representation that the model has not. */
int section_is_foreign(const struct section_spec *spec, const struct content *content);

/* Returns whether an entry of the table is of this known section, in the version that is known. */
static inline int file_is_section(const uint8_t *entry, int section)
{
	return memcmp(entry + ENTRY_TYPE, section_table[section].type, 4) == 0
	       && file_get(entry + ENTRY_VERSION, 2) == section_table[section].version;
}

/* Reads the counts of BLKS from its BLOCKS_BYTES, unchecked. */
void file_get_counts(struct psr_blocks *blocks, const uint8_t *at);

/* OCTR: to and from its OCTREE_BYTES, unchecked. */
void file_put_octree(uint8_t *at, const struct octree *tree);
void file_get_octree(struct octree *tree, const uint8_t *at);

/* Makes the file image of a model, in memory of psr_alloc_huge(), with hashes. Counts must be within the limits and all
 * but optional pointers set; the reader checks the rest. NULL without memory. */
uint8_t *file_image_make(const struct content *content, uint64_t *n_bytes);

/* Computes all hashes of an image: chunks, sections, content id, header. Ignores parts outside of the image, so that
 * tests can seal any bytes. */
void file_seal(uint8_t *bytes, size_t n_bytes);

/* Computes the hash of an entry: of the section, or of the list of its chunks' hashes (at `chunks`, already
 * computed). */
uint64_t file_section_hash(const uint8_t *section, uint64_t length, const uint8_t *chunks);
uint64_t file_header_hash(const uint8_t *bytes, uint64_t table_end);
void file_content_id(const uint8_t *bytes, uint32_t n_sections, uint8_t id[16]);

/* DPNT: to and from its POINTS_BYTES, unchecked. */
void file_put_points(uint8_t *at, const struct dpoint_set *set);
void file_get_points(struct dpoint_set *set, const uint8_t *at);
uint32_t file_lean_count(uint64_t length); /* of a section DLEN of that length, to which it is cut down */

/* Checks the fixed part of a header of FILE_HEADER_BYTES; `name` begins the error text. */
int file_check_header(const uint8_t *header, const char *name, struct psr_error *err);

/* Checks everything; fills `content` with the values of the image and pointers into it. The image must be aligned to
 * FILE_ALIGNMENT and outlive them. FORMAT, VERSION, UNSUPPORTED, MEMORY. */
int file_parse(const uint8_t *bytes, size_t n_bytes, struct psr_pool *pool, const char *name, struct content *content,
               struct psr_error *err);

/* Checks all values by the rules of docs/format.md; lengths of arrays must be right. */
int model_validate(const struct content *content, struct psr_pool *pool, const char *name, struct psr_error *err);

/* Checks CAMS and LGTS for model_validate(); *section: the broken one on failure. */
int presets_validate(const struct psr_presets *presets, const char **section, struct psr_error *err);

int calibration_validate(const struct psr_calibration *calibration, struct psr_error *err); /* the values of CALB, CALF */

/* Check a tree for psr_model_create() and model_validate(): what its arrays are, and what is in them. */
int model_check_octree_counts(const struct octree *tree, const char *name, struct psr_error *err);
int model_validate_octree(const struct octree *tree, struct psr_pool *pool, const char *name, struct psr_error *err);

/* The same of differential points. */
int model_check_point_counts(const struct dpoint_set *set, const char *name, struct psr_error *err);
int model_validate_points(const struct dpoint_set *set, const char *name, struct psr_error *err);

/* Copy presets, with zeros after names, in padding and in unused fields, as in files. */
void preset_put_cameras(struct psr_preset_camera *to, const struct psr_preset_camera *from, uint32_t n);
void preset_put_lights(struct psr_preset_light *to, const struct psr_preset_light *from, uint32_t n);

/* Estimates the bytes of cubes that the model of a file will have; 0: none, or the file does not tell. */
struct pack_source;
uint64_t model_cubes_need(const struct pack_source *source, int is_packed);

/* Makes a model of an image, which it takes, on failure too. Errors of file_parse(). */
int model_adopt(struct psr_model **out, const uint8_t *bytes, size_t n_bytes, int is_mapped, const char *name,
                struct psr_error *err);

/* Returns the image of a model, for the writer; and what it contains. */
const uint8_t *model_image(const struct psr_model *model, size_t *n_bytes);
const struct content *model_content(const struct psr_model *model);

#endif
