#include <stdatomic.h>
#include <xxhash.h>
#include "read.h"

struct section read_section(const struct reader *r, uint32_t index)
{
	const uint8_t *entry = r->bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * index;
	struct section s = {
		.raw_type = entry + ENTRY_TYPE,
		.version = (uint32_t)file_get(entry + ENTRY_VERSION, 2),
		.flags = (uint32_t)file_get(entry + ENTRY_FLAGS, 2),
		.offset = file_get(entry + ENTRY_OFFSET, 8),
		.length = file_get(entry + ENTRY_LENGTH, 8),
		.hash = file_get(entry + ENTRY_HASH, 8),
	};

	for (int i = 0; i < 4; i++)
		s.type[i] = entry[ENTRY_TYPE + i] > ' ' && entry[ENTRY_TYPE + i] < 127 ? (char)entry[ENTRY_TYPE + i] : '?';
	return s;
}

int file_check_header(const uint8_t *header, const char *name, struct psr_error *err)
{
	uint64_t major = file_get(header + HEADER_MAJOR, 2), minor = file_get(header + HEADER_MINOR, 2);

	if (memcmp(header, FILE_MAGIC, 8) != 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: not a .psr file: it begins otherwise", name);
	if (major != FILE_MAJOR)
		return psr_fail(err, PSR_ERR_VERSION, "%s: the file has format %" PRIu64 ".%" PRIu64
		                ", and this build reads %d.x; build the model again or take another version of psr", name,
		                major, minor, FILE_MAJOR);
	return PSR_OK;
}

static int check_table(struct reader *r)
{
	const uint8_t *header = r->bytes;
	uint64_t n_sections, n_chunks;

	n_sections = file_get(header + HEADER_N_SECTIONS, 4);
	n_chunks = file_get(header + HEADER_N_CHUNKS, 4);
	r->file_size = file_get(header + HEADER_FILE_SIZE, 8);
	if (n_sections > FILE_MAX_SECTIONS)
		return bad(r, "the header lists %" PRIu64 " sections, more than the %d there can be", n_sections,
		           FILE_MAX_SECTIONS);
	r->n_sections = (uint32_t)n_sections;
	r->table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * n_chunks;
	if (r->table_end > r->n_bytes)
		return bad(r, "the file ends at byte %" PRIu64 ", within its section table (bytes %d to %" PRIu64
		           "); it was cut short", r->n_bytes, FILE_HEADER_BYTES, r->table_end);
	if (file_header_hash(r->bytes, r->table_end) != file_get(header + HEADER_HASH, 8))
		return bad(r, "the header or the section table (bytes 0 to %" PRIu64 ") is damaged: their hash differs",
		           r->table_end);
	if (file_get(header + 28, 4) != 0 || file_get(header + 48, 8) != 0)
		return bad(r, "reserved bytes of the header are not zero");
	return PSR_OK;
}

static int fail_cut(const struct reader *r, const struct section *s)
{
	return bad(r, "the file ends at byte %" PRIu64 ", within or before its section %s (bytes %" PRIu64 " to %" PRIu64
	           "); it was cut short", r->n_bytes, s->type, s->offset, s->offset + s->length);
}

/* Sections follow each other in the order of the table, each padded to FILE_ALIGNMENT. */
static int check_places(const struct reader *r)
{
	uint64_t at = file_align(r->table_end), n_chunks = 0;
	uint64_t n_listed = (r->table_end - FILE_HEADER_BYTES - FILE_ENTRY_BYTES * r->n_sections) / 8;
	struct section s = { .type = "none" };

	for (uint32_t i = 0; i < r->n_sections; i++) {
		s = read_section(r, i);
		if (s.offset != at)
			return bad(r, "section %s begins at byte %" PRIu64 " instead of %" PRIu64, s.type, s.offset, at);
		if (s.length > r->file_size || s.offset > r->file_size - s.length)
			return bad(r, "section %s at byte %" PRIu64 " has %" PRIu64 " bytes, which reach beyond the file's end "
			           "at byte %" PRIu64, s.type, s.offset, s.length, r->file_size);
		if (s.offset + s.length > r->n_bytes)
			return fail_cut(r, &s);
		n_chunks += file_chunks(s.length);
		at = file_align(s.offset + s.length);
		for (uint64_t k = s.offset + s.length; k < at && k < r->n_bytes; k++)
			if (r->bytes[k] != 0)
				return bad(r, "byte %" PRIu64 " after section %s is not zero", k, s.type);
	}
	for (uint64_t k = r->table_end; k < file_align(r->table_end) && k < r->n_bytes; k++)
		if (r->bytes[k] != 0)
			return bad(r, "byte %" PRIu64 " after the section table is not zero", k);
	if (n_chunks != n_listed)
		return bad(r, "the table lists %" PRIu64 " hashes of chunks, and its sections have %" PRIu64, n_listed,
		           n_chunks);
	at += FILE_TAIL_BYTES;
	for (uint64_t k = at - FILE_TAIL_BYTES; k < at && k < r->n_bytes; k++)
		if (r->bytes[k] != 0)
			return bad(r, "byte %" PRIu64 " at the end of the file is not zero", k);
	if (r->file_size != at)
		return bad(r, "the header says %" PRIu64 " bytes, and the last section, %s at byte %" PRIu64
		           ", and the zeros after it end at byte %" PRIu64, r->file_size, s.type, s.offset, at);
	if (r->n_bytes < at)
		return fail_cut(r, &s);
	if (r->n_bytes > at)
		return bad(r, "%" PRIu64 " bytes follow the end of the last section, %s at byte %" PRIu64, r->n_bytes - at,
		           s.type, s.offset);
	return PSR_OK;
}

/* The chunks of a section, and the first whose hash differs; their number if none does. */
struct hashing {
	const uint8_t *section, *hashes;
	uint64_t length;
	_Atomic uint64_t first_bad;
};

static void hash_chunk(int i, void *userdata)
{
	struct hashing *h = userdata;
	const uint64_t k = (uint64_t)i, first = k * FILE_CHUNK_BYTES, left = h->length - first;
	const uint64_t hash = XXH64(h->section + first, left < FILE_CHUNK_BYTES ? left : FILE_CHUNK_BYTES, 0);
	uint64_t bad = hash == file_get(h->hashes + 8 * k, 8) ? 0 : atomic_load(&h->first_bad); /* 0: not this one */

	while (k < bad && !atomic_compare_exchange_weak(&h->first_bad, &bad, k))
		;
}

static int check_hashes(const struct reader *r, struct psr_pool *pool)
{
	const uint8_t *chunks = r->bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * r->n_sections;
	uint8_t id[16];

	for (uint32_t i = 0; i < r->n_sections; i++) {
		struct section s = read_section(r, i);
		uint64_t n_chunks = file_chunks(s.length);
		struct hashing h = { .section = r->bytes + s.offset, .hashes = chunks, .length = s.length, .first_bad = n_chunks };

		psr_pool_for(pool, (int)n_chunks, hash_chunk, &h);
		if (h.first_bad < n_chunks)
			return bad(r, "section %s at byte %" PRIu64 " is damaged: the hash of its chunk %" PRIu64 " differs", s.type,
			           s.offset, h.first_bad);
		if (file_section_hash(r->bytes + s.offset, s.length, chunks) != s.hash)
			return bad(r, "section %s at byte %" PRIu64 " is damaged: its hash differs", s.type, s.offset);
		chunks += 8 * n_chunks;
	}
	file_content_id(r->bytes, r->n_sections, id);
	return memcmp(id, r->bytes + HEADER_CONTENT_ID, sizeof id) == 0
	       ? PSR_OK : bad(r, "the content id in the header does not match the sections");
}

static int known_index(const uint8_t *type)
{
	for (int k = 0; k < N_KNOWN_SECTIONS; k++)
		if (memcmp(type, section_table[k].type, 4) == 0)
			return k;
	return -1;
}

/* Fills r->entry. Refuses unknown required sections; skips optional ones of other types or versions. */
static int sort_sections(struct reader *r)
{
	for (int k = 0; k < N_KNOWN_SECTIONS; k++)
		r->entry[k] = -1;
	for (uint32_t i = 0; i < r->n_sections; i++) {
		struct section s = read_section(r, i);
		int known = known_index(s.raw_type);

		for (uint32_t k = 0; k < i; k++)
			if (memcmp(read_section(r, k).raw_type, s.raw_type, 4) == 0)
				return bad(r, "there are two sections %s, at bytes %" PRIu64 " and %" PRIu64, s.type,
				           read_section(r, k).offset, s.offset);
		if ((s.flags & ~(uint32_t)ENTRY_REQUIRED) != 0)
			return bad(r, "section %s at byte %" PRIu64 " has unknown flags %#" PRIx32, s.type, s.offset, s.flags);
		if (known >= 0 && s.version == section_table[known].version) {
			if (s.flags != section_table[known].flags)
				return bad(r, "section %s at byte %" PRIu64 " must %sbe marked as required", s.type, s.offset,
				           section_table[known].flags ? "" : "not ");
			r->entry[known] = (int)i;
		} else if (s.flags & ENTRY_REQUIRED) {
			return psr_fail(r->err, known < 0 ? PSR_ERR_UNSUPPORTED : PSR_ERR_VERSION, "%s: this build cannot read the "
			                "required section %s, version %" PRIu32 ", at byte %" PRIu64 "; a newer psr may", r->name,
			                s.type, s.version, s.offset);
		}
	}
	return PSR_OK;
}

int read_table(struct reader *r, struct psr_pool *pool)
{
	int code = file_check_header(r->bytes, r->name, r->err);

	if (code == PSR_OK)
		code = check_table(r);
	if (code == PSR_OK)
		code = check_places(r);
	if (code == PSR_OK)
		code = check_hashes(r, pool);
	return code == PSR_OK ? sort_sections(r) : code;
}
