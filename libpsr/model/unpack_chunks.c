#include <inttypes.h>
#include <xxhash.h>
#include "base/mem.h"
#include "unpack.h"

static int unpack_chunk(const struct unpacker *u, uint8_t *to, uint64_t size, const uint8_t *entry, uint64_t at,
                        uint64_t number)
{
	uint64_t packed = file_get(entry + PACK_LENGTH, 4);
	enum pack_method method = entry[PACK_METHOD];
	size_t got;
	int code = unpack_fetch(u, u->packed, at, packed);

	if (code != PSR_OK)
		return code;
	if (XXH64(u->packed, packed, 0) != file_get(entry + PACK_HASH, 8))
		return bad(u, "chunk %" PRIu64 " at byte %" PRIu64 " is damaged: its hash differs", number, at);
	if (method == PACK_STORED) {
		memcpy(to, u->packed, size);
		return PSR_OK;
	}
	got = ZSTD_decompressDCtx(u->context, method == PACK_PLAIN ? to : u->split, size, u->packed, packed);
	if (ZSTD_isError(got) || got != size)
		return bad(u, "chunk %" PRIu64 " at byte %" PRIu64 " does not unpack to %" PRIu64 " bytes", number, at, size);
	if (method != PACK_PLAIN)
		pack_join(to, u->split, size, entry[PACK_STRIDE], method);
	return PSR_OK;
}

/* The sections that say how long the others are. */
struct counts {
	uint8_t blocks[BLOCKS_BYTES], octree[OCTREE_BYTES], points[POINTS_BYTES];
	int has_blocks, has_octree, has_points;
};

static int is_section(const uint8_t *entry, enum section_id id, uint64_t length)
{
	return file_is_section(entry, (int)id) && file_get(entry + ENTRY_LENGTH, 8) == length;
}

/* Returns where a section goes that is one of these, or NULL. */
static uint8_t *counts_place(struct counts *counts, const uint8_t *entry)
{
	if (is_section(entry, SECTION_BLOCKS, BLOCKS_BYTES)) {
		counts->has_blocks = 1;
		return counts->blocks;
	}
	if (is_section(entry, SECTION_OCTREE, OCTREE_BYTES)) {
		counts->has_octree = 1;
		return counts->octree;
	}
	if (is_section(entry, SECTION_POINTS, POINTS_BYTES)) {
		counts->has_points = 1;
		return counts->points;
	}
	return NULL;
}

/* Unpacks the chunks of this place into the image, where its table says; or, if that is NULL, the counts alone. */
static int unpack_place(const struct unpacker *u, uint8_t *image, struct counts *counts, enum pack_place of)
{
	const uint64_t n_pieces = pack_pieces(u->n_octree);
	const int is_behind = of == PACK_BEHIND;
	const uint8_t *next = u->head + (is_behind ? u->octree_entry + PACK_ENTRY_BYTES * (1 + n_pieces) : u->table_end);
	uint64_t at = is_behind ? u->octree_at + u->n_octree : u->head_end;
	uint64_t n = is_behind ? (u->octree_entry - u->table_end) / PACK_ENTRY_BYTES + n_pieces : 0;
	const uint8_t *to_entry = image != NULL ? image + FILE_HEADER_BYTES : NULL;

	for (uint32_t i = 0; i < u->n_sections; i++) {
		const uint8_t *entry = unpack_entry(u, i);
		const enum pack_place place = pack_place(u->packing, entry);
		uint64_t length = file_get(entry + ENTRY_LENGTH, 8), offset = 0;

		if (image != NULL && !(unpack_is_part(u) && place == PACK_BEHIND)) {
			offset = file_get(to_entry + ENTRY_OFFSET, 8);
			to_entry += FILE_ENTRY_BYTES;
		}
		if (place != of)
			continue;
		for (uint64_t first = 0; first < length; first += FILE_CHUNK_BYTES, next += PACK_ENTRY_BYTES, n++) {
			uint64_t size = length - first < FILE_CHUNK_BYTES ? length - first : FILE_CHUNK_BYTES;
			uint8_t *to = image != NULL ? image + offset + first : counts_place(counts, entry);
			int code = to != NULL ? unpack_chunk(u, to, size, next, at, n) : PSR_OK;

			if (code != PSR_OK)
				return code;
			at += file_get(next + PACK_LENGTH, 4);
		}
	}
	return PSR_OK;
}

