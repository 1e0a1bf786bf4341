#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <unistd.h>
#include <xxhash.h>
#include "base/mem.h"
#include "unpack.h"

int pack_is_packed(const uint8_t *header)
{
	return file_get(header + HEADER_PACKING, 4) != 0;
}

int unpack_fetch(const struct unpacker *u, uint8_t *to, uint64_t at, uint64_t n)
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

/* Adds the octree's entry and those of its pieces. */
static int read_octree_entry(struct unpacker *u, uint64_t size, uint64_t *n_chunks)
{
	uint8_t entry[PACK_ENTRY_BYTES];
	int code;

	u->octree_entry = u->table_end + PACK_ENTRY_BYTES * *n_chunks;
	code = unpack_fetch(u, entry, u->octree_entry, PACK_ENTRY_BYTES);
	if (code != PSR_OK)
		return code;
	u->n_octree = file_get(entry, 8);
	if (u->n_octree == 0 || u->n_octree > size || file_get(entry + 8, 8) != 0)
		return bad(u, "the packed octree has %" PRIu64 " bytes, and the file %" PRIu64, u->n_octree, size);
	*n_chunks += 1 + pack_pieces(u->n_octree);
	return PSR_OK;
}

int unpack_read_head(struct unpacker *u)
{
	uint64_t n_chunks = 0, n_behind = 0, size, packing = file_get(u->header + HEADER_PACKING, 4);
	int code;

	u->packing = packing;
	if (packing != PACKING_ZSTD && !pack_has_steps(packing))
		return psr_fail(u->err, PSR_ERR_VERSION,
		                "%s: the file is packed in way %" PRIu64 ", and this build knows ways %d, %d and %d; take the psr "
		                "that packed it, or build it again", u->source->name, packing, PACKING_ZSTD, PACKING_OCTREE,
		                PACKING_SCAN);
	size = file_get(u->header + HEADER_PACKED_SIZE, 8);
	u->n_image = file_get(u->header + HEADER_FILE_SIZE, 8);
	u->n_sections = (uint32_t)file_get(u->header + HEADER_N_SECTIONS, 4);
	if (u->n_sections > FILE_MAX_SECTIONS)
		return bad(u, "the header lists %" PRIu32 " sections, more than the %d there can be", u->n_sections,
		           FILE_MAX_SECTIONS);
	u->n_file = size;
	if (size > u->source->n_bytes && !pack_has_steps(packing))
		return bad(u, "the file ends at byte %" PRIu64 " of %" PRIu64 "; it was cut short", u->source->n_bytes, size);
	if (size < u->source->n_bytes)
		return bad(u, "%" PRIu64 " bytes follow the end of the file's last chunk", u->source->n_bytes - size);
	if (u->n_image > pack_max_image(size))
		return bad(u, "the header says that %" PRIu64 " bytes unpack to %" PRIu64 "; the limit is %d to 1",
		           size, u->n_image, PACK_MAX_RATIO);
	u->table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * (uint64_t)u->n_sections
	               + 8 * file_get(u->header + HEADER_N_CHUNKS, 4);
	if (u->table_end > u->source->n_bytes && u->table_end <= size)
		return bad(u, "the file ends at byte %" PRIu64 ", within its section table (bytes %d to %" PRIu64
		           "); it was cut short", u->source->n_bytes, FILE_HEADER_BYTES, u->table_end);
	if (u->table_end > size)
		return bad(u, "the section table ends at byte %" PRIu64 ", and the file at byte %" PRIu64, u->table_end, size);
	u->head_end = u->table_end;
	u->head = psr_alloc_array(u->table_end, 1);
	if (u->head == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for its section table", u->source->name);
	code = unpack_fetch(u, u->head, 0, u->table_end);
	for (uint32_t i = 0; i < u->n_sections && code == PSR_OK; i++) {
		uint64_t length = file_get(unpack_entry(u, i) + ENTRY_LENGTH, 8);

		if (length > u->n_image)
			return bad(u, "section %" PRIu32 " has %" PRIu64 " of %" PRIu64 " bytes", i, length, u->n_image);
		if (pack_place(packing, unpack_entry(u, i)) == PACK_BEFORE)
			n_chunks += pack_chunks(length);
		else if (pack_place(packing, unpack_entry(u, i)) == PACK_BEHIND)
			n_behind += pack_chunks(length);
	}
	if (code == PSR_OK && pack_has_steps(packing))
		code = read_octree_entry(u, size, &n_chunks);
	n_chunks += n_behind;
	/* At most 256 sections of 64 times the file: no product overflows. */
	u->head_end = u->table_end + PACK_ENTRY_BYTES * n_chunks;
	if (code == PSR_OK && u->head_end > size)
		return bad(u, "the directory of chunks ends at byte %" PRIu64 ", and the file at byte %" PRIu64, u->head_end,
		           size);
	if (code == PSR_OK && u->head_end > u->source->n_bytes)
		return bad(u, "the file ends at byte %" PRIu64 ", within its directory of chunks (up to byte %" PRIu64
		           "); it was cut short", u->source->n_bytes, u->head_end);
	psr_free(u->head);
	u->head = psr_alloc_array(u->head_end, 1);
	if (u->head == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for its directory of chunks", u->source->name);
	if (code == PSR_OK)
		code = unpack_fetch(u, u->head, 0, u->head_end);
	if (code == PSR_OK && (memcmp(u->head, u->header, FILE_HEADER_BYTES) != 0
	                       || file_header_hash(u->head, u->head_end) != file_get(u->head + HEADER_HASH, 8)))
		return bad(u, "the header, the section table or the directory of chunks (bytes 0 to %" PRIu64
		           ") is damaged: their hash differs", u->head_end);
	return code;
}

/* Where a check of the directory is. */
struct check {
	const uint8_t *next; /* entry */
	uint64_t n, file_at; /* the chunk's number and place */
};

static int check_chunks(const struct unpacker *u, struct check *to, uint64_t length)
{
	for (uint64_t first = 0; first < length; first += FILE_CHUNK_BYTES, to->next += PACK_ENTRY_BYTES, to->n++) {
		const uint64_t size = length - first < FILE_CHUNK_BYTES ? length - first : FILE_CHUNK_BYTES;
		const uint64_t packed = file_get(to->next + PACK_LENGTH, 4);
		const int method = to->next[PACK_METHOD];

		if (method >= PACK_N_METHODS || !pack_is_stride(to->next[PACK_STRIDE]) || file_get(to->next + 6, 2) != 0)
			return bad(u, "chunk %" PRIu64 " is packed by method %d in words of %d bytes, which is unknown", to->n,
			           method, to->next[PACK_STRIDE]);
		if (method == PACK_STORED ? packed != size : packed >= size || packed == 0)
			return bad(u, "chunk %" PRIu64 " of %" PRIu64 " bytes is packed into %" PRIu64, to->n, size, packed);
		to->file_at += packed;
	}
	return PSR_OK;
}

/* Of the sections of this place. */
static int check_place(const struct unpacker *u, struct check *to, enum pack_place place)
{
	int code = PSR_OK;

	for (uint32_t i = 0; i < u->n_sections && code == PSR_OK; i++)
		if (pack_place(u->packing, unpack_entry(u, i)) == place)
			code = check_chunks(u, to, file_get(unpack_entry(u, i) + ENTRY_LENGTH, 8));
	return code;
}

static int check_octree(const struct unpacker *u, struct check *to)
{
	for (uint64_t first = 0; first < u->n_octree; first += PACK_PIECE_BYTES, to->n++) {
		const uint64_t size = u->n_octree - first < PACK_PIECE_BYTES ? u->n_octree - first : PACK_PIECE_BYTES;

		to->next += PACK_ENTRY_BYTES;
		if (file_get(to->next, 8) != (size | (uint64_t)PACK_STORED << 32 | (uint64_t)1 << 40))
			return bad(u, "chunk %" PRIu64 ", of the packed octree, is not one of %" PRIu64 " bytes as they are", to->n,
			           size);
		to->file_at += size;
	}
	to->next += PACK_ENTRY_BYTES;
	return PSR_OK;
}

int unpack_check_head(struct unpacker *u)
{
	struct check check = { .next = u->head + u->table_end, .file_at = u->head_end };
	uint64_t image_at = file_align(u->table_end);
	int code;

	for (uint32_t i = 0; i < u->n_sections; i++) {
		const uint8_t *entry = unpack_entry(u, i);
		uint64_t offset = file_get(entry + ENTRY_OFFSET, 8), length = file_get(entry + ENTRY_LENGTH, 8);

		if (offset != image_at)
			return bad(u, "section %" PRIu32 " begins at byte %" PRIu64 " instead of %" PRIu64, i, offset, image_at);
		image_at = file_align(image_at + length);
	}
	code = check_place(u, &check, PACK_BEFORE);
	u->octree_at = check.file_at;
	if (code == PSR_OK && pack_has_steps(u->packing))
		code = check_octree(u, &check);
	if (code == PSR_OK)
		code = check_place(u, &check, PACK_BEHIND);
	if (code != PSR_OK)
		return code;
	if (image_at + FILE_TAIL_BYTES != u->n_image)
		return bad(u, "the header says %" PRIu64 " bytes, and the sections have %" PRIu64, u->n_image,
		           image_at + FILE_TAIL_BYTES);
	if (check.file_at != u->n_file)
		return bad(u, "the chunks end at byte %" PRIu64 ", and the file at byte %" PRIu64, check.file_at, u->n_file);
	return PSR_OK;
}

void pack_seal(uint8_t *bytes, size_t n_bytes)
{
	uint64_t n_sections = file_get(bytes + HEADER_N_SECTIONS, 4), n_chunks = 0, n_behind = 0, at, head_end, table_end;
	uint64_t octree = UINT64_MAX; /* its entry */
	const uint64_t packing = file_get(bytes + HEADER_PACKING, 4);

	table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * file_get(bytes + HEADER_N_CHUNKS, 4);
	if (n_sections > FILE_MAX_SECTIONS || table_end > n_bytes)
		return;
	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
		const uint64_t length = file_get(entry + ENTRY_LENGTH, 8);
		const uint64_t n = length / FILE_CHUNK_BYTES + (length % FILE_CHUNK_BYTES != 0);

		n_chunks += pack_place(packing, entry) == PACK_BEFORE ? n : 0;
		n_behind += pack_place(packing, entry) == PACK_BEHIND ? n : 0;
	}
	if (pack_has_steps(packing)) {
		octree = n_chunks++;
		if (n_chunks > (n_bytes - table_end) / PACK_ENTRY_BYTES)
			return;
		n_chunks += pack_pieces(file_get(bytes + table_end + PACK_ENTRY_BYTES * octree, 8)) + n_behind;
	}
	if (n_chunks > (n_bytes - table_end) / PACK_ENTRY_BYTES)
		return;
	at = head_end = table_end + PACK_ENTRY_BYTES * n_chunks;
	for (uint64_t i = 0; i < n_chunks; i++) {
		if (i == octree)
			continue;
		uint8_t *entry = bytes + table_end + PACK_ENTRY_BYTES * i;
		uint64_t length = file_get(entry + PACK_LENGTH, 4);

		if (length > n_bytes - at)
			break;
		file_put(entry + PACK_HASH, 8, XXH64(bytes + at, length, 0));
		at += length;
	}
	file_put(bytes + HEADER_HASH, 8, file_header_hash(bytes, head_end));
}
