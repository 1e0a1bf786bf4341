#include <string.h>
#include "chunks.h"

struct unpacking {
	const uint8_t *at, *end;
	int levels, cut;
	unsigned streams;
	enum octree_packing packing;
	uint32_t n_chunks;
	uint64_t n_codes, n_leaves, n_roots, n_top;
	const uint8_t *top;          /* codes above the cut */
	uint64_t first[OCTREE_MOST_LEVELS + 1]; /* of each depth up to the cut: its first code among these */
	uint64_t *path;              /* of the roots */
	struct chunk *chunk;
	struct octree *tree;         /* of the caller, or made once its codes are there */
	/* While codes are put into their places: the next node of each depth above the cut, chunk, root of it, and code of
	 * each of its levels. */
	uint64_t next_top[OCTREE_MOST_LEVELS];
	uint32_t next_chunk, next_root, next[OCTREE_MOST_LEVELS];
};

static uint64_t get(const uint8_t *p, int n)
{
	uint64_t x = 0;

	for (int i = 0; i < n; i++)
		x |= (uint64_t)p[i] << 8 * i;
	return x;
}

static int is_cut_short(struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_FORMAT, "a packed octree is cut short");
}

static int read_header(struct unpacking *u, uint64_t max_leaves, struct psr_error *err)
{
	const uint8_t *b = u->at;

	if (u->end - u->at < CHUNKS_HEADER)
		return is_cut_short(err);
	u->levels = b[0];
	u->packing = b[1] == OCTREE_FAST ? OCTREE_FAST : OCTREE_SMALL;
	u->cut = b[2];
	u->streams = b[3];
	u->n_chunks = (uint32_t)get(b + 4, 4);
	u->n_codes = get(b + 8, 8);
	u->n_leaves = get(b + 16, 8);
	if (u->levels < OCTREE_LEAST_LEVELS || u->levels > OCTREE_MOST_LEVELS || b[1] > OCTREE_SMALL || u->cut >= u->levels ||
	    u->streams >> OCTREE_STREAMS != 0)
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree of %d levels, cut at %d, packed by way %d, of streams %#x, "
		                "is not known", u->levels, u->cut, b[1], u->streams);
	if (u->tree != NULL && (u->tree->levels != u->levels || u->tree->n_codes != u->n_codes ||
	                        u->tree->n_leaves != u->n_leaves || chunk_streams(u->tree) != u->streams))
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree is of %d levels, %llu codes, %llu leaves, streams %#x; it "
		                "should be of %d, %llu, %llu, %#x", u->levels, (unsigned long long)u->n_codes,
		                (unsigned long long)u->n_leaves, u->streams, u->tree->levels,
		                (unsigned long long)u->tree->n_codes, (unsigned long long)u->tree->n_leaves,
		                chunk_streams(u->tree));
	if (u->n_leaves > max_leaves)
		return psr_fail(err, PSR_ERR_LIMIT, "a packed octree of %llu leaves; the limit is %llu",
		                (unsigned long long)u->n_leaves, (unsigned long long)max_leaves);
	if (u->n_codes / (uint64_t)u->levels > u->n_leaves)
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree of %llu leaves has %llu codes",
		                (unsigned long long)u->n_leaves, (unsigned long long)u->n_codes);
	u->at += CHUNKS_HEADER;
	return PSR_OK;
}

