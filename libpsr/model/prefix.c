/* A packed file that ends within its octree: the steps that are there are a coarser tree. */
#include <inttypes.h>
#include <stdlib.h>
#include "base/mem.h"
#include "unpack.h"

enum { INFO_SPACING = 80, INFO_RESOLUTION = 96 };

/* What there is. */
struct part {
	uint8_t *bytes;                /* of the packed octree, whole pieces */
	uint64_t n_bytes;
	struct octree_step step[OCTREE_MOST_STEPS];
	int n_steps, n_whole;          /* steps of the file; of them, within the bytes */
	struct octree *tree;
};

static void part_fini(struct part *part)
{
	psr_free_huge(part->bytes, part->n_bytes);
	octree_destroy(part->tree);
}

/* Returns the least size of the file that is a model. */
static uint64_t least_bytes(const struct unpacker *u, const struct part *part)
{
	const uint64_t pieces = pack_pieces(part->step[0].end) * PACK_PIECE_BYTES;

	return u->octree_at + (pieces < u->n_octree ? pieces : u->n_octree);
}

static int read_part(const struct unpacker *u, struct part *part)
{
	const uint64_t begin = u->octree_at, end = u->source->n_bytes;
	struct psr_error what = { 0 };
	int code;

	part->n_bytes = end > begin ? (end - begin) / PACK_PIECE_BYTES * PACK_PIECE_BYTES : 0;
	if (end > begin && end - begin >= u->n_octree) /* it is the scan behind it that is not whole */
		part->n_bytes = u->n_octree;
	if (part->n_bytes == 0)
		return bad(u, "the file ends at byte %" PRIu64 " of %" PRIu64 ", before the first %" PRIu64 " bytes of its "
		           "octree, from byte %" PRIu64 " on; it was cut short", end, u->n_file,
		           u->n_octree < PACK_PIECE_BYTES ? u->n_octree : PACK_PIECE_BYTES, begin);
	part->bytes = psr_alloc_huge(part->n_bytes);
	if (part->bytes == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for a packed octree", u->source->name);
	code = unpack_read_octree(u, part->bytes, part->n_bytes);
	if (code != PSR_OK)
		return code;
	part->n_steps = octree_packed_steps(part->step, part->bytes, part->n_bytes, &what);
	if (part->n_steps < 0)
		return bad(u, "%s", what.text);
	while (part->n_whole < part->n_steps && part->step[part->n_whole].end <= part->n_bytes)
		part->n_whole++;
	if (part->n_whole == 0)
		return bad(u, "the file ends at byte %" PRIu64 " of %" PRIu64 "; it was cut short, and its first %" PRIu64
		           " bytes are the least that is a model", end, u->n_file, least_bytes(u, part));
	return PSR_OK;
}

static int fail_ratio(const struct unpacker *u, uint64_t n_image)
{
	return bad(u, "the first %" PRIu64 " bytes of the file unpack to %" PRIu64 "; the limit is %d to 1",
	           u->source->n_bytes, n_image, PACK_MAX_RATIO);
}

/* The steps are of the tree that OCTR describes, and do not claim all memory. */
static int check_part(const struct unpacker *u, const struct part *part)
{
	const struct octree *whole = &u->octree;
	const struct octree_step *is = &part->step[part->n_whole - 1];
	const struct octree_step *last = &part->step[part->n_steps - 1];

	if (last->depth != whole->levels || last->n_codes != whole->n_codes || last->n_leaves != whole->n_leaves ||
	    last->end != u->n_octree)
		return bad(u, "the packed octree says %d levels, %" PRIu64 " codes, %" PRIu64 " leaves and %" PRIu64
		           " bytes; it should be %d, %" PRIu64 ", %" PRIu64 " and %" PRIu64, last->depth, last->n_codes,
		           last->n_leaves, last->end, whole->levels, whole->n_codes, whole->n_leaves, u->n_octree);
	if (is->n_codes + is->n_leaves > pack_max_image(u->source->n_bytes))
		return fail_ratio(u, is->n_codes + is->n_leaves);
	return PSR_OK;
}

static int unpack_part(const struct unpacker *u, struct part *part)
{
	const struct octree_step *step = &part->step[part->n_whole - 1];
	struct psr_error what = { 0 };
	struct psr_pool *pool = NULL;
	int code = PSR_OK;

	if (step->n_leaves > OCTREE_CHUNK)
		code = psr_pool_create(&pool, psr_pool_all_cores(), u->err);
	if (code == PSR_OK) {
		code = octree_unpack(&part->tree, part->bytes, step->end, step->n_leaves,
		                     &(struct octree_crew){ pool, u->source->cancel }, &what);
		if (code != PSR_OK)
			psr_fail(u->err, code, "%s: %s", u->source->name, what.text);
	}
	psr_pool_destroy(pool);
	return code;
}

/* Returns the length that a section of the file has with the coarser tree. */
static uint64_t length_of(const uint8_t *entry, const struct octree *tree)
{
	const struct content content = { .has_octree = 1, .octree = *tree };

	for (int k = SECTION_FIRST_OF_OCTREE; k < SECTION_END_OF_OCTREE; k++)
		if (file_is_section(entry, k))
			return section_table[k].item_bytes * section_items(&section_table[k], &content);
	return file_get(entry + ENTRY_LENGTH, 8);
}

/* Returns whether the model has a section: all but those behind the octree. */
static int is_in_part(const struct unpacker *u, uint32_t i)
{
	return pack_place(u->packing, unpack_entry(u, i)) != PACK_BEHIND;
}

/* Makes an image with header and table, without hashes. */
static int make_table(uint8_t **out, uint64_t *n_image, const struct unpacker *u, const struct octree *tree)
{
	uint64_t n_chunks = 0, n_sections = 0, n_sections_bytes = 0, at;
	uint8_t *image, *entry;

	for (uint32_t i = 0; i < u->n_sections; i++)
		if (is_in_part(u, i)) {
			const uint64_t length = length_of(unpack_entry(u, i), tree);

			n_chunks += file_chunks(length);
			n_sections_bytes += file_align(length);
			n_sections++;
		}
	at = file_align(FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * n_chunks);
	*n_image = at + FILE_TAIL_BYTES + n_sections_bytes;
	if (*n_image > pack_max_image(u->source->n_bytes))
		return fail_ratio(u, *n_image);
	image = *out = psr_alloc_huge(*n_image);
	if (image == NULL)
		return psr_fail(u->err, PSR_ERR_MEMORY, "%s: no memory for a model of %" PRIu64 " bytes", u->source->name,
		                *n_image);
	memcpy(image, u->head, FILE_HEADER_BYTES);
	file_put(image + HEADER_N_SECTIONS, 4, n_sections);
	file_put(image + HEADER_FILE_SIZE, 8, *n_image);
	file_put(image + HEADER_N_CHUNKS, 4, n_chunks);
	file_put(image + HEADER_PACKING, 4, 0);
	file_put(image + HEADER_PACKED_SIZE, 8, 0);
	entry = image + FILE_HEADER_BYTES;
	for (uint32_t i = 0; i < u->n_sections; i++) {
		const uint64_t length = length_of(unpack_entry(u, i), tree);

		if (!is_in_part(u, i))
			continue;
		memcpy(entry, unpack_entry(u, i), FILE_ENTRY_BYTES);
		file_put(entry + ENTRY_OFFSET, 8, at);
		file_put(entry + ENTRY_LENGTH, 8, length);
		entry += FILE_ENTRY_BYTES;
		at += file_align(length);
	}
	return PSR_OK;
}

/* Returns where a section of this length begins in the image; NULL if there is none. */
static uint8_t *section_at(uint8_t *image, int id, uint64_t length)
{
	for (uint64_t i = 0; i < file_get(image + HEADER_N_SECTIONS, 4); i++) {
		const uint8_t *entry = image + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		if (file_is_section(entry, id) && file_get(entry + ENTRY_LENGTH, 8) == length)
			return image + file_get(entry + ENTRY_OFFSET, 8);
	}
	return NULL;
}

/* Puts the tree in, and what the model says of itself. */
static int put_tree(const struct unpacker *u, uint8_t *image, const struct octree *tree, int n_missing)
{
	const struct content content = { .has_octree = 1, .octree = *tree };
	uint8_t *const info = section_at(image, SECTION_INFO, INFO_BYTES);

	for (int k = SECTION_FIRST_OF_OCTREE; k < SECTION_END_OF_OCTREE; k++) {
		const struct section_spec *spec = &section_table[k];
		const uint64_t length = spec->item_bytes * section_items(spec, &content);
		const void *array = section_array(spec, &content);
		uint8_t *to = section_at(image, k, length);

		if ((array == NULL) != (to == NULL))
			return bad(u, "the packed octree and the section table do not agree whether there is a section %s", spec->type);
		if (to != NULL)
			memcpy(to, array, length);
	}
	file_put_octree(section_at(image, SECTION_OCTREE, OCTREE_BYTES), tree);
	if (u->is_octree_alone && info != NULL) {
		const uint64_t resolution = file_get(info + INFO_RESOLUTION, 4) >> n_missing;

		file_put_double(info + INFO_SPACING, file_get_double(info + INFO_SPACING) * (double)(1u << n_missing));
		file_put(info + INFO_RESOLUTION, 4, resolution > 0 ? resolution : 1);
	}
	return PSR_OK;
}

static int make_image(struct unpacker *u, uint8_t **out, const struct part *part, struct octree *tree)
{
	uint64_t n_image;
	const int n_missing = part->step[part->n_steps - 1].depth - tree->levels;
	uint8_t *image;
	int code = make_table(&image, &n_image, u, tree);

	if (code != PSR_OK)
		return code;
	code = unpack_sections(u, image);
	if (code == PSR_OK)
		code = put_tree(u, image, tree, n_missing);
	if (code != PSR_OK) {
		psr_free_huge(image, n_image);
		return code;
	}
	file_seal(image, n_image);
	u->n_image = n_image;
	*out = image;
	return PSR_OK;
}

int pack_beginnings(struct pack_beginning *beginning, const struct pack_source *source)
{
	struct psr_error ignored;
	struct unpacker u = { .source = source, .err = &ignored };
	struct pack_source start = *source;
	struct part part = { .bytes = NULL };
	uint64_t n_rest;
	int n = 0;

	if (unpack_fetch(&u, u.header, 0, FILE_HEADER_BYTES) == PSR_OK
	    && pack_has_steps(file_get(u.header + HEADER_PACKING, 4)) && unpack_read_head(&u) == PSR_OK
	    && unpack_check_head(&u) == PSR_OK && u.n_file == source->n_bytes && u.n_octree > PACK_PIECE_BYTES) {
		const uint64_t begin = u.octree_at;

		start.n_bytes = begin + PACK_PIECE_BYTES;
		u.source = &start;
		read_part(&u, &part); /* fails where the first step takes more than a piece, and has read the steps */
		n_rest = u.n_image;
		for (uint32_t i = 0; i < u.n_sections; i++)
			if (pack_place(u.packing, unpack_entry(&u, i)) != PACK_BEFORE)
				n_rest -= file_get(unpack_entry(&u, i) + ENTRY_LENGTH, 8);
		for (int s = 0; s < part.n_steps - 1; s++) {
			const struct octree_step *step = &part.step[s], *last = &part.step[part.n_steps - 1];
			const uint64_t pieces = pack_pieces(step->end) * PACK_PIECE_BYTES;

			if (pieces < u.n_octree)
				beginning[n++] = (struct pack_beginning){ (uint32_t)step->depth, begin + pieces,
				                                          (double)step->n_leaves / (double)last->n_leaves, n_rest };
		}
	}
	part_fini(&part);
	psr_free(u.head);
	return n;
}

int unpack_prefix(struct unpacker *u, uint8_t **image, struct pack_facts *facts)
{
	struct part part = { .bytes = NULL };
	const struct octree *whole = &u->octree;
	struct octree tree;
	int code = PSR_OK;

	if (whole->n_leaves == 0)
		code = bad(u, "an octree is packed, and its section OCTR is missing");
	if (code == PSR_OK)
		code = read_part(u, &part);
	if (code == PSR_OK)
		code = check_part(u, &part);
	if (code == PSR_OK)
		code = unpack_part(u, &part);
	if (code == PSR_OK) {
		tree = *part.tree;
		memcpy(tree.low, whole->low, sizeof tree.low);
		tree.edge = whole->edge;
		tree.is_one_sided = whole->is_one_sided;
		tree.is_cloud = whole->is_cloud;
		code = make_image(u, image, &part, &tree);
	}
	if (code == PSR_OK) {
		octree_packed_shares(&facts->shares, part.bytes, part.step[part.n_whole - 1].end);
		facts->prefix = (struct psr_model_prefix){ (uint32_t)tree.levels, (uint32_t)whole->levels, u->n_file };
	}
	part_fini(&part);
	return code;
}
