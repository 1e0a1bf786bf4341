#include <inttypes.h>
#include <stdlib.h>
#include <xxhash.h>
#include "arrival.h"
#include "pack.h"

#define MOST_HEAD ((uint64_t)1 << 30) /* bytes: of a file of some 40 TB */
#define TOP_BYTES (16 + 32 * OCTREE_MOST_STEPS) /* of a packed octree, which tell its steps */

/* A run of bytes that are checked together. */
struct piece {
	uint64_t n;    /* 0: none left */
	int is_hashed; /* else they are zeros */
	uint64_t hash;
};

struct arrival {
	struct arrival_facts facts;
	/* Header, table, hashes of chunks and directory, as far as they came; known to be right if head_end > 0. */
	uint8_t *head;
	size_t n_head, head_room;
	uint64_t table_end, head_end;
	uint64_t packing;
	uint32_t n_sections;
	/* The piece that comes, and what follows it. */
	struct piece piece;
	uint64_t done;                   /* of the piece */
	XXH64_state_t *state;
	enum pack_place place;           /* of the sections that come */
	uint32_t section;                /* the next one; n_sections: behind the last */
	uint64_t first;                  /* the next byte of it */
	uint64_t hash_at, n_octree, octree_left, octree_at; /* hash_at: in `head`, of the next piece's hash or entry */
	uint64_t octree_entry;           /* in `head` */
	uint8_t top[TOP_BYTES];
};

int arrival_create(struct arrival **out)
{
	struct arrival *a = calloc(1, sizeof *a);

	if (a != NULL)
		a->state = XXH64_createState();
	if (a == NULL || a->state == NULL) {
		free(a);
		return PSR_ERR_MEMORY;
	}
	*out = a;
	return PSR_OK;
}

void arrival_destroy(struct arrival *a)
{
	if (a == NULL)
		return;
	XXH64_freeState(a->state);
	free(a->head);
	free(a);
}

const struct arrival_facts *arrival_facts(const struct arrival *a)
{
	return &a->facts;
}

static int bad(struct psr_error *err, uint64_t from, uint64_t to)
{
	return psr_fail(err, PSR_ERR_FORMAT, "bytes %" PRIu64 " to %" PRIu64 " are damaged: their hash differs", from, to);
}

/* ---- the head ---- */

static const uint8_t *entry_of(const struct arrival *a, uint32_t section)
{
	return a->head + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * section;
}

static uint64_t length_of(const struct arrival *a, uint32_t section)
{
	return file_get(entry_of(a, section) + ENTRY_LENGTH, 8);
}

/* Returns how many bytes the head has, as far as those that are there tell; *is_all: they tell it. */
static uint64_t head_needs(struct arrival *a, int *is_all)
{
	uint64_t n_chunks = 0, n_behind = 0, at;

	*is_all = 0;
	if (a->n_head < FILE_HEADER_BYTES)
		return FILE_HEADER_BYTES;
	a->packing = file_get(a->head + HEADER_PACKING, 4);
	a->n_sections = (uint32_t)file_get(a->head + HEADER_N_SECTIONS, 4);
	a->table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * (uint64_t)a->n_sections
	               + 8 * file_get(a->head + HEADER_N_CHUNKS, 4);
	*is_all = a->packing == 0;
	if (a->packing == 0 || a->n_head < a->table_end)
		return a->table_end;
	for (uint32_t i = 0; i < a->n_sections; i++) {
		const uint64_t n = length_of(a, i) / FILE_CHUNK_BYTES + (length_of(a, i) % FILE_CHUNK_BYTES != 0);

		n_chunks += pack_place(a->packing, entry_of(a, i)) == PACK_BEFORE ? n : 0;
		n_behind += pack_place(a->packing, entry_of(a, i)) == PACK_BEHIND ? n : 0;
	}
	at = a->table_end + PACK_ENTRY_BYTES * n_chunks;
	*is_all = !pack_has_steps(a->packing);
	if (*is_all || a->n_head < at + PACK_ENTRY_BYTES)
		return *is_all ? at : at + PACK_ENTRY_BYTES;
	*is_all = 1;
	a->n_octree = file_get(a->head + at, 8);
	a->octree_entry = at;
	return at + PACK_ENTRY_BYTES * (1 + pack_pieces(a->n_octree) + n_behind);
}

static int check_header(const struct arrival *a, struct psr_error *err)
{
	const uint64_t n_sections = file_get(a->head + HEADER_N_SECTIONS, 4);
	const int code = file_check_header(a->head, "what came", err);

	if (code == PSR_OK && n_sections > FILE_MAX_SECTIONS)
		return psr_fail(err, PSR_ERR_FORMAT, "the header lists %" PRIu64 " sections, more than the %d there can be",
		                n_sections, FILE_MAX_SECTIONS);
	return code;
}

