#include <string.h>
#include "unpacking.h"

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

/* Checks a step of the table against the one before it. */
static int check_step(const struct octree_step *step, int s, int n, const struct unpacking *u, struct psr_error *err)
{
	const struct octree_step before = s > 0 ? step[s - 1] : (struct octree_step){ .depth = u->cut };
	const struct octree_step *of = &step[s];

	if (of->depth > u->levels || of->depth <= before.depth || of->depth < OCTREE_LEAST_LEVELS ||
	    (s == n - 1 && of->depth != u->levels))
		return psr_fail(err, PSR_ERR_FORMAT, "step %d of a packed octree of %d levels goes from depth %d to %d", s,
		                u->levels, before.depth, of->depth);
	if (of->end <= before.end || of->n_leaves < before.n_leaves || of->n_codes <= before.n_codes ||
	    of->n_codes / (uint64_t)of->depth > of->n_leaves)
		return psr_fail(err, PSR_ERR_FORMAT, "step %d of a packed octree has %llu leaves and %llu codes up to byte %llu",
		                s, (unsigned long long)of->n_leaves, (unsigned long long)of->n_codes,
		                (unsigned long long)of->end);
	return PSR_OK;
}

static int read_way(struct unpacking *u, uint8_t way)
{
	u->packing = way == CHUNKS_WAY_FAST || way == CHUNKS_WAY_OLDER_FAST ? OCTREE_FAST : OCTREE_SMALL;
	u->is_older = way == CHUNKS_WAY_OLDER_FAST || way == CHUNKS_WAY_OLDER_SMALL;
	return u->is_older || way == CHUNKS_WAY_FAST || way == CHUNKS_WAY_SMALL;
}

/* Reads what tells the steps. Returns their number, or FORMAT. */
static int read_steps(struct unpacking *u, struct psr_error *err)
{
	const uint8_t *b = u->at;
	int is_known;
	uint64_t n;

	if (u->end - u->at < CHUNKS_HEADER)
		return is_cut_short(err);
	u->begin = b;
	u->levels = b[0];
	is_known = read_way(u, b[1]);
	u->cut = b[2];
	u->streams = b[3];
	u->n_chunks = (uint32_t)get(b + 4, 4);
	n = get(b + 8, 8);
	if (u->levels < OCTREE_LEAST_LEVELS || u->levels > OCTREE_MOST_LEVELS || !is_known || u->cut >= u->levels ||
	    u->streams >> OCTREE_STREAMS != 0 || n == 0 ||
	    n > (chunk_may_step(u->streams) ? OCTREE_MOST_STEPS : 1))
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree of %d levels, cut at %d, packed by way %d, of streams %#x, "
		                "in %llu steps, is not known", u->levels, u->cut, b[1], u->streams, (unsigned long long)n);
	u->at += CHUNKS_HEADER;
	if ((uint64_t)(u->end - u->at) < n * CHUNKS_STEP)
		return is_cut_short(err);
	for (int s = 0; s < (int)n; s++, u->at += CHUNKS_STEP) {
		const uint64_t depth = get(u->at, 8);

		u->step[s] = (struct octree_step){ .depth = depth <= OCTREE_MOST_LEVELS ? (int)depth : OCTREE_MOST_LEVELS + 1,
			                               .n_codes = get(u->at + 8, 8), .n_leaves = get(u->at + 16, 8),
			                               .end = get(u->at + 24, 8) };
		if (check_step(u->step, s, (int)n, u, err) != PSR_OK)
			return PSR_ERR_FORMAT;
	}
	return (int)n;
}

int unpacking_read_header(struct unpacking *u, uint64_t max_leaves, struct psr_error *err)
{
	const uint64_t n_bytes = (uint64_t)(u->end - u->at);
	const int n = read_steps(u, err);
	const struct octree_step *last;

	if (n < 0)
		return n;
	while (u->n_steps < n && u->step[u->n_steps].end <= n_bytes)
		u->n_steps++;
	if (u->n_steps == 0 || u->step[u->n_steps - 1].end != n_bytes)
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree has %llu bytes, and none of its steps ends there",
		                (unsigned long long)n_bytes);
	last = &u->step[u->n_steps - 1];
	u->depth = last->depth;
	u->n_codes = last->n_codes;
	u->n_leaves = last->n_leaves;
	if (u->tree != NULL && (u->tree->levels != u->depth || u->tree->n_codes != u->n_codes ||
	                        u->tree->n_leaves != u->n_leaves || chunk_streams(u->tree) != u->streams))
		return psr_fail(err, PSR_ERR_FORMAT, "a packed octree is of %d levels, %llu codes, %llu leaves, streams %#x; "
		                "it should be of %d, %llu, %llu, %#x", u->depth, (unsigned long long)u->n_codes,
		                (unsigned long long)u->n_leaves, u->streams, u->tree->levels,
		                (unsigned long long)u->tree->n_codes, (unsigned long long)u->tree->n_leaves,
		                chunk_streams(u->tree));
	if (u->n_leaves > max_leaves)
		return psr_fail(err, PSR_ERR_LIMIT, "a packed octree of %llu leaves; the limit is %llu",
		                (unsigned long long)u->n_leaves, (unsigned long long)max_leaves);
	return PSR_OK;
}

