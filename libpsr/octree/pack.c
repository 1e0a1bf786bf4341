#include <string.h>
#include "chunks.h"

struct packing {
	const struct octree *tree;
	enum octree_packing packing;
	int cut, n_steps;
	const struct octree *of_step[OCTREE_MOST_STEPS]; /* the tree that ends with each step; the last is `tree` */
	struct octree_step step[OCTREE_MOST_STEPS];
	uint32_t n_roots, n_chunks, depth_nodes;
	uint64_t most;            /* leaves of a node of the depth tried last */
	uint64_t from;            /* the last node's first leaf */
	uint64_t *path, *code, *leaf; /* of the roots; leaf has one more */
	struct chunk *chunk;
};

struct chunk *chunks_create(uint32_t n_chunks, int n_steps)
{
	const size_t n = n_chunks, steps = (size_t)n_steps;
	struct chunk *chunk = calloc(n * (sizeof *chunk + steps * sizeof *chunk->step) + 1, 1);

	for (size_t i = 0; i < n && chunk != NULL; i++)
		chunk[i].step = (struct chunk_step *)(void *)(chunk + n) + i * steps;
	return chunk;
}

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

/* ---- steps ---- */

/* Returns the tree that ends a step earlier; NULL without memory. */
static struct octree *step_back(const struct octree *tree)
{
	struct octree *between = octree_coarser(tree), *coarser = between != NULL ? octree_coarser(between) : NULL;

	octree_destroy(between);
	return coarser;
}

/* Makes the trees of the steps, and tells their counts. Returns 0 without memory. */
static int find_steps(struct packing *p, int is_progressive)
{
	const int least = p->cut + 1 > OCTREE_LEAST_LEVELS ? p->cut + 1 : OCTREE_LEAST_LEVELS;
	const struct octree *tree = p->tree, *made[OCTREE_MOST_STEPS];
	int n = 0;

	made[n++] = tree;
	is_progressive &= chunk_may_step(chunk_streams(tree));
	while (is_progressive && tree != NULL && tree->n_leaves > OCTREE_FIRST_STEP &&
	       tree->levels - OCTREE_STEP_LEVELS >= least)
		made[n++] = tree = step_back(tree);
	p->n_steps = n;
	for (int s = 0; s < n; s++) {
		p->of_step[s] = made[n - 1 - s];
		if (p->of_step[s] != NULL)
			p->step[s] = (struct octree_step){ .depth = p->of_step[s]->levels, .n_codes = p->of_step[s]->n_codes,
				                               .n_leaves = p->of_step[s]->n_leaves };
	}
	return tree != NULL;
}

static void free_steps(struct packing *p)
{
	for (int s = 0; s < p->n_steps - 1; s++)
		octree_destroy((struct octree *)(uintptr_t)p->of_step[s]);
}

/* ---- chunks ---- */

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

static void pack_codes(int i, void *userdata)
{
	const struct packing *p = userdata;
	struct chunk *chunk = &p->chunk[i];
	struct codes_job job;

	for (uint32_t r = 0; r < chunk->n_roots; r++) {
		uint64_t code = p->code[chunk->root + r];

		if (!add_subtree(chunk, p->tree, &code, 0)) {
			chunk->rc = PSR_ERR_MEMORY;
			return;
		}
	}
	chunk->rc = octree_codes_begin(&job, &chunk->levels, p->packing);
	for (int s = 0, level = 0; s < p->n_steps && chunk->rc == PSR_OK; s++) {
		struct chunk_step *step = &chunk->step[s];
		const int end = p->step[s].depth - p->cut;

		for (; level < end; level++)
			step->n_codes += chunk->levels.at[level].n;
		step->n_leaves = s < p->n_steps - 1 ? chunk->levels.at[end].n : chunk->n_leaves;
		coder_begin(&step->coder);
		chunk->rc = octree_codes_pack(&job, &step->coder, end);
		coder_end(&step->coder);
		if (step->coder.has_failed)
			chunk->rc = PSR_ERR_MEMORY;
	}
	octree_codes_end(&job);
}

