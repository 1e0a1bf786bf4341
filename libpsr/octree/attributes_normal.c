#include "attributes_job.h"

/* Sorts the children of a triangle, or the octants, by how near they are to a direction, greatest scores first. The
 * middle of a child is that of its innermost triangle, almost. */
static void rank_children(unsigned order[8], int64_t score[8], const struct job *job, int depth, unsigned parent,
                          const int64_t sum[3])
{
	const unsigned n = depth == 0 ? 8 : 4;

	for (unsigned j = 0; j < n; j++) {
		unsigned at = j;
		int64_t s;
		int v[3];

		unit_of(job, (uint16_t)((parent * 4 + j) << 2 * (DEPTHS - 1 - depth)), v);
		s = sum[0] * v[0] + sum[1] * v[1] + sum[2] * v[2];
		for (; at > 0 && score[at - 1] < s; at--) {
			score[at] = score[at - 1];
			order[at] = order[at - 1];
		}
		score[at] = s;
		order[at] = j;
	}
}

static unsigned rank_of(const unsigned order[8], unsigned child)
{
	unsigned rank = 0;

	while (order[rank] != child)
		rank++;
	return rank;
}

/* Differences of scores by which margins are told. A direction on the border of two children has none; in the middle of
 * one, half the square of the angle between both. Times 4^depth that is much the same at all depths. */
struct steps {
	int64_t first[MARGINS - 1], second[SECONDS - 1];
};

static void find_steps(struct steps *steps, const struct job *job)
{
	static const int first[MARGINS - 1] = { 50, 100, 200, 300, 450, 650, 900 }, second[SECONDS - 1] = { 150, 400, 800 };
	/* Without neighbours no margin is reached: nothing is known. */
	const int64_t unit = job->weight > 0 ? (int64_t)job->weight * UNIT * UNIT / 1024 : INT64_MAX / 1024;

	for (int i = 0; i < MARGINS - 1; i++)
		steps->first[i] = first[i] * unit;
	for (int i = 0; i < SECONDS - 1; i++)
		steps->second[i] = second[i] * unit;
}

static uint32_t *find_odds(const struct job *job, const struct steps *steps, int depth, int spread, unsigned is_first,
                           const int64_t score[8])
{
	const int64_t first = (score[0] - score[1]) << 2 * depth, second = (score[1] - score[2]) << 2 * depth;
	unsigned margin = 0, next = 0;

	if (job->is_older)
		return job->odds->normal[depth][spread][count_of(job)][is_first][0];
	for (int i = 0; i < MARGINS - 1; i++)
		margin += first >= steps->first[i];
	for (int i = 0; i < SECONDS - 1; i++)
		next += second >= steps->second[i];
	return job->odds->normal[depth][spread][next][is_first][margin];
}

static uint16_t code_nested(struct job *job, uint16_t normal, const int64_t sum[3])
{
	const uint64_t full = (uint64_t)job->weight * UNIT * (uint64_t)job->weight * UNIT;
	const uint64_t square = (uint64_t)(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
	const uint64_t lost = full > square ? full - square : 1;
	const int log = log2_floor(full / lost), spread = log < SPREADS ? log : SPREADS - 1;
	unsigned index = 0, is_first = 1;
	struct steps steps;

	find_steps(&steps, job);
	for (int depth = 0; depth < DEPTHS; depth++) {
		const int n_bits = depth == 0 ? 3 : 2;
		const unsigned child = normal >> 2 * (DEPTHS - 1 - depth) & ((1u << n_bits) - 1);
		unsigned order[8], rank;
		int64_t score[8];

		rank_children(order, score, job, depth, index, sum);
		rank = code_bits(job, find_odds(job, &steps, depth, spread, is_first, score), n_bits,
		                 job->is_decoding ? 0 : rank_of(order, child));
		index = index << n_bits | order[rank];
		is_first &= rank == 0;
	}
	return (uint16_t)index;
}

void attributes_code_normal(struct job *job, uint32_t leaf, uint64_t path)
{
	uint16_t *const normal = job->attributes.normal;
	const uint16_t before = leaf > 0 ? normal[leaf - 1] : 0;
	const int parting = log2_floor(path ^ job->last_path) / 3;
	int64_t sum[3] = { 0, 0, 0 };
	int is_agreed = 1;

	for (unsigned i = 0; i < job->n; i++) {
		int v[3];

		unit_of(job, normal[job->near[i].at], v);
		is_agreed &= normal[job->near[i].at] == before;
		for (int c = 0; c < 3; c++)
			sum[c] += (int64_t)job->near[i].weight * v[c];
	}
	/* Leaves of a flat face have one normal. */
	job->was_same = (int)code_bit(job, &job->odds->same[parting < 7 ? parting : 7][job->was_same][is_agreed], 5,
	                              normal[leaf] == before);
	if (!job->is_decoding && !job->was_same)
		code_nested(job, normal[leaf], sum);
	else if (job->is_decoding)
		normal[leaf] = job->was_same ? before : code_nested(job, 0, sum);
}
