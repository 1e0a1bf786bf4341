#include <string.h>
#include "chunks.h"

struct packing {
	const struct octree *tree;
	enum octree_packing packing;
	int cut;
	uint32_t n_roots, n_chunks, depth_nodes;
	uint64_t most;            /* leaves of a node of the depth tried last */
	uint64_t from;            /* the last node's first leaf */
	uint64_t *path, *code, *leaf; /* of the roots; leaf has one more */
	struct chunk *chunk;
};

void chunks_destroy(struct chunk *chunk, uint32_t n)
{
	for (uint32_t i = 0; chunk != NULL && i < n; i++)
		octree_levels_fini(&chunk[i].levels);
	free(chunk);
}

static int measure_node(const struct octree_node *node, void *userdata)
{
	struct packing *p = userdata;

	p->most = node->leaf - p->from > p->most ? node->leaf - p->from : p->most;
	p->from = node->leaf;
	p->depth_nodes++;
	return 0;
}

/* Finds the least depth whose nodes have no more leaves than a chunk. */
static void find_cut(struct packing *p)
{
	for (p->cut = 0; p->cut < p->tree->levels - 1; p->cut++) {
		p->most = p->from = p->depth_nodes = 0;
		octree_walk(p->tree, p->cut, measure_node, p);
		p->most = p->tree->n_leaves - p->from > p->most ? p->tree->n_leaves - p->from : p->most;
		if (p->most <= OCTREE_CHUNK)
			return;
	}
	p->depth_nodes = 0;
	octree_walk(p->tree, p->cut, measure_node, p);
}

static int add_root(const struct octree_node *node, void *userdata)
{
	struct packing *p = userdata;

	p->path[p->n_roots] = node->path;
	p->code[p->n_roots] = node->code;
	p->leaf[p->n_roots++] = node->leaf;
	return 0;
}

/* Fills a chunk's levels from the codes below one of its roots. Returns 0 without memory. */
static int add_subtree(struct chunk *chunk, const struct octree *tree, uint64_t *code, int level)
{
	const uint8_t byte = tree->code[(*code)++];
	int is_done = octree_level_put(&chunk->levels.at[level], byte);

	if (level == chunk->levels.height - 1)
		return is_done;
	for (unsigned left = byte; left != 0 && is_done; left &= left - 1)
		is_done = add_subtree(chunk, tree, code, level + 1);
	return is_done;
}

/* Packs the leaves of a chunk whose levels are there. */
static void pack_leaves(struct chunk *chunk, const struct octree *tree)
{
	const struct octree_attributes leaf = chunk_attributes(chunk, tree);
	const unsigned streams = chunk_streams(tree);

	for (enum octree_stream s = 0; s < OCTREE_STREAMS && chunk->rc == PSR_OK; s++) {
		struct coder *coder = &chunk->attribute[s];

		if (!(streams >> s & 1))
			continue;
		coder_begin(coder);
		chunk->rc = octree_attributes_pack(coder, &chunk->levels, &leaf, s);
		coder_end(coder);
		if (coder->has_failed)
			chunk->rc = PSR_ERR_MEMORY;
	}
}

static void pack_chunk(int i, void *userdata)
{
	const struct packing *p = userdata;
	struct chunk *chunk = &p->chunk[i];

	coder_begin(&chunk->coder);
	for (uint32_t r = 0; r < chunk->n_roots; r++) {
		uint64_t code = p->code[chunk->root + r];
		const uint64_t from = code;

		if (!add_subtree(chunk, p->tree, &code, 0)) {
			chunk->rc = PSR_ERR_MEMORY;
			return;
		}
		chunk->n_codes += (uint32_t)(code - from);
	}
	chunk->rc = octree_codes_pack(&chunk->coder, &chunk->levels, p->packing);
	coder_end(&chunk->coder);
	if (chunk->coder.has_failed)
		chunk->rc = PSR_ERR_MEMORY;
	if (chunk->rc == PSR_OK)
		pack_leaves(chunk, p->tree);
	octree_levels_fini(&chunk->levels);
}

/* Groups the roots. */
static void cut_chunks(struct packing *p)
{
	for (uint32_t r = 0; r < p->n_roots; r++) {
		const uint32_t leaves = (uint32_t)(p->leaf[r + 1] - p->leaf[r]);
		struct chunk *chunk = p->n_chunks > 0 ? &p->chunk[p->n_chunks - 1] : NULL;

		if (chunk == NULL || chunk->n_leaves + leaves > OCTREE_CHUNK) {
			chunk = &p->chunk[p->n_chunks++];
			chunk->root = r;
			chunk->leaf = p->leaf[r];
			chunk->levels.root = &p->path[r];
			chunk->levels.height = p->tree->levels - p->cut;
		}
		chunk->levels.n_roots = ++chunk->n_roots;
		chunk->n_leaves += leaves;
	}
}