static int pack_stream(struct chunk *chunk, const struct packing *p, int s, enum octree_stream stream)
{
	const struct octree_levels levels = chunk_levels(chunk, p->step[s].depth - p->cut);
	const struct octree_attributes leaf = chunk_attributes(&chunk->step[s], p->of_step[s]);
	struct coder *coder = &chunk->step[s].attribute[stream];
	int rc;

	coder_begin(coder);
	rc = octree_attributes_pack(coder, &levels, &leaf, stream);
	coder_end(coder);
	return coder->has_failed ? PSR_ERR_MEMORY : rc;
}

/* Packs the leaves of a chunk whose levels are there. */
static void pack_leaves(int i, void *userdata)
{
	const struct packing *p = userdata;
	struct chunk *chunk = &p->chunk[i];
	const unsigned streams = chunk_streams(p->tree);

	for (int s = 0; s < p->n_steps; s++)
		for (enum octree_stream stream = 0; stream < OCTREE_STREAMS && chunk->rc == PSR_OK; stream++)
			if (streams >> stream & 1)
				chunk->rc = pack_stream(chunk, p, s, stream);
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
			chunk->levels.root = &p->path[r];
			chunk->levels.height = p->tree->levels - p->cut;
		}
		chunk->levels.n_roots = ++chunk->n_roots;
		chunk->n_leaves += leaves;
	}
}

/* Tells each chunk where its leaves begin in the trees of all steps. */
static void place_leaves(const struct packing *p)
{
	for (int s = 0; s < p->n_steps; s++)
		for (uint32_t i = 1; i < p->n_chunks; i++)
			p->chunk[i].step[s].leaf = p->chunk[i - 1].step[s].leaf + p->chunk[i - 1].step[s].n_leaves;
}

/* ---- bytes ---- */

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

/* Finds where each step ends; returns the end of the last one. */
static size_t find_ends(struct packing *p, uint64_t n_top)
{
	size_t n = CHUNKS_HEADER + (size_t)p->n_steps * CHUNKS_STEP + n_top + 4 * (size_t)p->n_chunks;

	for (int s = 0; s < p->n_steps; s++) {
		n += (size_t)p->n_chunks * chunk_entry_bytes(chunk_streams(p->tree));
		for (uint32_t i = 0; i < p->n_chunks; i++) {
			const struct chunk_step *step = &p->chunk[i].step[s];

			n += step->coder.n;
			for (int k = 0; k < OCTREE_STREAMS; k++)
				n += step->attribute[k].n;
		}
		p->step[s].end = n;
	}
	return n;
}

static uint8_t *put_step(uint8_t *at, const struct packing *p, int s)
{
	const unsigned streams = chunk_streams(p->tree);

	for (uint32_t i = 0; i < p->n_chunks; i++) {
		const struct chunk_step *step = &p->chunk[i].step[s];

		at = put(at, step->n_codes | (uint64_t)step->n_leaves << 32, 8);
		at = put(at, step->coder.n, 4);
		for (int k = 0; k < OCTREE_STREAMS; k++)
			if (streams >> k & 1)
				at = put(at, step->attribute[k].n, 4);
	}
	for (int k = -1; k < OCTREE_STREAMS; k++)
		for (uint32_t i = 0; i < p->n_chunks; i++) {
			const struct chunk_step *step = &p->chunk[i].step[s];
			const struct coder *coder = k < 0 ? &step->coder : &step->attribute[k];

			if (coder->n > 0)
				memcpy(at, coder->bytes, coder->n);
			at += coder->n;
		}
	return at;
}