static int read_counts(const struct unpacker *u, struct counts *counts)
{
	return unpack_place(u, NULL, counts, PACK_BEFORE);
}

int unpack_sections(const struct unpacker *u, uint8_t *image)
{
	const int code = unpack_place(u, image, NULL, PACK_BEFORE);

	return code == PSR_OK && u->packing == PACKING_SCAN && !unpack_is_part(u) ? unpack_place(u, image, NULL, PACK_BEHIND)
	                                                                          : code;
}

int unpack_read_octree(const struct unpacker *u, uint8_t *bytes, uint64_t n)
{
	const uint64_t file_at = u->octree_at;
	const uint8_t *entry = u->head + u->octree_entry;
	int code = PSR_OK;

	for (uint64_t first = 0; first < n && code == PSR_OK; first += PACK_PIECE_BYTES) {
		entry += PACK_ENTRY_BYTES;
		code = unpack_fetch(u, bytes + first, file_at + first, file_get(entry + PACK_LENGTH, 4));
		if (code == PSR_OK && XXH64(bytes + first, file_get(entry + PACK_LENGTH, 4), 0) != file_get(entry + PACK_HASH, 8))
			code = bad(u, "the packed octree is damaged at byte %" PRIu64 ": its hash differs", file_at + first);
	}
	return code;
}

/* How many points DLEN says that lean: its length is all that does. */
static uint32_t lean_of(const struct unpacker *u)
{
	for (uint32_t i = 0; i < u->n_sections; i++)
		if (file_is_section(unpack_entry(u, i), SECTION_POINT_LEAN))
			return file_lean_count(file_get(unpack_entry(u, i) + ENTRY_LENGTH, 8));
	return 0;
}

/* Compares lengths of known sections with the counts in BLKS, OCTR and DPNT before allocating; file_parse() reports other
 * errors better, that of CALF among them. */
static int check_lengths(struct unpacker *u)
{
	struct counts counts = { .has_blocks = 0 };
	struct content content = { .has_blocks = 0 };
	int code = read_counts(u, &counts);

	content.has_blocks = counts.has_blocks;
	content.has_octree = counts.has_octree;
	content.has_points = counts.has_points;
	if (code == PSR_OK && counts.has_blocks) {
		file_get_counts(&content.blocks, counts.blocks);
		if (content.blocks.n_samples > (uint64_t)PSR_BLOCK_SAMPLES * content.blocks.n_blocks)
			code = bad(u, "section BLKS: %" PRIu64 " samples do not fit %" PRIu32 " blocks", content.blocks.n_samples,
			           content.blocks.n_blocks);
	}
	if (code == PSR_OK && counts.has_octree) {
		file_get_octree(&content.octree, counts.octree);
		code = model_check_octree_counts(&content.octree, u->source->name, u->err);
		u->octree = content.octree;
		u->is_octree_alone = !counts.has_blocks && !counts.has_points;
	}
	if (code == PSR_OK && counts.has_points) {
		file_get_points(&content.points, counts.points);
		content.points.n_lean = lean_of(u);
		code = model_check_point_counts(&content.points, u->source->name, u->err);
	}
	for (uint32_t i = 0; i < u->n_sections && code == PSR_OK; i++) {
		const uint64_t length = file_get(unpack_entry(u, i) + ENTRY_LENGTH, 8);

		for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS && code == PSR_OK; k++) {
			const struct section_spec *spec = &section_table[k];

			if (spec->pointer != 0 && spec->count != COUNT_CALIBRATED && !section_is_foreign(spec, &content)
			    && memcmp(unpack_entry(u, i), spec->type, 4) == 0
			    && file_get(unpack_entry(u, i) + ENTRY_VERSION, 2) == spec->version
			    && length != spec->item_bytes * section_items(spec, &content))
				code = bad(u, "section %s has %" PRIu64 " bytes and should have %" PRIu64, spec->type, length,
				           spec->item_bytes * section_items(spec, &content));
		}
	}
	return code;
}

