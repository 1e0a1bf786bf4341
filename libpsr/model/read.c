#include <assert.h>
#include <inttypes.h>
#include <stdatomic.h>
#include <stdio.h>
#include <xxhash.h>
#include "file.h"

/* An image during reading. */
struct reader {
	const uint8_t *bytes;
	uint64_t n_bytes, file_size, table_end;
	uint32_t n_sections;
	const char *name; /* of the file, for errors */
	struct psr_error *err;
	int entry[N_KNOWN_SECTIONS]; /* index in the file's table, -1 if absent */
};

#define bad(r, format, ...) psr_fail((r)->err, PSR_ERR_FORMAT, "%s: " format, (r)->name, ##__VA_ARGS__)

struct section {
	char type[5]; /* printable */
	const uint8_t *raw_type;
	uint32_t version, flags;
	uint64_t offset, length, hash;
};

static struct section get_section(const struct reader *r, uint32_t index)
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
		s = get_section(r, i);
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
		struct section s = get_section(r, i);
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
		struct section s = get_section(r, i);
		int known = known_index(s.raw_type);

		for (uint32_t k = 0; k < i; k++)
			if (memcmp(get_section(r, k).raw_type, s.raw_type, 4) == 0)
				return bad(r, "there are two sections %s, at bytes %" PRIu64 " and %" PRIu64, s.type,
				           get_section(r, k).offset, s.offset);
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

static int check_length(const struct reader *r, int known, uint64_t expected)
{
	struct section s = get_section(r, (uint32_t)r->entry[known]);

	if (s.length != expected)
		return bad(r, "section %s at byte %" PRIu64 " has %" PRIu64 " bytes and should have %" PRIu64, s.type, s.offset,
		           s.length, expected);
	return PSR_OK;
}

static int get_info(const struct reader *r, struct psr_model_info *info)
{
	const uint8_t *at = r->bytes + get_section(r, (uint32_t)r->entry[SECTION_INFO]).offset;
	int code = check_length(r, SECTION_INFO, INFO_BYTES);

	if (code != PSR_OK)
		return code;
	for (int k = 0; k < 3; k++) {
		info->origin[k] = file_get_double(at + 8 * k);
		info->box_min[k] = file_get_double(at + 32 + 8 * k);
		info->box_max[k] = file_get_double(at + 56 + 8 * k);
		info->up[k] = file_get_double(at + 160 + 8 * k);
	}
	info->scale = file_get_double(at + 24);
	info->spacing = file_get_double(at + 80);
	info->tolerance = file_get_double(at + 88);
	info->resolution = (uint32_t)file_get(at + 96, 4);
	info->n_trials = file_get(at + 104, 8);
	info->n_missing = file_get(at + 112, 8);
	info->n_lost = file_get(at + 120, 8);
	memcpy(info->builder, at + 128, sizeof info->builder);
	if (file_get(at + 100, 4) != 0)
		return bad(r, "section INFO: reserved bytes are not zero");
	return PSR_OK;
}

static int get_blocks(const struct reader *r, struct psr_blocks *blocks)
{
	const uint8_t *at = r->bytes + get_section(r, (uint32_t)r->entry[SECTION_BLOCKS]).offset;
	int code = check_length(r, SECTION_BLOCKS, BLOCKS_BYTES);

	if (code != PSR_OK)
		return code;
	file_get_counts(blocks, at);
	if (file_get(at + 28, 4) != 0)
		return bad(r, "section BLKS: reserved bytes are not zero");
	/* With this and 32-bit counts no product below overflows; the validator checks the limits of counts. */
	if (blocks->n_samples > (uint64_t)PSR_BLOCK_SAMPLES * blocks->n_blocks)
		return bad(r, "section BLKS: %" PRIu64 " samples do not fit %" PRIu32 " blocks", blocks->n_samples,
		           blocks->n_blocks);
	return PSR_OK;
}

/* *n: the items of an optional section, 1 to PSR_MAX_PRESETS == PSR_MAX_CALIBRATED, or 0 if it is missing. */
static int get_presets(const struct reader *r, int known, uint32_t *n, const void **array)
{
	const uint32_t item_bytes = section_table[known].item_bytes;
	struct section s;

	*n = 0;
	*array = NULL;
	if (r->entry[known] < 0)
		return PSR_OK;
	s = get_section(r, (uint32_t)r->entry[known]);
	if (s.length == 0 || s.length % item_bytes != 0 || s.length / item_bytes > PSR_MAX_PRESETS)
		return bad(r, "section %s at byte %" PRIu64 " has %" PRIu64 " bytes and should have 1 to %d times %" PRIu32,
		           s.type, s.offset, s.length, PSR_MAX_PRESETS, item_bytes);
	*n = (uint32_t)(s.length / item_bytes);
	*array = r->bytes + s.offset;
	return PSR_OK;
}

static int get_octree(const struct reader *r, struct octree *tree)
{
	const uint8_t *at = r->bytes + get_section(r, (uint32_t)r->entry[SECTION_OCTREE]).offset;
	int code = check_length(r, SECTION_OCTREE, OCTREE_BYTES);

	if (code != PSR_OK)
		return code;
	file_get_octree(tree, at);
	if (file_get(at + 4, 4) > 3)
		return bad(r, "section OCTR: its flags are %" PRIu64 "; only bits 0 and 1 are known", file_get(at + 4, 4));
	return model_check_octree_counts(tree, r->name, r->err);
}

