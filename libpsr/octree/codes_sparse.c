/* Codes of a sparse level's nodes: two contexts a bit, and no parts of one octant. */
#include "codes_node.h"

/* What the bit of an octant is foretold by; [1]: if the bit before it is 1. */
struct guess {
	uint32_t d[2], e; /* probabilities */
	unsigned set[2];
	int32_t share[2];
	words logit;      /* d's is missing */
};

ALWAYS words with_d(const struct guess *guess, const struct codes_model *model, unsigned which)
{
	words logit = guess->logit;

	logit[0] = model->logit[guess->d[which] >> 20];
	return logit;
}

ALWAYS void guess_octant(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j)
{
	guess->e = node->e[j];
	guess->logit = (words){ 0, model->logit[guess->e >> 20], 0, 0, 0, 256, node->sum[j], 0 };
	guess->set[0] = guess->set[1] = model->set_by_e[guess->e & 1023] + 2 * j;
}

ALWAYS void guess_d(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j,
                    unsigned so_far, unsigned which)
{
	guess->d[which] = node->d[j][j < 4 ? so_far : so_far >> 4];
	guess->set[which] += model->set_by_d[guess->d[which] & 1023] + (so_far != 0);
}

ALWAYS void guess_bit(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j,
                      unsigned so_far, unsigned which)
{
	guess_octant(guess, model, node, j);
	guess_d(guess, model, node, j, so_far, which);
	guess->share[which] = share_of(model, with_d(guess, model, which), guess->set[which]);
}

ALWAYS void guess_both(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j,
                       unsigned so_far)
{
	int32_t x[2];

	guess_octant(guess, model, node, j);
	guess_d(guess, model, node, j, so_far, 0);
	guess_d(guess, model, node, j, so_far | 1u << (j - 1), 1);
	words_weigh_both(x, with_d(guess, model, 0), model->weight[guess->set[0]], with_d(guess, model, 1),
	                 model->weight[guess->set[1]]);
	guess->share[0] = model->share[2048 + x[0]];
	guess->share[1] = model->share[2048 + x[1]];
}

/* To wait for a bit takes longer than to find what the next one is foretold by for both: so does decoding. */
ALWAYS void code_sparse(struct codes_job *job, uint32_t at, const struct octree_near *near, int is_decoding)
{
	struct codes_model *model = job->model;
	uint8_t *const code = &job->levels->at[job->level].code[at];
	struct coder coder = *job->coder; /* in registers */
	unsigned so_far = 0, bit = 0;
	const uint32_t *learnt = NULL; /* of the octant before, with which one may share its place */
	struct guess guess[8];
	struct coding node;

	begin_node(&node, job, near, 1);
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		const int is_both = is_decoding && j % 4 != 0;
		const unsigned which = is_both ? bit : 0;
		uint32_t *d;
		int32_t share;

		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		if (j == 4) {
			node.around.known |= octree_cube_of(so_far, OCTREE_SELF);
			find_slots(node.b, node.d, model, &node.around, 4, 1);
		}
		d = node.d[j] + (j < 4 ? so_far : so_far >> 4);
		if (!is_both || d == learnt)
			guess_bit(&guess[j], model, &node, j, so_far, which);
		share = guess[j].share[0];
		if (is_both) /* without waiting for memory */
			share ^= (share ^ guess[j].share[1]) & -(int32_t)bit;
		if (is_decoding && j % 4 != 3)
			guess_both(&guess[j + 1], model, &node, j + 1, so_far);
		bit = coder_bit(&coder, is_decoding, (uint32_t)share, is_decoding ? 0 : *code >> j & 1);
		so_far |= bit << j;
		node.step[j] = part_step(model, node.sum[j], bit);
		learn_weights(model, with_d(&guess[j], model, which), guess[j].set[which], guess[j].share[which], bit);
		*d = learn(model, guess[j].d[which], bit);
		node.e[j] = learn(model, guess[j].e, bit);
		learnt = d;
	}
	end_node(&node);
	*job->coder = coder;
	if (is_decoding)
		*code = (uint8_t)so_far;
}

void codes_sparse_pack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_sparse(userdata, node, near, 0);
}

void codes_sparse_unpack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	if (!((struct codes_job *)userdata)->coder->has_failed)
		code_sparse(userdata, node, near, 1);
}