/* Finds how many nodes each depth above the cut has, and of the cut. */
static int read_top(struct unpacking *u, struct psr_error *err)
{
	uint64_t n = 1;

	u->top = u->at;
	for (int depth = 0; depth < u->cut; depth++) {
		uint64_t below = 0;

		if (n > (uint64_t)(u->end - u->at))
			return is_cut_short(err);
		for (uint64_t i = 0; i < n; i++) {
			if (u->at[i] == 0)
				return psr_fail(err, PSR_ERR_FORMAT, "a packed octree contains the code 0");
			below += octree_count(u->at[i]);
		}
		u->first[depth] = (uint64_t)(u->at - u->top);
		u->at += n;
		n = below;
	}
	u->n_top = (uint64_t)(u->at - u->top);
	u->n_roots = n;
	if (n > u->n_leaves || u->n_chunks > n || u->n_chunks > (uint64_t)(u->end - u->at) / chunk_entry_bytes(u->streams))
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree of %llu leaves has %llu subtrees in %u chunks",
		                (unsigned long long)u->n_leaves, (unsigned long long)n, u->n_chunks);
	return PSR_OK;
}

/* Opens the bytes of a chunk's codes, or of a stream. */
static int take_bytes(struct unpacking *u, struct coder *coder, const uint8_t *entry)
{
	const uint64_t n_bytes = get(entry, 4);

	if (n_bytes > (uint64_t)(u->end - u->at))
		return 0;
	coder_open(coder, u->at, n_bytes);
	u->at += n_bytes;
	return 1;
}

static int read_chunks(struct unpacking *u, struct psr_error *err)
{
	const size_t step = chunk_entry_bytes(u->streams);
	const uint8_t *const entries = u->at, *entry = entries;
	uint64_t roots = 0, codes = u->n_top, leaves = 0;
	size_t column = 12;

	u->at += (size_t)u->n_chunks * step;
	for (uint32_t i = 0; i < u->n_chunks; i++, entry += step) {
		struct chunk *chunk = &u->chunk[i];

		*chunk = (struct chunk){ .n_roots = (uint32_t)get(entry, 4),
			                     .n_codes = (uint32_t)get(entry + 4, 4),
			                     .n_leaves = (uint32_t)get(entry + 8, 4),
			                     .root = (uint32_t)roots,
			                     .leaf = leaves };
		if (chunk->n_roots == 0 || chunk->n_roots > u->n_roots - roots || chunk->n_leaves > OCTREE_CHUNK)
			return psr_fail(err, PSR_ERR_FORMAT, "chunk %u of a packed octree: %u subtrees, %u leaves", i,
			                chunk->n_roots, chunk->n_leaves);
		chunk->levels.root = &u->path[roots];
		chunk->levels.n_roots = chunk->n_roots;
		chunk->levels.height = u->levels - u->cut;
		if (!take_bytes(u, &chunk->coder, entry + column))
			return is_cut_short(err);
		roots += chunk->n_roots;
		codes += chunk->n_codes;
		leaves += chunk->n_leaves;
	}
	for (int s = 0; s < OCTREE_STREAMS; s++) {
		if (!(u->streams >> s & 1))
			continue;
		column += 4;
		for (uint32_t i = 0; i < u->n_chunks; i++)
			if (!take_bytes(u, &u->chunk[i].attribute[s], entries + i * step + column))
				return is_cut_short(err);
	}
	if (roots != u->n_roots || codes != u->n_codes || leaves != u->n_leaves || u->at != u->end)
		return psr_fail(err, PSR_ERR_FORMAT, "the chunks of a packed octree do not add up to what its header says");
	return PSR_OK;
}

static void unpack_chunk(int i, void *userdata)
{
	const struct unpacking *u = userdata;
	struct chunk *chunk = &u->chunk[i];
	const struct octree_level *last = &chunk->levels.at[chunk->levels.height - 1];
	uint64_t codes = 0;

	chunk->rc = octree_codes_unpack(&chunk->levels, &chunk->coder, chunk->n_codes, u->packing);
	if (chunk->rc != PSR_OK)
		return;
	for (int level = 0; level < chunk->levels.height; level++)
		codes += chunk->levels.at[level].n;
	if (codes != chunk->n_codes || last->first[last->n - 1] + octree_count(last->code[last->n - 1]) != chunk->n_leaves ||
	    !coder_is_at_end(&chunk->coder))
		chunk->rc = PSR_ERR_FORMAT;
}