static int get_points(const struct reader *r, struct dpoint_set *set)
{
	const uint8_t *at = r->bytes + get_section(r, (uint32_t)r->entry[SECTION_POINTS]).offset;
	int code = check_length(r, SECTION_POINTS, POINTS_BYTES);

	if (code != PSR_OK)
		return code;
	file_get_points(set, at);
	return model_check_point_counts(set, r->name, r->err);
}

/* Of each representation that the file has, all sections that it needs; none of another one. */
static int check_set(const struct reader *r, const struct content *content)
{
	for (int k = 0; k < N_KNOWN_SECTIONS; k++) {
		const struct section_spec *spec = &section_table[k];
		const int is_of_blocks = k < SECTION_OCTREE || k == SECTION_CALIBRATION_FINE;
		const int is_of_points = k == SECTION_DELTAS || (k >= SECTION_POINTS && k < SECTION_FIRST_OF_SCAN);
		const char *first = is_of_blocks ? "BLKS" : is_of_points ? "DPNT" : "OCTR";

		if (section_is_foreign(spec, content) && r->entry[k] >= 0)
			return bad(r, "section %s is there, and %s, which tells its length, is missing", spec->type, first);
		if (!section_is_foreign(spec, content) && section_is_needed(spec) && r->entry[k] < 0)
			return bad(r, "section %s is missing", spec->type);
	}
	return PSR_OK;
}

static int get_arrays(const struct reader *r, struct content *content)
{
	struct psr_blocks *blocks = &content->blocks;

	if (r->entry[SECTION_CALIBRATION_FINE] >= 0 && content->calibration.n == 0)
		return bad(r, "section CALF needs CALB, which is missing");
	for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS; k++) {
		const struct section_spec *spec = &section_table[k];
		const void *array;
		int code;

		if (r->entry[k] < 0 || spec->pointer == 0)
			continue;
		code = check_length(r, k, spec->item_bytes * section_items(spec, content));
		if (code != PSR_OK)
			return code;
		array = r->bytes + get_section(r, (uint32_t)r->entry[k]).offset;
		memcpy((char *)content + spec->pointer, &array, sizeof array);
	}
	/* Before that version the modeller moved samples further without saying which. */
	if (blocks->n_blocks != 0 && file_get(r->bytes + HEADER_MINOR, 2) < FILE_MINOR_OFF)
		content->blocks.traits_of_all = PSR_BLOCK_OLD;
	if ((!blocks->cone_x + !blocks->cone_y + !blocks->cone_z + !blocks->cone_sine) % 4 != 0)
		return bad(r, "some of the sections CONX, CONY, CONZ and CONS are missing");
	if (blocks->traits && !blocks->cone_x)
		return bad(r, "section TRTS needs CONX, CONY, CONZ and CONS, which are missing");
	if (blocks->opacity && !blocks->traits)
		return bad(r, "section OPAC needs TRTS, which is missing");
	if (!blocks->visibility_index != !blocks->visibility_mask || !blocks->visibility_mask != (blocks->n_masks == 0))
		return bad(r, "of the sections VISI and VISM and their number of masks in BLKS some are missing");
	return PSR_OK;
}

int file_parse(const uint8_t *bytes, size_t n_bytes, struct psr_pool *pool, const char *name, struct content *content,
               struct psr_error *err)
{
	const void *camera = NULL, *light = NULL, *calibrated = NULL;
	struct reader r = { .bytes = bytes, .n_bytes = n_bytes, .name = name, .err = err };
	int code;

	assert((uintptr_t)bytes % FILE_ALIGNMENT == 0);
	if (n_bytes < FILE_HEADER_BYTES) {
		if (memcmp(bytes, FILE_MAGIC, n_bytes < 8 ? n_bytes : 8) != 0)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: not a .psr file: it begins otherwise", name);
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the file ends at byte %zu, within its header (bytes 0 to %d); it was "
		                "cut short", name, n_bytes, FILE_HEADER_BYTES);
	}
	code = file_check_header(bytes, name, err);
	if (code == PSR_OK)
		code = check_table(&r);
	if (code == PSR_OK)
		code = check_places(&r);
	if (code == PSR_OK)
		code = check_hashes(&r, pool);
	if (code == PSR_OK)
		code = sort_sections(&r);
	if (code != PSR_OK)
		return code;
	memset(content, 0, sizeof *content);
	content->has_blocks = r.entry[SECTION_BLOCKS] >= 0;
	content->has_octree = r.entry[SECTION_OCTREE] >= 0;
	content->has_points = r.entry[SECTION_POINTS] >= 0;
	if (!content->has_blocks && !content->has_octree && !content->has_points)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: the file has none of the sections BLKS, OCTR and DPNT, the kinds of"
		                " samples that this build knows", name);
	code = check_set(&r, content);
	if (code == PSR_OK)
		code = get_info(&r, &content->info);
	if (code == PSR_OK && content->has_blocks)
		code = get_blocks(&r, &content->blocks);
	if (code == PSR_OK && content->has_octree)
		code = get_octree(&r, &content->octree);
	if (code == PSR_OK && content->has_points)
		code = get_points(&r, &content->points);
	if (code == PSR_OK)
		code = get_presets(&r, SECTION_CAMERAS, &content->presets.n_cameras, &camera);
	if (code == PSR_OK)
		code = get_presets(&r, SECTION_LIGHTS, &content->presets.n_lights, &light);
	if (code == PSR_OK)
		code = get_presets(&r, SECTION_CALIBRATION, &content->calibration.n, &calibrated);
	if (code == PSR_OK)
		code = get_arrays(&r, content);
	content->presets.camera = camera;
	content->presets.light = light;
	content->calibration.view = calibrated;
	return code == PSR_OK ? model_validate(content, pool, name, err) : code;
}
