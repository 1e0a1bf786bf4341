#include <assert.h>
#include <inttypes.h>
#include <xxhash.h>
#include <zstd.h>
#include "base/mem.h"
#include "pack.h"

static uint64_t get_word(const uint8_t *at, uint32_t stride)
{
	uint64_t word = 0;

	memcpy(&word, at, stride);
	return word;
}

void pack_split(uint8_t *out, const uint8_t *chunk, size_t n_bytes, uint32_t stride, enum pack_method method)
{
	size_t n_words = n_bytes / stride;
	uint64_t before = 0;

	for (size_t i = 0; i < n_words; i++) {
		uint64_t word = get_word(chunk + i * stride, stride), value = word;

		if (method == PACK_DIFFERENCES)
			value = word - before;
		else if (method == PACK_XOR)
			value = word ^ before;
		for (uint32_t k = 0; k < stride; k++)
			out[k * n_words + i] = (uint8_t)(value >> 8 * k);
		before = word;
	}
	memcpy(out + n_words * stride, chunk + n_words * stride, n_bytes - n_words * stride);
}

void pack_join(uint8_t *chunk, const uint8_t *in, size_t n_bytes, uint32_t stride, enum pack_method method)
{
	size_t n_words = n_bytes / stride;
	uint64_t before = 0;

	for (size_t i = 0; i < n_words; i++) {
		uint64_t word = 0;

		for (uint32_t k = 0; k < stride; k++)
			word |= (uint64_t)in[k * n_words + i] << 8 * k;
		if (method == PACK_DIFFERENCES)
			word += before;
		else if (method == PACK_XOR)
			word ^= before;
		memcpy(chunk + i * stride, &word, stride);
		before = word;
	}
	memcpy(chunk + n_words * stride, in + n_words * stride, n_bytes - n_words * stride);
}

/* The word size of most of a section. */
static uint32_t stride_of(const uint8_t *type)
{
	for (int k = SECTION_FIRST_ARRAY; k < N_KNOWN_SECTIONS; k++) {
		uint32_t item = section_table[k].item_bytes;

		if (memcmp(type, section_table[k].type, 4) == 0)
			return pack_is_stride(item)                                                               ? item
			       : section_table[k].count == COUNT_MASKS || section_table[k].count == COUNT_POINTS ? 8
			                                                                                         : 4;
	}
	return 1;
}

enum pack_place pack_place(uint64_t packing, const uint8_t *entry)
{
	for (int k = SECTION_FIRST_OF_OCTREE; k < SECTION_END_OF_OCTREE && pack_has_steps(packing); k++)
		if (file_is_section(entry, k))
			return PACK_IN_OCTREE;
	for (int k = SECTION_FIRST_OF_SCAN; k < SECTION_END_OF_SCAN && packing == PACKING_SCAN; k++)
		if (file_is_section(entry, k))
			return PACK_BEHIND;
	return PACK_BEFORE;
}

int pack_find_octree(struct octree *tree, const uint8_t *image)
{
	struct content content = { .has_octree = 0 };
	const uint64_t n_sections = file_get(image + HEADER_N_SECTIONS, 4);

	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = image + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		if (file_is_section(entry, SECTION_OCTREE) && file_get(entry + ENTRY_LENGTH, 8) == OCTREE_BYTES)
			file_get_octree(&content.octree, image + file_get(entry + ENTRY_OFFSET, 8));
	}
	if (model_check_octree_counts(&content.octree, "", NULL) != PSR_OK)
		return 0;
	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = image + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
		const uint8_t *at = image + file_get(entry + ENTRY_OFFSET, 8);

		for (int k = SECTION_FIRST_OF_OCTREE; k < SECTION_END_OF_OCTREE; k++) {
			const struct section_spec *spec = &section_table[k];

			if (!file_is_section(entry, k))
				continue;
			if (file_get(entry + ENTRY_LENGTH, 8) != spec->item_bytes * section_items(spec, &content))
				return 0;
			memcpy((char *)&content + spec->pointer, &at, sizeof at);
		}
	}
	*tree = content.octree;
	return tree->code != NULL && tree->skip != NULL;
}

struct packer {
	ZSTD_CCtx *context;
	uint64_t packing;
	uint8_t *octree; /* packed, in ways 3 and 4 */
	size_t n_octree;
	uint8_t *split, *packed; /* a chunk, and its largest packed form */
	size_t packed_capacity;
};