/* Finds how many nodes each depth above the cut has, and of the cut. */
int unpacking_read_top(struct unpacking *u, struct psr_error *err)
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
	if (n > u->n_leaves || u->n_chunks == 0 || u->n_chunks > n ||
	    u->n_chunks > (uint64_t)(u->end - u->at) / (4 + chunk_entry_bytes(u->streams)))
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

static void read_roots(struct unpacking *u)
{
	uint64_t roots = 0;

	for (uint32_t i = 0; i < u->n_chunks; i++, u->at += 4) {
		struct chunk *chunk = &u->chunk[i];

		chunk->n_roots = (uint32_t)get(u->at, 4);
		chunk->root = (uint32_t)roots;
		chunk->levels.root = &u->path[roots];
		chunk->levels.n_roots = chunk->n_roots;
		chunk->levels.height = u->levels - u->cut;
		roots += chunk->n_roots;
		if (chunk->n_roots == 0 || roots > u->n_roots)
			break;
	}
}

/* Reads a step's table, and opens its bytes. `codes`: of the steps before, and then of this one, too. */
static int read_step(struct unpacking *u, int s, uint64_t *codes, struct psr_error *err)
{
	const size_t size = chunk_entry_bytes(u->streams);
	const uint8_t *const entries = u->at;
	uint64_t leaves = 0;
	size_t column = 8;

	if ((uint64_t)(u->end - u->at) < u->n_chunks * size)
		return is_cut_short(err);
	u->at += u->n_chunks * size;
	for (uint32_t i = 0; i < u->n_chunks; i++) {
		const uint8_t *entry = entries + i * size;
		struct chunk_step *step = &u->chunk[i].step[s];

		*step = (struct chunk_step){ .n_codes = (uint32_t)get(entry, 4), .n_leaves = (uint32_t)get(entry + 4, 4),
			                         .leaf = leaves };
		if (step->n_leaves > OCTREE_CHUNK)
			return psr_fail(err, PSR_ERR_FORMAT, "chunk %u of a packed octree has %u leaves", i, step->n_leaves);
		*codes += step->n_codes;
		leaves += step->n_leaves;
	}
	for (int stream = -1; stream < OCTREE_STREAMS; stream++) {
		if (stream >= 0 && !(u->streams >> stream & 1))
			continue;
		for (uint32_t i = 0; i < u->n_chunks; i++) {
			struct chunk_step *step = &u->chunk[i].step[s];

			if (!take_bytes(u, stream < 0 ? &step->coder : &step->attribute[stream], entries + i * size + column))
				return is_cut_short(err);
		}
		column += 4;
	}
	if (*codes != u->step[s].n_codes || leaves != u->step[s].n_leaves || (uint64_t)(u->at - u->begin) != u->step[s].end)
		return psr_fail(err, PSR_ERR_FORMAT, "the chunks of step %d of a packed octree do not add up to what it says",
		                s);
	return PSR_OK;
}

int unpacking_read_chunks(struct unpacking *u, struct psr_error *err)
{
	const struct chunk *last = &u->chunk[u->n_chunks - 1];
	uint64_t codes = u->n_top;
	int rc = PSR_OK;

	read_roots(u);
	if (last->n_roots == 0 || last->root + (uint64_t)last->n_roots != u->n_roots)
		return psr_fail(err, PSR_ERR_FORMAT, "the chunks of a packed octree do not have its %llu subtrees",
		                (unsigned long long)u->n_roots);
	for (int s = 0; s < u->n_steps && rc == PSR_OK; s++)
		rc = read_step(u, s, &codes, err);
	return rc;
}

int octree_packed_steps(struct octree_step *step, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes };
	const int n = read_steps(&u, err);

	memcpy(step, u.step, n > 0 ? (size_t)n * sizeof *step : 0);
	return n;
}

void octree_packed_shares(struct octree_shares *shares, const uint8_t *bytes, size_t n_bytes)
{
	struct unpacking u = { .at = bytes, .end = bytes + n_bytes };

	*shares = (struct octree_shares){ .codes = n_bytes };
	if (unpacking_read_header(&u, UINT64_MAX, NULL) != PSR_OK || unpacking_read_top(&u, NULL) != PSR_OK)
		return;
	u.at += 4 * (size_t)u.n_chunks;
	for (int s = 0; s < u.n_steps; s++) {
		for (uint32_t i = 0; i < u.n_chunks; i++) {
			const uint8_t *at = u.at + i * chunk_entry_bytes(u.streams) + CHUNKS_ENTRY;

			for (int k = 0; k < OCTREE_STREAMS; k++) {
				if (!(u.streams >> k & 1))
					continue;
				*(s == u.n_steps - 1 ? &shares->stream[k] : &shares->coarser) += get(at, 4);
				shares->codes -= get(at, 4);
				at += 4;
			}
		}
		u.at = bytes + u.step[s].end;
	}
}
