#include <string.h>
#include "unpacking.h"

static int unpack_step(struct chunk *chunk, struct codes_job *job, struct chunk_step *step, int end)
{
	const struct octree_level *last = &chunk->levels.at[end - 1];
	uint64_t codes = 0;
	int rc, level = job->level;

	rc = octree_codes_unpack(job, &step->coder, end, step->n_codes);
	if (rc != PSR_OK)
		return rc;
	for (; level < end; level++)
		codes += chunk->levels.at[level].n;
	if (codes != step->n_codes || !coder_is_at_end(&step->coder) ||
	    last->first[last->n - 1] + octree_count(last->code[last->n - 1]) != step->n_leaves)
		return PSR_ERR_FORMAT;
	return PSR_OK;
}

static void unpack_chunk(int i, void *userdata)
{
	const struct unpacking *u = userdata;
	struct chunk *chunk = &u->chunk[i];
	struct codes_job job;

	chunk->rc = octree_codes_begin(&job, &chunk->levels, u->packing);
	for (int s = 0; s < u->n_steps && chunk->rc == PSR_OK; s++) {
		chunk->rc = unpack_step(chunk, &job, &chunk->step[s], u->step[s].depth - u->cut);
		if (psr_is_cancelled(u->crew.cancel))
			chunk->rc = PSR_ERR_CANCELLED;
	}
	octree_codes_end(&job);
}

/* Of the last step. Offsets come after normals, which foretell them. */
static void unpack_leaves(int i, void *userdata)
{
	const struct unpacking *u = userdata;
	struct chunk *chunk = &u->chunk[i];
	struct chunk_step *step = &chunk->step[u->n_steps - 1];
	const struct octree_levels levels = chunk_levels(chunk, u->depth - u->cut);
	struct octree_attributes leaf = chunk_attributes(step, u->tree);

	for (enum octree_stream s = 0; s < OCTREE_STREAMS && chunk->rc == PSR_OK; s++) {
		if (!(u->streams >> s & 1))
			continue;
		chunk->rc = octree_attributes_unpack(&leaf, &step->attribute[s], &levels, s, u->is_older);
		if (chunk->rc == PSR_OK && !coder_is_at_end(&step->attribute[s]))
			chunk->rc = PSR_ERR_FORMAT;
		if (psr_is_cancelled(u->crew.cancel))
			chunk->rc = PSR_ERR_CANCELLED;
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
	const int skips = u->depth > OCTREE_SKIP_LEVELS ? u->depth - OCTREE_SKIP_LEVELS : 0, level = depth - u->cut;
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
	if (depth == u->depth - 1) {
		tree->n_leaves += octree_count(code);
		return;
	}
	for (unsigned left = code; left != 0; left &= left - 1)
		place_codes(u, path << 3 | (unsigned)__builtin_ctz(left), depth + 1);
}

/* Returns how many entries the skip index has. */
static uint64_t count_skips(const struct unpacking *u)
{
	const int skips = u->depth > OCTREE_SKIP_LEVELS ? u->depth - OCTREE_SKIP_LEVELS : 0;
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
	tree->levels = u->depth;
	tree->edge = 1.0;
	tree->code = malloc(u->n_codes);
	tree->skip = malloc(count_skips(u) * sizeof *tree->skip);
	if (u->streams >> OCTREE_NORMAL_STREAM & 1)
		tree->normal = malloc(u->n_leaves * sizeof *tree->normal);
	if (u->streams >> OCTREE_OFFSET_STREAM & 1)
		tree->offset = malloc(u->n_leaves);
	if (u->streams >> OCTREE_COLOR_STREAM & 1)
		tree->color = malloc(u->n_leaves * sizeof *tree->color);
	if (u->streams >> OCTREE_MATERIAL_STREAM & 1)
		tree->material = malloc(u->n_leaves * sizeof *tree->material);
	return tree->code != NULL && tree->skip != NULL && chunk_streams(tree) == u->streams ? PSR_OK : PSR_ERR_MEMORY;
}

/* Has the crew do something with each chunk. Returns what the chunks came to. */
static int do_chunks(struct unpacking *u, void (*fn)(int i, void *userdata), struct psr_error *err)
{
	int rc = psr_pool_for_until(u->crew.pool, u->crew.cancel, (int)u->n_chunks, fn, u);

	for (uint32_t i = 0; i < u->n_chunks && rc == PSR_OK; i++)
		if (u->chunk[i].rc == PSR_ERR_CANCELLED)
			rc = PSR_ERR_CANCELLED;
	if (rc == PSR_ERR_CANCELLED)
		return psr_fail(err, rc, "the unpacking of an octree was stopped");
	for (uint32_t i = 0; i < u->n_chunks; i++)
		if (u->chunk[i].rc == PSR_ERR_FORMAT)
			return psr_fail(err, PSR_ERR_FORMAT, "chunk %u of a packed octree is corrupt", i);
		else if (u->chunk[i].rc != PSR_OK)
			rc = u->chunk[i].rc;
	return rc == PSR_OK ? rc : psr_fail(err, rc, "no memory to unpack an octree");
}

static int unpack_all(struct unpacking *u, struct psr_error *err)
{
	const uint64_t n_roots = u->n_roots;
	int rc;

	u->path = calloc(n_roots, sizeof *u->path);
	u->chunk = chunks_create(u->n_chunks, u->n_steps);
	if (u->path == NULL || u->chunk == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to unpack an octree");
	rc = unpacking_read_chunks(u, err);
	if (rc != PSR_OK)
		return rc;
	u->n_roots = 0;
	find_paths(u, 0, 0);
	rc = do_chunks(u, unpack_chunk, err);
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
	return do_chunks(u, unpack_leaves, err);
}

static int unpack(struct unpacking *u, uint64_t max_leaves, const struct octree_crew *crew, struct psr_error *err)
{
	int rc = unpacking_read_header(u, max_leaves, err);

	if (crew != NULL)
		u->crew = *crew;
	if (rc == PSR_OK)
		rc = unpacking_read_top(u, err);
	if (rc == PSR_OK)
		rc = unpack_all(u, err);
	chunks_destroy(u->chunk, u->n_chunks);
	free(u->path);
	return rc;
}

int octree_unpack(struct octree **out, const uint8_t *bytes, size_t n_bytes, uint64_t max_leaves,
                  const struct octree_crew *crew, struct psr_error *err)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes };
	const int rc = unpack(&u, max_leaves, crew, err);

	if (rc == PSR_OK)
		*out = u.tree;
	else
		octree_destroy(u.tree);
	return rc;
}

int octree_unpack_into(struct octree *tree, const uint8_t *bytes, size_t n_bytes, const struct octree_crew *crew,
                       struct psr_error *err)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes, .tree = tree };

	return unpack(&u, UINT64_MAX, crew, err); /* all counts have to be the same */
}