/* Writes the shortest form to `out`, which has room for the plain chunk, and its entry. */
static uint32_t pack_chunk(const struct packer *p, uint8_t *out, uint8_t *entry, const uint8_t *chunk, size_t n,
                           uint32_t stride)
{
	enum pack_method best = PACK_STORED;
	size_t length = n;

	memcpy(out, chunk, n);
	for (enum pack_method method = PACK_PLAIN; method < PACK_N_METHODS; method++) {
		const uint8_t *bytes = chunk;
		size_t got;

		if (method == PACK_PLANES && stride == 1)
			continue;
		if (method != PACK_PLAIN) {
			pack_split(p->split, chunk, n, stride, method);
			bytes = p->split;
		}
		got = ZSTD_compressCCtx(p->context, p->packed, p->packed_capacity, bytes, n, PACK_LEVEL);
		if (!ZSTD_isError(got) && got < length) {
			best = method;
			length = got;
			memcpy(out, p->packed, got);
		}
	}
	file_put(entry + PACK_LENGTH, 4, length);
	entry[PACK_METHOD] = (uint8_t)best;
	entry[PACK_STRIDE] = (uint8_t)(best == PACK_STORED || best == PACK_PLAIN ? 1 : stride);
	file_put(entry + PACK_HASH, 8, XXH64(out, length, 0));
	return (uint32_t)length;
}

static int packer_init(struct packer *p)
{
	p->packed_capacity = ZSTD_compressBound(FILE_CHUNK_BYTES);
	p->context = ZSTD_createCCtx();
	p->split = psr_alloc_array(FILE_CHUNK_BYTES, 1);
	p->packed = psr_alloc_array(p->packed_capacity, 1);
	return p->context != NULL && p->split != NULL && p->packed != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

static void packer_fini(struct packer *p)
{
	ZSTD_freeCCtx(p->context);
	free(p->octree);
	psr_free(p->split);
	psr_free(p->packed);
}

/* Returns the end of the directory, and its beginning in *directory; *n: how many chunks are packed by zstd. */
static uint64_t directory_end(const struct packer *p, const uint8_t *image, uint64_t *directory, uint64_t *n)
{
	uint64_t n_chunks = 0, n_sections = file_get(image + HEADER_N_SECTIONS, 4);

	*directory = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * file_get(image + HEADER_N_CHUNKS, 4);
	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = image + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		if (pack_place(p->packing, entry) != PACK_IN_OCTREE)
			n_chunks += pack_chunks(file_get(entry + ENTRY_LENGTH, 8));
	}
	*n = n_chunks;
	if (pack_has_steps(p->packing))
		n_chunks += 1 + pack_pieces(p->n_octree);
	return *directory + PACK_ENTRY_BYTES * n_chunks;
}

/* Returns the end of the chunk, which begins at `at`. */
static uint64_t store_chunk(uint8_t *out, uint64_t at, uint8_t *entry, const uint8_t *bytes, uint64_t n)
{
	memcpy(out + at, bytes, n);
	file_put(entry + PACK_LENGTH, 4, n);
	entry[PACK_METHOD] = PACK_STORED;
	entry[PACK_STRIDE] = 1;
	file_put(entry + PACK_HASH, 8, XXH64(bytes, n, 0));
	return at + n;
}

/* The packed file as it is written. */
struct packing {
	const struct packer *p;
	uint8_t *out, *next; /* the next entry of the directory */
	uint64_t at;         /* the end of the chunks that are there */
	uint64_t n, n_packed; /* chunks; from n_packed on they are stored */
};

/* Writes the chunks of the sections of this place. */
static void pack_sections(struct packing *to, const uint8_t *image, enum pack_place place)
{
	for (uint64_t i = 0; i < file_get(image + HEADER_N_SECTIONS, 4); i++) {
		const uint8_t *entry = image + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
		uint64_t offset = file_get(entry + ENTRY_OFFSET, 8), length = file_get(entry + ENTRY_LENGTH, 8);

		if (pack_place(to->p->packing, entry) != place)
			continue;
		for (uint64_t first = 0; first < length; first += FILE_CHUNK_BYTES, to->n++, to->next += PACK_ENTRY_BYTES) {
			const uint64_t size = length - first < FILE_CHUNK_BYTES ? length - first : FILE_CHUNK_BYTES;
			const uint8_t *chunk = image + offset + first;

			if (to->n < to->n_packed)
				to->at += pack_chunk(to->p, to->out + to->at, to->next, chunk, size, stride_of(entry + ENTRY_TYPE));
			else
				to->at = store_chunk(to->out, to->at, to->next, chunk, size);
		}
	}
}

