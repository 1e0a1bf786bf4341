#include <string.h>
#include "subtree.h"

/* Reads up to 8 codes, the first one lowest. */
static uint64_t codes_at(const uint8_t *code, unsigned n)
{
	uint64_t word = 0;

	for (unsigned i = 0; i < n; i++)
		word |= (uint64_t)code[i] << 8 * i;
	return word;
}

const uint8_t *octree_subtree_count(uint64_t *n, const uint8_t *code, const uint8_t *end, int height)
{
	unsigned left;

	if (code == end || *code == 0)
		return NULL;
	left = *code++;
	n[height]++;
	if (height == 2) {
		/* The codes of the node's children follow each other. */
		const unsigned count = octree_popcount(left);
		const uint64_t mask = UINT64_MAX >> 8 * (8 - count), ones = 0x0101010101010101u;
		uint64_t word, others;

		if ((size_t)(end - code) < count)
			return NULL;
		word = end - code >= 8 ? codes_at(code, 8) & mask : codes_at(code, count);
		others = word | ~mask;
		if (((others - ones) & ~others & 0x80 * ones) != 0) /* one of its bytes is 0 */
			return NULL;
		n[1] += count;
		n[0] += octree_popcount(word);
		return code + count;
	}
	for (; left != 0 && code != NULL; left &= left - 1)
		code = octree_subtree_count(n, code, end, height - 1);
	return code;
}

struct check {
	const struct octree *tree;
	int height;
	/* Of what stands above the subtrees: the next code, the next subtree. */
	uint64_t code, skip;
	const char *wrong; /* at `code` */
	struct { uint64_t code; const char *wrong; } task[OCTREE_TASKS];
};

static const char not_indexed[] = "skip index does not fit its codes";

/* Returns where the codes of a subtree end by the index; 0: that is nowhere behind its beginning. */
static uint64_t end_by_index(const struct octree *tree, uint64_t i)
{
	const struct octree_skip *skip = &tree->skip[i];
	uint64_t end = tree->n_codes;

	if (i + 1 < tree->n_skips) {
		if (skip[1].path <= skip->path || skip[1].code > end || skip[1].code < octree_codes_above(tree, i + 1))
			return 0;
		end = skip[1].code - octree_codes_above(tree, i + 1);
	}
	return end > skip->code ? end : 0;
}

/* Checks the codes above the subtrees, and that the index has the nodes to which they lead. */
static void check_above(struct check *c, uint64_t path, int depth)
{
	const struct octree *tree = c->tree;
	uint8_t code;

	if (depth == tree->levels - c->height) {
		const struct octree_skip *skip = &tree->skip[c->skip];
		const uint64_t end = c->skip < tree->n_skips ? end_by_index(tree, c->skip) : 0;

		if (end == 0 || skip->path != path || skip->code != c->code) {
			c->wrong = not_indexed;
			return;
		}
		c->code = end;
		c->skip++;
		return;
	}
	if (c->code >= tree->n_codes) {
		c->wrong = "codes end early";
		return;
	}
	code = tree->code[c->code++];
	if (code == 0)
		c->wrong = "codes contain 0";
	for (unsigned left = code; left != 0 && c->wrong == NULL; left &= left - 1)
		check_above(c, path << 3 | (unsigned)__builtin_ctz(left), depth + 1);
}

static const char *check_subtree(const struct check *c, uint64_t i)
{
	const struct octree *tree = c->tree;
	const struct octree_skip *skip = &tree->skip[i];
	const int is_last = i + 1 == tree->n_skips;
	const uint8_t *const code = tree->code + skip->code, *const end = tree->code + end_by_index(tree, i), *at;
	uint64_t n[OCTREE_SKIP_LEVELS + 1] = { 0 };

	at = octree_subtree_count(n, code, end, c->height);
	if (at == NULL)
		return memchr(code, 0, (size_t)(end - code)) != NULL ? "codes contain 0" : is_last ? "codes end early" : not_indexed;
	if (at != end)
		return is_last ? "codes go on behind the last subtree" : not_indexed;
	if (n[0] != (is_last ? tree->n_leaves : skip[1].leaf) - skip->leaf || (i == 0 && skip->leaf != 0))
		return is_last ? "codes have another number of leaves than it says" : not_indexed;
	return NULL;
}

static void check_task(int task, void *userdata)
{
	struct check *c = userdata;
	const uint64_t end = octree_task_first(c->tree, task + 1);

	for (uint64_t i = octree_task_first(c->tree, task); i < end && c->task[task].wrong == NULL; i++) {
		c->task[task].wrong = check_subtree(c, i);
		c->task[task].code = c->tree->skip[i].code;
	}
}

int octree_check(const struct octree *tree, struct psr_pool *pool, struct psr_error *err)
{
	struct check c = { .tree = tree, .height = octree_subtree_height(tree) };

	if (tree->levels < OCTREE_LEAST_LEVELS || tree->levels > OCTREE_MOST_LEVELS)
		return psr_fail(err, PSR_ERR_FORMAT, "an octree of %d levels; %d to %d are possible", tree->levels,
		                OCTREE_LEAST_LEVELS, OCTREE_MOST_LEVELS);
	check_above(&c, 0, 0);
	if (c.wrong == NULL && (c.code != tree->n_codes || c.skip != tree->n_skips))
		c.wrong = not_indexed;
	if (c.wrong == NULL)
		psr_pool_for(pool, OCTREE_TASKS, check_task, &c);
	for (int i = 0; i < OCTREE_TASKS && c.wrong == NULL; i++) {
		c.wrong = c.task[i].wrong;
		c.code = c.task[i].code;
	}
	if (c.wrong != NULL)
		return psr_fail(err, PSR_ERR_FORMAT, "an octree's %s, at code %llu of %llu", c.wrong, (unsigned long long)c.code,
		                (unsigned long long)tree->n_codes);
	return PSR_OK;
}
