#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <unistd.h>
#include <xxhash.h>
#include <zstd.h>
#include "base/mem.h"
#include "pack.h"

/* A packed file during reading. `head`: header, table, hashes of chunks, directory. */
struct unpacker {
	const struct pack_source *source;
	struct psr_error *err;
	uint8_t header[FILE_HEADER_BYTES];
	uint8_t *head;
	uint64_t table_end, head_end, n_image;
	uint32_t n_sections;
	ZSTD_DCtx *context;
	uint8_t *packed, *split; /* a chunk each */
};

#define bad(u, format, ...) psr_fail((u)->err, PSR_ERR_FORMAT, "%s: " format, (u)->source->name, ##__VA_ARGS__)

int pack_is_packed(const uint8_t *header)
{
	return file_get(header + HEADER_PACKING, 4) != 0;
}

static int fetch(const struct unpacker *u, uint8_t *to, uint64_t at, uint64_t n)
{
	const struct pack_source *s = u->source;

	if (at > s->n_bytes || n > s->n_bytes - at)
		return bad(u,
		           "the file ends at byte %" PRIu64 ", and bytes %" PRIu64 " to %" PRIu64 " are needed; it was cut short",
		           s->n_bytes, at, at + n);
	if (s->fd < 0) {
		memcpy(to, s->bytes + at, n);
		return PSR_OK;
	}
	for (uint64_t done = 0; done < n;) {
		ssize_t got = pread(s->fd, to + done, n - done, (off_t)(at + done));

		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0)
			return psr_fail(u->err, PSR_ERR_IO, "%s: cannot read the file from byte %" PRIu64 " on: %m", s->name,
			                at + done);
		if (got == 0)
			return bad(u, "the file shrank to %" PRIu64 " bytes while it was read", at + done);
		done += (uint64_t)got;
	}
	return PSR_OK;
}

static const uint8_t *entry_at(const struct unpacker *u, uint64_t i)
{
	return u->head + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
}