/* Offsets come after normals, which foretell them. */
static void unpack_leaves(int i, void *userdata)
{
	const struct unpacking *u = userdata;
	struct chunk *chunk = &u->chunk[i];
	struct octree_attributes leaf = chunk_attributes(chunk, u->tree);

	for (enum octree_stream s = 0; s < OCTREE_STREAMS && chunk->rc == PSR_OK; s++) {
		if (!(u->streams >> s & 1))
			continue;
		chunk->rc = octree_attributes_unpack(&leaf, &chunk->attribute[s], &chunk->levels, s);
		if (chunk->rc == PSR_OK && !coder_is_at_end(&chunk->attribute[s]))
			chunk->rc = PSR_ERR_FORMAT;
	}
}

/* Computes the roots' paths. */
static void find_paths(struct unpacking *u, uint64_t path, int depth)
{
	uint8_t code;

	if (depth == u->cut) {
		u->path[u->n_roots++] = path;
		return;
	}
	code = u->top[u->first[depth] + u->next_top[depth]++];
	for (unsigned j = 0; j < 8; j++)
		if (code >> j & 1)
			find_paths(u, path << 3 | j, depth + 1);
}

/* Puts a node's codes, depth first. */
static void place_codes(struct unpacking *u, uint64_t path, int depth)
{
	struct octree *tree = u->tree;
	const int skips = u->levels > OCTREE_SKIP_LEVELS ? u->levels - OCTREE_SKIP_LEVELS : 0, level = depth - u->cut;
	uint8_t code;

	if (depth == skips)
		tree->skip[tree->n_skips++] = (struct octree_skip){ path, tree->n_codes, tree->n_leaves };
	if (level < 0) {
		code = u->top[u->first[depth] + u->next_top[depth]++];
	} else {
		if (level == 0 && u->next_root == u->chunk[u->next_chunk].n_roots) {
			u->next_chunk++;
			u->next_root = 0;
			memset(u->next, 0, sizeof u->next);
		}
		u->next_root += level == 0;
		code = u->chunk[u->next_chunk].levels.at[level].code[u->next[level]++];
	}
	tree->code[tree->n_codes++] = code;
	if (depth == u->levels - 1) {
		tree->n_leaves += octree_count(code);
		return;
	}
	for (unsigned left = code; left != 0; left &= left - 1)
		place_codes(u, path << 3 | (unsigned)__builtin_ctz(left), depth + 1);
}

/* Returns how many entries the skip index has. */
static uint64_t count_skips(const struct unpacking *u)
{
	const int skips = u->levels > OCTREE_SKIP_LEVELS ? u->levels - OCTREE_SKIP_LEVELS : 0;
	uint64_t n = 0;

	if (skips < u->cut)
		return (skips + 1 < u->cut ? u->first[skips + 1] : u->n_top) - u->first[skips];
	for (uint32_t i = 0; i < u->n_chunks; i++)
		n += u->chunk[i].levels.at[skips - u->cut].n;
	return n;
}

static int alloc_tree(struct unpacking *u)
{
	struct octree *tree = u->tree = calloc(1, sizeof *tree);

	if (tree == NULL)
		return PSR_ERR_MEMORY;
	tree->levels = u->levels;
	tree->edge = 1.0;
	tree->code = malloc(u->n_codes);
	tree->skip = malloc(count_skips(u) * sizeof *tree->skip);
	if (u->streams >> OCTREE_NORMAL_STREAM & 1)
		tree->normal = malloc(u->n_leaves * sizeof *tree->normal);
	if (u->streams >> OCTREE_OFFSET_STREAM & 1)
		tree->offset = malloc(u->n_leaves);
	if (u->streams >> OCTREE_COLOR_STREAM & 1)
		tree->color = malloc(u->n_leaves * sizeof *tree->color);
	return tree->code != NULL && tree->skip != NULL && chunk_streams(tree) == u->streams ? PSR_OK : PSR_ERR_MEMORY;
}