/* Reads the packed octree and unpacks it into its sections. All other chunks are in the image. */
static int unpack_octree(struct unpacker *u, uint8_t *image, struct octree_shares *shares)
{
	struct psr_error what = { 0 };
	struct psr_pool *pool = NULL;
	struct octree tree;
	uint8_t *bytes;
	int code = PSR_OK;

	if (!pack_find_octree(&tree, image))
		return bad(u, "an octree is packed, and its sections OCTR, OSKP or OCOD are missing");
	bytes = psr_alloc_huge(u->n_octree);
	if (bytes == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for a packed octree", u->source->name);
	code = unpack_read_octree(u, bytes, u->n_octree);
	if (code == PSR_OK && tree.n_leaves > OCTREE_CHUNK)
		code = psr_pool_create(&pool, psr_pool_all_cores(), u->err);
	if (code == PSR_OK) {
		code = octree_unpack_into(&tree, bytes, u->n_octree, &(struct octree_crew){ pool, u->source->cancel }, &what);
		if (code != PSR_OK)
			psr_fail(u->err, code, "%s: %s", u->source->name, what.text);
		octree_packed_shares(shares, bytes, u->n_octree);
	}
	psr_pool_destroy(pool);
	psr_free_huge(bytes, u->n_octree);
	return code;
}

static int make_image(struct unpacker *u, uint8_t **out, struct octree_shares *shares)
{
	uint8_t *image = psr_alloc_huge(u->n_image);
	int code;

	if (image == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for a model of %" PRIu64 " bytes", u->source->name,
		                u->n_image);
	memcpy(image, u->head, u->table_end);
	file_put(image + HEADER_PACKING, 4, 0);
	file_put(image + HEADER_PACKED_SIZE, 8, 0);
	file_put(image + HEADER_HASH, 8, file_header_hash(image, u->table_end));
	code = unpack_sections(u, image);
	if (code == PSR_OK && pack_has_steps(u->packing))
		code = unpack_octree(u, image, shares);
	if (code != PSR_OK) {
		psr_free_huge(image, u->n_image);
		return code;
	}
	*out = image;
	return PSR_OK;
}

/* Reads and checks all before the chunks, and takes the memory to unpack these. unpacker_fini() is due even on failure. */
static int unpacker_init(struct unpacker *u, const struct pack_source *source, struct psr_error *err)
{
	int code;

	*u = (struct unpacker){ .source = source, .err = err };
	code = unpack_fetch(u, u->header, 0, FILE_HEADER_BYTES);
	if (code == PSR_OK)
		code = unpack_read_head(u);
	if (code == PSR_OK)
		code = unpack_check_head(u);
	if (code != PSR_OK)
		return code;
	u->context = ZSTD_createDCtx();
	u->packed = psr_alloc_array(FILE_CHUNK_BYTES, 1);
	u->split = psr_alloc_array(FILE_CHUNK_BYTES, 1);
	if (u->context == NULL || u->packed == NULL || u->split == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to unpack it", source->name);
	return PSR_OK;
}

static void unpacker_fini(struct unpacker *u)
{
	ZSTD_freeDCtx(u->context);
	psr_free(u->head);
	psr_free(u->packed);
	psr_free(u->split);
}

int pack_read_octree(uint8_t octree[OCTREE_BYTES], const struct pack_source *source)
{
	struct counts counts = { .has_blocks = 0 };
	struct unpacker u;
	int code = unpacker_init(&u, source, NULL);

	if (code == PSR_OK)
		code = read_counts(&u, &counts);
	unpacker_fini(&u);
	memcpy(octree, counts.octree, OCTREE_BYTES);
	return code == PSR_OK && counts.has_octree;
}

int pack_open(uint8_t **image, size_t *n_image, struct pack_facts *facts, const struct pack_source *source,
              struct psr_error *err)
{
	struct unpacker u;
	int code = unpacker_init(&u, source, err);

	*facts = (struct pack_facts){ .prefix = { .levels = 0 } };
	if (code == PSR_OK)
		code = check_lengths(&u);
	if (code == PSR_OK)
		code = unpack_is_part(&u) ? unpack_prefix(&u, image, facts) : make_image(&u, image, &facts->shares);
	if (code == PSR_OK)
		*n_image = u.n_image;
	unpacker_fini(&u);
	return code;
}