static uint8_t *put(uint8_t *at, uint64_t value, int n)
{
	for (int i = 0; i < n; i++)
		*at++ = (uint8_t)(value >> 8 * i);
	return at;
}

struct top {
	const struct octree *tree;
	uint8_t *at;
	uint64_t n;
};

static int put_top(const struct octree_node *node, void *userdata)
{
	struct top *top = userdata;

	if (top->at != NULL)
		*top->at++ = top->tree->code[node->code];
	top->n++;
	return 0;
}

static int join(uint8_t **bytes, size_t *n_bytes, const struct packing *p)
{
	struct top top = { p->tree, NULL, 0 };
	const unsigned streams = chunk_streams(p->tree);
	size_t n = CHUNKS_HEADER + (size_t)p->n_chunks * chunk_entry_bytes(streams);
	uint8_t *at;

	for (int depth = 0; depth < p->cut; depth++)
		octree_walk(p->tree, depth, put_top, &top);
	n += top.n;
	for (uint32_t i = 0; i < p->n_chunks; i++) {
		n += p->chunk[i].coder.n;
		for (int s = 0; s < OCTREE_STREAMS; s++)
			n += p->chunk[i].attribute[s].n;
	}
	at = *bytes = malloc(n);
	if (at == NULL)
		return PSR_ERR_MEMORY;
	*n_bytes = n;
	at = put(at, (uint64_t)p->tree->levels | (uint64_t)p->packing << 8 | (uint64_t)p->cut << 16 | (uint64_t)streams << 24, 4);
	at = put(at, p->n_chunks, 4);
	at = put(at, p->tree->n_codes, 8);
	top.at = put(at, p->tree->n_leaves, 8);
	for (int depth = 0; depth < p->cut; depth++)
		octree_walk(p->tree, depth, put_top, &top);
	at = top.at;
	for (uint32_t i = 0; i < p->n_chunks; i++) {
		const struct chunk *chunk = &p->chunk[i];

		at = put(at, chunk->n_roots | (uint64_t)chunk->n_codes << 32, 8);
		at = put(at, chunk->n_leaves | (uint64_t)chunk->coder.n << 32, 8);
		for (int s = 0; s < OCTREE_STREAMS; s++)
			if (streams >> s & 1)
				at = put(at, chunk->attribute[s].n, 4);
	}
	for (int s = -1; s < OCTREE_STREAMS; s++)
		for (uint32_t i = 0; i < p->n_chunks; i++) {
			const struct coder *coder = s < 0 ? &p->chunk[i].coder : &p->chunk[i].attribute[s];

			if (coder->n > 0)
				memcpy(at, coder->bytes, coder->n);
			at += coder->n;
		}
	return PSR_OK;
}

int octree_pack(uint8_t **bytes, size_t *n_bytes, const struct octree *tree, enum octree_packing packing,
                struct psr_pool *pool, struct psr_error *err)
{
	struct packing p = { .tree = tree, .packing = packing };
	int rc = PSR_OK;

	find_cut(&p);
	p.path = calloc(p.depth_nodes, sizeof *p.path);
	p.code = calloc(p.depth_nodes, sizeof *p.code);
	p.leaf = calloc((size_t)p.depth_nodes + 1, sizeof *p.leaf);
	p.chunk = calloc(p.depth_nodes, sizeof *p.chunk);
	if (p.path == NULL || p.code == NULL || p.leaf == NULL || p.chunk == NULL) {
		rc = PSR_ERR_MEMORY;
	} else {
		octree_walk(tree, p.cut, add_root, &p);
		p.leaf[p.n_roots] = tree->n_leaves;
		cut_chunks(&p);
		psr_pool_for(pool, (int)p.n_chunks, pack_chunk, &p);
	}
	for (uint32_t i = 0; i < p.n_chunks && rc == PSR_OK; i++)
		rc = p.chunk[i].rc;
	if (rc == PSR_OK)
		rc = join(bytes, n_bytes, &p);
	for (uint32_t i = 0; i < p.n_chunks; i++) {
		free(p.chunk[i].coder.bytes);
		for (int s = 0; s < OCTREE_STREAMS; s++)
			free(p.chunk[i].attribute[s].bytes);
	}
	chunks_destroy(p.chunk, p.n_chunks);
	free(p.path);
	free(p.code);
	free(p.leaf);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "no memory to pack an octree of %llu leaves", (unsigned long long)tree->n_leaves);
	return PSR_OK;
}