static int join(uint8_t **bytes, size_t *n_bytes, struct packing *p)
{
	struct top top = { p->tree, NULL, 0 };
	uint8_t *at;

	for (int depth = 0; depth < p->cut; depth++)
		octree_walk(p->tree, depth, put_top, &top);
	*n_bytes = find_ends(p, top.n);
	at = *bytes = malloc(*n_bytes);
	if (at == NULL)
		return PSR_ERR_MEMORY;
	at = put(at, (uint64_t)p->tree->levels, 1);
	at = put(at, p->packing == OCTREE_FAST ? CHUNKS_WAY_FAST : CHUNKS_WAY_SMALL, 1);
	at = put(at, (uint64_t)p->cut, 1);
	at = put(at, chunk_streams(p->tree), 1);
	at = put(at, p->n_chunks, 4);
	at = put(at, (uint64_t)p->n_steps, 8);
	for (int s = 0; s < p->n_steps; s++) {
		at = put(at, (uint64_t)p->step[s].depth, 8);
		at = put(at, p->step[s].n_codes, 8);
		at = put(at, p->step[s].n_leaves, 8);
		at = put(at, p->step[s].end, 8);
	}
	top.at = at;
	for (int depth = 0; depth < p->cut; depth++)
		octree_walk(p->tree, depth, put_top, &top);
	at = top.at;
	for (uint32_t i = 0; i < p->n_chunks; i++)
		at = put(at, p->chunk[i].n_roots, 4);
	for (int s = 0; s < p->n_steps; s++)
		at = put_step(at, p, s);
	return PSR_OK;
}

static int pack_all(uint8_t **bytes, size_t *n_bytes, struct packing *p, struct psr_pool *pool)
{
	/* Two chunks that follow each other have more leaves than one may have. */
	const uint64_t most = 2 * (p->tree->n_leaves / OCTREE_CHUNK) + 1;

	p->path = calloc(p->depth_nodes, sizeof *p->path);
	p->code = calloc(p->depth_nodes, sizeof *p->code);
	p->leaf = calloc((size_t)p->depth_nodes + 1, sizeof *p->leaf);
	p->chunk = chunks_create(p->depth_nodes < most ? p->depth_nodes : (uint32_t)most, p->n_steps);
	if (p->path == NULL || p->code == NULL || p->leaf == NULL || p->chunk == NULL)
		return PSR_ERR_MEMORY;
	octree_walk(p->tree, p->cut, add_root, p);
	p->leaf[p->n_roots] = p->tree->n_leaves;
	cut_chunks(p);
	psr_pool_for(pool, (int)p->n_chunks, pack_codes, p);
	place_leaves(p);
	psr_pool_for(pool, (int)p->n_chunks, pack_leaves, p);
	for (uint32_t i = 0; i < p->n_chunks; i++)
		if (p->chunk[i].rc != PSR_OK)
			return p->chunk[i].rc;
	return join(bytes, n_bytes, p);
}

static int pack(uint8_t **bytes, size_t *n_bytes, struct packing *p, struct psr_pool *pool, int is_progressive)
{
	int rc;

	find_cut(p);
	rc = find_steps(p, is_progressive) ? pack_all(bytes, n_bytes, p, pool) : PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < p->n_chunks; i++)
		for (int s = 0; s < p->n_steps; s++) {
			free(p->chunk[i].step[s].coder.bytes);
			for (int k = 0; k < OCTREE_STREAMS; k++)
				free(p->chunk[i].step[s].attribute[k].bytes);
		}
	chunks_destroy(p->chunk, p->n_chunks);
	free_steps(p);
	free(p->path);
	free(p->code);
	free(p->leaf);
	return rc;
}

int octree_pack(uint8_t **bytes, size_t *n_bytes, const struct octree *tree, enum octree_packing packing,
                struct psr_pool *pool, struct psr_error *err)
{
	struct packing p = { .tree = tree, .packing = packing & ~OCTREE_STEPS };
	const int rc = pack(bytes, n_bytes, &p, pool, (packing & OCTREE_STEPS) != 0);

	if (rc != PSR_OK)
		return psr_fail(err, rc, "no memory to pack an octree of %llu leaves", (unsigned long long)tree->n_leaves);
	return PSR_OK;
}