/* The whole head is there. */
static int check_head(struct arrival *a, struct psr_error *err)
{
	if (file_header_hash(a->head, a->n_head) != file_get(a->head + HEADER_HASH, 8))
		return bad(err, 0, a->n_head);
	a->head_end = a->facts.n_checked = a->n_head;
	a->facts.n_file = file_get(a->head + (a->packing == 0 ? HEADER_FILE_SIZE : HEADER_PACKED_SIZE), 8);
	a->facts.hash = file_get(a->head + HEADER_HASH, 8);
	a->facts.has_steps = pack_has_steps(a->packing);
	a->octree_left = a->n_octree;
	a->octree_at = a->head_end;
	for (uint64_t at = a->table_end; a->facts.has_steps && at < a->octree_entry; at += PACK_ENTRY_BYTES)
		a->octree_at += file_get(a->head + at + PACK_LENGTH, 4);
	a->hash_at = a->packing == 0 ? FILE_HEADER_BYTES + FILE_ENTRY_BYTES * (uint64_t)a->n_sections : a->table_end;
	return PSR_OK;
}

/* Takes bytes of the head; returns how many, or an error. */
static ssize_t take_head(struct arrival *a, const uint8_t *bytes, size_t n, struct psr_error *err)
{
	int is_all, code = PSR_OK;
	const uint64_t needs = head_needs(a, &is_all);

	if (needs > MOST_HEAD)
		return psr_fail(err, PSR_ERR_FORMAT, "the header, section table and hashes of the file have %" PRIu64 " bytes; the "
		                "limit is %" PRIu64, needs, MOST_HEAD);
	const size_t some = n < needs - a->n_head ? n : (size_t)(needs - a->n_head);

	if (a->n_head + some > a->head_room) {
		const size_t room = 2 * (a->n_head + some) + 4096;
		uint8_t *grown = realloc(a->head, room);

		if (grown == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for the head of a model's file");
		a->head = grown;
		a->head_room = room;
	}
	memcpy(a->head + a->n_head, bytes, some);
	a->n_head += some;
	if (a->n_head == FILE_HEADER_BYTES && some > 0)
		code = check_header(a, err);
	if (code == PSR_OK && a->n_head == head_needs(a, &is_all) && is_all)
		code = check_head(a, err);
	return code == PSR_OK ? (ssize_t)some : code;
}

/* ---- pieces ---- */

static struct piece zeros(uint64_t n)
{
	return (struct piece){ .n = n };
}

static struct piece hashed(uint64_t n, uint64_t hash)
{
	return (struct piece){ .n = n, .is_hashed = 1, .hash = hash };
}

/* Of a plain file: padding, and the chunks of sections. */
static struct piece next_plain(struct arrival *a)
{
	const uint64_t at = a->facts.n_checked;

	if (a->section < a->n_sections && a->first < length_of(a, a->section)) {
		const uint64_t length = length_of(a, a->section), left = length - a->first;
		const uint64_t n = left < FILE_CHUNK_BYTES ? left : FILE_CHUNK_BYTES;
		uint64_t hash = file_get(entry_of(a, a->section) + ENTRY_HASH, 8);

		if (at % FILE_ALIGNMENT != 0 && a->first == 0)
			return zeros(FILE_ALIGNMENT - at % FILE_ALIGNMENT);
		if (file_chunks(length) > 0) {
			hash = file_get(a->head + a->hash_at, 8);
			a->hash_at += 8;
		}
		a->first += n;
		return hashed(n, hash);
	}
	if (a->section < a->n_sections) {
		a->section++;
		a->first = 0;
		return next_plain(a);
	}
	return zeros(at < a->facts.n_file ? a->facts.n_file - at : 0);
}

/* Of a packed one. */
static struct piece next_packed(struct arrival *a)
{
	const uint8_t *entry = a->head + a->hash_at;

	while (a->section < a->n_sections && (pack_place(a->packing, entry_of(a, a->section)) != a->place ||
	                                      a->first >= length_of(a, a->section))) {
		a->section++;
		a->first = 0;
	}
	if (a->section < a->n_sections) {
		a->first += FILE_CHUNK_BYTES;
		a->hash_at += PACK_ENTRY_BYTES;
		return hashed(file_get(entry + PACK_LENGTH, 4), file_get(entry + PACK_HASH, 8));
	}
	if (a->octree_left == 0)
		return zeros(0);
	if (a->octree_left == a->n_octree)
		a->hash_at += PACK_ENTRY_BYTES; /* of the octree's own entry */
	entry = a->head + a->hash_at;
	a->hash_at += PACK_ENTRY_BYTES;
	const uint64_t n = a->octree_left < PACK_PIECE_BYTES ? a->octree_left : PACK_PIECE_BYTES;
	a->octree_left -= n;
	if (a->octree_left == 0) {
		a->place = PACK_BEHIND;
		a->section = 0;
	}
	return hashed(n, file_get(entry + PACK_HASH, 8));
}

/* A table that lies about lengths ends in a hash that differs, or in hashes that are not there. */
static int begin_piece(struct arrival *a, struct psr_error *err)
{
	const uint64_t at = a->facts.n_checked;

	if (a->packing != 0 && a->hash_at + PACK_ENTRY_BYTES > a->head_end && at < a->facts.n_file)
		return psr_fail(err, PSR_ERR_FORMAT, "the directory of chunks ends before the file does");
	a->piece = a->packing == 0 ? next_plain(a) : next_packed(a);
	a->done = 0;
	XXH64_reset(a->state, 0);
	if (a->hash_at > a->head_end || a->piece.n > a->facts.n_file - at || (a->piece.n == 0 && at < a->facts.n_file))
		return psr_fail(err, PSR_ERR_FORMAT, "the section table and the size of the file, %" PRIu64 " bytes, do not fit",
		                a->facts.n_file);
	return PSR_OK;
}

static int find_steps(struct arrival *a, struct psr_error *err)
{
	struct arrival_facts *f = &a->facts;
	const int n = octree_packed_steps(f->step, a->top, a->n_octree < TOP_BYTES ? a->n_octree : TOP_BYTES, err);

	for (int s = 0; s < n; s++) {
		const uint64_t end = pack_pieces(f->step[s].end) * PACK_PIECE_BYTES;

		f->step[s].end = a->octree_at + (end < a->n_octree ? end : a->n_octree);
	}
	if (n > 0)
		f->step[n - 1].end = f->n_file; /* with the scan */
	f->n_steps = n > 0 ? n : 0;
	return n > 0 ? PSR_OK : n;
}

static int end_piece(struct arrival *a, struct psr_error *err)
{
	const uint64_t from = a->facts.n_checked;

	if (a->piece.is_hashed && XXH64_digest(a->state) != a->piece.hash)
		return bad(err, from, from + a->piece.n);
	a->facts.n_checked += a->piece.n;
	a->piece.n = a->done = 0;
	return a->facts.has_steps && a->facts.n_steps == 0 && from == a->octree_at ? find_steps(a, err) : PSR_OK;
}

static int take_piece(struct arrival *a, const uint8_t *bytes, size_t n, struct psr_error *err)
{
	const uint64_t at = a->facts.n_checked + a->done;

	if (a->piece.is_hashed)
		XXH64_update(a->state, bytes, n);
	for (size_t i = 0; i < n && !a->piece.is_hashed; i++)
		if (bytes[i] != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "byte %" PRIu64 " between sections is not zero", at + i);
	for (uint64_t i = 0; i < n && a->facts.has_steps && at + i < a->octree_at + TOP_BYTES; i++)
		if (at + i >= a->octree_at)
			a->top[at + i - a->octree_at] = bytes[i];
	a->done += n;
	return a->done == a->piece.n ? end_piece(a, err) : PSR_OK;
}

int arrival_take(struct arrival *a, const uint8_t *bytes, size_t n, struct psr_error *err)
{
	int code = PSR_OK;

	while (n > 0 && code == PSR_OK) {
		ssize_t some;

		if (a->head_end == 0) {
			some = take_head(a, bytes, n, err);
			code = some < 0 ? (int)some : PSR_OK;
		} else if (a->facts.n_checked == a->facts.n_file) {
			return psr_fail(err, PSR_ERR_FORMAT, "bytes follow the end of the file at byte %" PRIu64, a->facts.n_file);
		} else {
			if (a->piece.n == 0)
				code = begin_piece(a, err);
			some = n < a->piece.n - a->done ? (ssize_t)n : (ssize_t)(a->piece.n - a->done);
			if (code == PSR_OK)
				code = take_piece(a, bytes, (size_t)some, err);
		}
		if (code == PSR_OK) {
			bytes += some;
			n -= (size_t)some;
			a->facts.n_taken += (uint64_t)some;
		}
	}
	return code;
}

void arrival_rewind(struct arrival *a)
{
	a->facts.n_taken = a->facts.n_checked;
	a->done = 0;
	XXH64_reset(a->state, 0);
	if (a->head_end == 0)
		a->n_head = 0;
}