/* Returns what the chunks came to. */
static int first_failure(const struct unpacking *u, struct psr_error *err)
{
	int rc = PSR_OK;

	for (uint32_t i = 0; i < u->n_chunks; i++)
		if (u->chunk[i].rc == PSR_ERR_FORMAT)
			return psr_fail(err, PSR_ERR_FORMAT, "chunk %u of a packed octree is corrupt", i);
		else if (u->chunk[i].rc != PSR_OK)
			rc = u->chunk[i].rc;
	return rc == PSR_OK ? rc : psr_fail(err, rc, "no memory to unpack an octree");
}

static int unpack_all(struct unpacking *u, struct psr_pool *pool, struct psr_error *err)
{
	const uint64_t n_roots = u->n_roots;
	int rc;

	u->path = calloc(n_roots, sizeof *u->path);
	u->chunk = calloc(u->n_chunks > 0 ? u->n_chunks : 1, sizeof *u->chunk);
	if (u->path == NULL || u->chunk == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to unpack an octree");
	rc = read_chunks(u, err);
	if (rc != PSR_OK)
		return rc;
	u->n_roots = 0;
	find_paths(u, 0, 0);
	psr_pool_for(pool, (int)u->n_chunks, unpack_chunk, u);
	rc = first_failure(u, err);
	if (rc != PSR_OK)
		return rc;
	if (u->tree != NULL && u->tree->n_skips != count_skips(u))
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree has %llu subtrees, and its skip index %llu",
		                (unsigned long long)count_skips(u), (unsigned long long)u->tree->n_skips);
	if (u->tree == NULL && alloc_tree(u) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to unpack an octree");
	u->tree->n_codes = u->tree->n_leaves = u->tree->n_skips = 0;
	memset(u->next_top, 0, sizeof u->next_top);
	place_codes(u, 0, 0);
	psr_pool_for(pool, (int)u->n_chunks, unpack_leaves, u);
	return first_failure(u, err);
}

static int unpack(struct unpacking *u, uint64_t max_leaves, struct psr_pool *pool, struct psr_error *err)
{
	int rc = read_header(u, max_leaves, err);

	if (rc == PSR_OK)
		rc = read_top(u, err);
	if (rc == PSR_OK)
		rc = unpack_all(u, pool, err);
	chunks_destroy(u->chunk, u->n_chunks);
	free(u->path);
	return rc;
}

int octree_unpack(struct octree **out, const uint8_t *bytes, size_t n_bytes, uint64_t max_leaves,
                  struct psr_pool *pool, struct psr_error *err)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes };
	const int rc = unpack(&u, max_leaves, pool, err);

	if (rc == PSR_OK)
		*out = u.tree;
	else
		octree_destroy(u.tree);
	return rc;
}

int octree_unpack_into(struct octree *tree, const uint8_t *bytes, size_t n_bytes, struct psr_pool *pool,
                       struct psr_error *err)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes, .tree = tree };

	return unpack(&u, UINT64_MAX, pool, err); /* all counts have to be the same */
}

void octree_packed_shares(struct octree_shares *shares, const uint8_t *bytes, size_t n_bytes)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes };

	*shares = (struct octree_shares){ .codes = n_bytes };
	if (read_header(&u, UINT64_MAX, NULL) != PSR_OK || read_top(&u, NULL) != PSR_OK)
		return;
	for (uint32_t i = 0; i < u.n_chunks; i++) {
		const uint8_t *at = u.at + i * chunk_entry_bytes(u.streams) + 16;

		for (int s = 0; s < OCTREE_STREAMS; s++) {
			if (!(u.streams >> s & 1))
				continue;
			shares->stream[s] += get(at, 4);
			shares->codes -= get(at, 4);
			at += 4;
		}
	}
}
