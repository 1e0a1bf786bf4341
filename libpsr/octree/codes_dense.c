/* Codes of a dense level's nodes: five contexts a bit, and parts of the sum that are an octant's own. */
#include "codes_node.h"

#define CONTEXTS 5
#define OWN_PARTS 5  /* of one octant */
#define PLANE 0x777u /* of WINDOW */

/* Which of the node's six faces have a neighbour. */
ALWAYS unsigned faces_of(uint32_t there)
{
	return (there >> 4 & 1) | (there >> 9 & 2) | (there >> 10 & 4) | (there >> 11 & 8) | (there >> 12 & 16) |
	       (there >> 17 & 32);
}

/* Eight bits of 64, one after the other: those at 0 and 1 of each axis of a neighbourhood, or at 0 and 2. */
ALWAYS unsigned gather_near(uint64_t x)
{
	const uint64_t at = x & 0x00330033, planes = (at | at >> 2) & 0x000f000f;

	return (unsigned)(planes | planes >> 12) & 255;
}

ALWAYS unsigned gather_far(uint64_t x)
{
	const uint64_t at = x & 0x50500000505u, rows = (at | at >> 1) & 0x30300000303u;
	const uint64_t planes = (rows | rows >> 6) & 0xf0000000fu;

	return (unsigned)(planes | planes >> 28) & 255;
}

ALWAYS unsigned code_bit(struct coding *node, struct codes_model *model, struct coder *coder, unsigned j,
                         unsigned so_far, int is_decoding, unsigned bit)
{
	const unsigned corner = octree_corner(j), of_half = j < 4 ? so_far : so_far >> 4;
	const uint64_t window = node->around.known >> corner, behind = node->around.behind >> corner;
	const unsigned near_ones = gather_near(behind >> 21), far_ones = gather_far(behind);
	uint32_t *const p[CONTEXTS] = { node->d[j] + of_half, &node->e[j], &model->a[node->faces << 8 | 1u << j | so_far],
		                            node->b[j] + of_half, &model->f[j << 14 | near_ones << 7 | far_ones] };
	int16_t *const part[OWN_PARTS] = { &model->of_own[j][so_far], &model->of_window[j][0][window & PLANE],
		                               &model->of_window[j][1][window >> 16 & PLANE], &model->of_near[j][near_ones],
		                               &model->of_far[j][far_ones] };
	const unsigned set = model->set_by_d[*p[0] & 1023] + model->set_by_e[*p[1] & 1023] + 2 * j + (so_far != 0);
	int32_t sum = node->sum[j], share;
	words logit;

#pragma GCC unroll 8
	for (int i = 0; i < OWN_PARTS; i++)
		sum += *part[i];
	sum = held(sum >> 4);
	logit = (words){ model->logit[*p[0] >> 20], model->logit[*p[1] >> 20], model->logit[*p[2] >> 20],
		             model->logit[*p[3] >> 20], model->logit[*p[4] >> 20], 256, (int16_t)sum, 0 };
	share = share_of(model, logit, set);
	bit = coder_bit(coder, is_decoding, (uint32_t)share, bit);
	node->step[j] = part_step(model, sum, bit);
#pragma GCC unroll 8
	for (int i = 0; i < OWN_PARTS; i++)
		*part[i] = word_held(*part[i] + node->step[j]);
	learn_weights(model, logit, set, share, bit);
#pragma GCC unroll 8
	for (int i = 0; i < CONTEXTS; i++)
		*p[i] = learn(model, *p[i], bit);
	node->around.known |= (uint64_t)bit << (corner + 21);
	node->around.behind |= (uint64_t)bit << (corner + 42);
	return bit;
}

ALWAYS void code_dense(struct codes_job *job, uint32_t at, const struct octree_near *near, int is_decoding)
{
	uint8_t *const code = &job->levels->at[job->level].code[at];
	struct coder coder = *job->coder; /* in registers */
	struct coding node;
	unsigned so_far = 0;

	begin_node(&node, job, near, 0);
	node.faces = faces_of(near->there);
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		if (j == 4)
			find_slots(node.b, node.d, job->model, &node.around, 4, 0);
		so_far |= code_bit(&node, job->model, &coder, j, so_far, is_decoding, is_decoding ? 0 : *code >> j & 1) << j;
	}
	end_node(&node);
	*job->coder = coder;
	if (is_decoding)
		*code = (uint8_t)so_far;
}

void codes_dense_pack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_dense(userdata, node, near, 0);
}

void codes_dense_unpack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	if (!((struct codes_job *)userdata)->coder->has_failed)
		code_dense(userdata, node, near, 1);
}