/* Reads everything before the first chunk and checks its hash, before it follows any of it. */
static int read_head(struct unpacker *u)
{
	uint64_t n_chunks = 0, size, packing = file_get(u->header + HEADER_PACKING, 4);
	int code;

	if (packing != PACKING_ZSTD)
		return psr_fail(u->err, PSR_ERR_VERSION,
		                "%s: the file is packed in way %" PRIu64 ", and this build knows way %d; "
		                "a newer psr may read it", u->source->name, packing, PACKING_ZSTD);
	size = file_get(u->header + HEADER_PACKED_SIZE, 8);
	u->n_image = file_get(u->header + HEADER_FILE_SIZE, 8);
	u->n_sections = (uint32_t)file_get(u->header + HEADER_N_SECTIONS, 4);
	if (u->n_sections > FILE_MAX_SECTIONS)
		return bad(u, "the header lists %" PRIu32 " sections, more than the %d there can be", u->n_sections,
		           FILE_MAX_SECTIONS);
	if (size > u->source->n_bytes)
		return bad(u, "the file ends at byte %" PRIu64 " of %" PRIu64 "; it was cut short", u->source->n_bytes, size);
	if (size < u->source->n_bytes)
		return bad(u, "%" PRIu64 " bytes follow the end of the file's last chunk", u->source->n_bytes - size);
	if (u->n_image > pack_max_image(size))
		return bad(u, "the header says that %" PRIu64 " bytes unpack to %" PRIu64 "; the limit is %d to 1",
		           size, u->n_image, PACK_MAX_RATIO);
	u->table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * (uint64_t)u->n_sections
	               + 8 * file_get(u->header + HEADER_N_CHUNKS, 4);
	if (u->table_end > size)
		return bad(u, "the section table ends at byte %" PRIu64 ", and the file at byte %" PRIu64, u->table_end, size);
	u->head_end = u->table_end;
	u->head = psr_alloc_array(u->table_end, 1);
	if (u->head == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for its section table", u->source->name);
	code = fetch(u, u->head, 0, u->table_end);
	for (uint32_t i = 0; i < u->n_sections && code == PSR_OK; i++) {
		uint64_t length = file_get(entry_at(u, i) + ENTRY_LENGTH, 8);

		if (length > u->n_image)
			return bad(u, "section %" PRIu32 " has %" PRIu64 " of %" PRIu64 " bytes", i, length, u->n_image);
		n_chunks += pack_chunks(length);
	}
	/* At most 256 sections of 64 times the file: no product overflows. */
	u->head_end = u->table_end + PACK_ENTRY_BYTES * n_chunks;
	if (code == PSR_OK && u->head_end > size)
		return bad(u, "the directory of chunks ends at byte %" PRIu64 ", and the file at byte %" PRIu64, u->head_end,
		           size);
	psr_free(u->head);
	u->head = psr_alloc_array(u->head_end, 1);
	if (u->head == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for its directory of chunks", u->source->name);
	if (code == PSR_OK)
		code = fetch(u, u->head, 0, u->head_end);
	if (code == PSR_OK && (memcmp(u->head, u->header, FILE_HEADER_BYTES) != 0
	                       || file_header_hash(u->head, u->head_end) != file_get(u->head + HEADER_HASH, 8)))
		return bad(u, "the header, the section table or the directory of chunks (bytes 0 to %" PRIu64
		           ") is damaged: their hash differs", u->head_end);
	return code;
}

/* Checks the offsets of sections in the image and the sizes of chunks in the file. */
static int check_head(const struct unpacker *u)
{
	const uint8_t *next = u->head + u->table_end;
	uint64_t image_at = file_align(u->table_end), file_at = u->head_end, n = 0;

	for (uint32_t i = 0; i < u->n_sections; i++) {
		const uint8_t *entry = entry_at(u, i);
		uint64_t offset = file_get(entry + ENTRY_OFFSET, 8), length = file_get(entry + ENTRY_LENGTH, 8);

		if (offset != image_at)
			return bad(u, "section %" PRIu32 " begins at byte %" PRIu64 " instead of %" PRIu64, i, offset, image_at);
		image_at = file_align(image_at + length);
		for (uint64_t first = 0; first < length; first += FILE_CHUNK_BYTES, next += PACK_ENTRY_BYTES, n++) {
			uint64_t size = length - first < FILE_CHUNK_BYTES ? length - first : FILE_CHUNK_BYTES;
			uint64_t packed = file_get(next + PACK_LENGTH, 4);

			if (next[PACK_METHOD] >= PACK_N_METHODS || !pack_is_stride(next[PACK_STRIDE])
			    || file_get(next + 6, 2) != 0)
				return bad(u, "chunk %" PRIu64 " is packed by method %d in words of %d bytes, which is unknown", n,
				           next[PACK_METHOD], next[PACK_STRIDE]);
			if (next[PACK_METHOD] == PACK_STORED ? packed != size : packed >= size || packed == 0)
				return bad(u, "chunk %" PRIu64 " of %" PRIu64 " bytes is packed into %" PRIu64, n, size, packed);
			file_at += packed;
		}
	}
	if (image_at + FILE_TAIL_BYTES != u->n_image)
		return bad(u, "the header says %" PRIu64 " bytes, and the sections have %" PRIu64, u->n_image,
		           image_at + FILE_TAIL_BYTES);
	if (file_at != u->source->n_bytes)
		return bad(u, "the chunks end at byte %" PRIu64 ", and the file at byte %" PRIu64, file_at, u->source->n_bytes);
	return PSR_OK;
}

static int unpack_chunk(const struct unpacker *u, uint8_t *to, uint64_t size, const uint8_t *entry, uint64_t at,
                        uint64_t number)
{
	uint64_t packed = file_get(entry + PACK_LENGTH, 4);
	enum pack_method method = entry[PACK_METHOD];
	size_t got;
	int code = fetch(u, u->packed, at, packed);

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
	uint8_t blocks[BLOCKS_BYTES], octree[OCTREE_BYTES];
	int has_blocks, has_octree;
};

static int is_section(const uint8_t *entry, enum section_id id, uint64_t length)
{
	return memcmp(entry + ENTRY_TYPE, section_table[id].type, 4) == 0 && file_get(entry + ENTRY_LENGTH, 8) == length;
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
	return NULL;
}

/* Unpacks all chunks into the image; or, if that is NULL, the counts alone. */
static int unpack_chunks(const struct unpacker *u, uint8_t *image, struct counts *counts)
{
	const uint8_t *next = u->head + u->table_end;
	uint64_t at = u->head_end, n = 0;

	for (uint32_t i = 0; i < u->n_sections; i++) {
		const uint8_t *entry = entry_at(u, i);
		uint64_t offset = file_get(entry + ENTRY_OFFSET, 8), length = file_get(entry + ENTRY_LENGTH, 8);

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

/* Compares lengths of known sections with the counts in BLKS and OCTR before allocating; file_parse() reports other
 * errors better. */
static int check_lengths(const struct unpacker *u)
{
	struct counts counts = { .has_blocks = 0 };
	struct content content = { .has_blocks = 0 };
	int code = unpack_chunks(u, NULL, &counts);

	content.has_blocks = counts.has_blocks;
	content.has_octree = counts.has_octree;
	if (code == PSR_OK && counts.has_blocks) {
		file_get_counts(&content.blocks, counts.blocks);
		if (content.blocks.n_samples > (uint64_t)PSR_BLOCK_SAMPLES * content.blocks.n_blocks)
			code = bad(u, "section BLKS: %" PRIu64 " samples do not fit %" PRIu32 " blocks", content.blocks.n_samples,
			           content.blocks.n_blocks);
	}
	if (code == PSR_OK && counts.has_octree) {
		file_get_octree(&content.octree, counts.octree);
		code = model_check_octree_counts(&content.octree, u->source->name, u->err);
	}
	for (uint32_t i = 0; i < u->n_sections && code == PSR_OK; i++) {
		const uint64_t length = file_get(entry_at(u, i) + ENTRY_LENGTH, 8);

		for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS && code == PSR_OK; k++) {
			const struct section_spec *spec = &section_table[k];

			if (spec->pointer != 0 && !section_is_foreign(spec, &content) && memcmp(entry_at(u, i), spec->type, 4) == 0
			    && file_get(entry_at(u, i) + ENTRY_VERSION, 2) == spec->version
			    && length != spec->item_bytes * section_items(spec, &content))
				code = bad(u, "section %s has %" PRIu64 " bytes and should have %" PRIu64, spec->type, length,
				           spec->item_bytes * section_items(spec, &content));
		}
	}
	return code;
}

static int make_image(struct unpacker *u, uint8_t **out)
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
	code = unpack_chunks(u, image, NULL);
	if (code != PSR_OK) {
		psr_free_huge(image, u->n_image);
		return code;
	}
	*out = image;
	return PSR_OK;
}

int pack_open(uint8_t **image, size_t *n_image, const struct pack_source *source, struct psr_error *err)
{
	struct unpacker u = { .source = source, .err = err };
	int code = fetch(&u, u.header, 0, FILE_HEADER_BYTES);

	if (code == PSR_OK)
		code = read_head(&u);
	if (code == PSR_OK)
		code = check_head(&u);
	if (code == PSR_OK) {
		u.context = ZSTD_createDCtx();
		u.packed = psr_alloc_array(FILE_CHUNK_BYTES, 1);
		u.split = psr_alloc_array(FILE_CHUNK_BYTES, 1);
		if (u.context == NULL || u.packed == NULL || u.split == NULL)
			code = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to unpack it", source->name);
	}
	if (code == PSR_OK)
		code = check_lengths(&u);
	if (code == PSR_OK)
		code = make_image(&u, image);
	if (code == PSR_OK)
		*n_image = u.n_image;
	ZSTD_freeDCtx(u.context);
	psr_free(u.head);
	psr_free(u.packed);
	psr_free(u.split);
	return code;
}

void pack_seal(uint8_t *bytes, size_t n_bytes)
{
	uint64_t n_sections = file_get(bytes + HEADER_N_SECTIONS, 4), n_chunks = 0, at, head_end, table_end;

	table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * file_get(bytes + HEADER_N_CHUNKS, 4);
	if (n_sections > FILE_MAX_SECTIONS || table_end > n_bytes)
		return;
	for (uint64_t i = 0; i < n_sections; i++) {
		uint64_t length = file_get(bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i + ENTRY_LENGTH, 8);

		n_chunks += length / FILE_CHUNK_BYTES + (length % FILE_CHUNK_BYTES != 0);
	}
	if (n_chunks > (n_bytes - table_end) / PACK_ENTRY_BYTES)
		return;
	at = head_end = table_end + PACK_ENTRY_BYTES * n_chunks;
	for (uint64_t i = 0; i < n_chunks; i++) {
		uint8_t *entry = bytes + table_end + PACK_ENTRY_BYTES * i;
		uint64_t length = file_get(entry + PACK_LENGTH, 4);

		if (length > n_bytes - at)
			break;
		file_put(entry + PACK_HASH, 8, XXH64(bytes + at, length, 0));
		at += length;
	}
	file_put(bytes + HEADER_HASH, 8, file_header_hash(bytes, head_end));
}