/* Writes directory and chunks, stored from chunk `n_packed` on. Returns the size of the file. */
static uint64_t pack_chunks_of(const struct packer *p, uint8_t *out, const uint8_t *image, uint64_t n_packed)
{
	uint64_t directory, n_chunks;
	struct packing to = { .p = p, .out = out, .at = directory_end(p, image, &directory, &n_chunks), .n_packed = n_packed };

	to.next = out + directory;
	pack_sections(&to, image, PACK_BEFORE);
	if (!pack_has_steps(p->packing))
		return to.at;
	file_put(to.next, 8, p->n_octree);
	to.next += PACK_ENTRY_BYTES;
	for (uint64_t first = 0; first < p->n_octree; first += PACK_PIECE_BYTES, to.next += PACK_ENTRY_BYTES) {
		const uint64_t size = p->n_octree - first < PACK_PIECE_BYTES ? p->n_octree - first : PACK_PIECE_BYTES;

		to.at = store_chunk(out, to.at, to.next, p->octree + first, size);
	}
	pack_sections(&to, image, PACK_BEHIND);
	return to.at;
}

static int has_scan(const uint8_t *image)
{
	for (uint64_t i = 0; i < file_get(image + HEADER_N_SECTIONS, 4); i++)
		for (int k = SECTION_FIRST_OF_SCAN; k < SECTION_END_OF_SCAN; k++)
			if (file_is_section(image + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i, k))
				return 1;
	return 0;
}

/* Packs the octree, if there is one, in steps. */
static int pack_octree(struct packer *p, const uint8_t *image, struct psr_error *err)
{
	struct psr_pool *pool = NULL;
	struct octree tree;
	int code;

	p->packing = PACKING_ZSTD;
	if (!pack_find_octree(&tree, image))
		return PSR_OK;
	if (tree.n_leaves > OCTREE_CHUNK && (code = psr_pool_create(&pool, psr_pool_all_cores(), err)) != PSR_OK)
		return code;
	code = octree_pack(&p->octree, &p->n_octree, &tree, OCTREE_SMALL | OCTREE_STEPS, pool, err);
	psr_pool_destroy(pool);
	if (code == PSR_OK)
		p->packing = has_scan(image) ? PACKING_SCAN : PACKING_OCTREE;
	return code;
}

/* Packs all but the octree, which is packed or not by now. */
static int pack_all(struct packer *p, uint8_t **out, size_t *n_bytes, size_t *capacity, const uint8_t *image,
                    size_t n_image)
{
	uint64_t directory, n_packed, end = directory_end(p, image, &directory, &n_packed), size;
	uint8_t *bytes;

	*capacity = n_image + (end - directory) + p->n_octree;
	bytes = psr_alloc_huge(*capacity);
	if (bytes == NULL)
		return PSR_ERR_MEMORY;
	memcpy(bytes, image, directory);
	size = pack_chunks_of(p, bytes, image, n_packed);
	/* Beyond the ratio that the reader accepts, stores the last chunks unpacked. */
	while (pack_max_image(size) < n_image && n_packed > 0) {
		n_packed -= n_packed / 16 + 1;
		size = pack_chunks_of(p, bytes, image, n_packed);
	}
	file_put(bytes + HEADER_PACKING, 4, p->packing);
	file_put(bytes + HEADER_PACKED_SIZE, 8, size);
	file_put(bytes + HEADER_HASH, 8, file_header_hash(bytes, end));
	*out = bytes;
	*n_bytes = size;
	return PSR_OK;
}

int pack_image(uint8_t **out, size_t *n_bytes, size_t *capacity, const uint8_t *image, size_t n_image,
               struct psr_error *err)
{
	struct packer packer = { 0 };
	int code = packer_init(&packer);

	if (code == PSR_OK)
		code = pack_octree(&packer, image, NULL);
	if (code == PSR_OK)
		code = pack_all(&packer, out, n_bytes, capacity, image, n_image);
	/* An octree that packs too well for the ratio is packed like all else. */
	if (code == PSR_OK && pack_max_image(*n_bytes) < n_image) {
		assert(pack_has_steps(packer.packing));
		psr_free_huge(*out, *capacity);
		packer.packing = PACKING_ZSTD;
		packer.n_octree = 0;
		code = pack_all(&packer, out, n_bytes, capacity, image, n_image);
	}
	packer_fini(&packer);
	return code == PSR_OK ? code : psr_fail(err, code, "no memory to pack a model of %zu bytes", n_image);
}
