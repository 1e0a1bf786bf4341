#include "codes.h"

/* Mirrored so that the octant is octant 0 of its parent: the eight octants share what they learn. */
struct model {
	uint16_t p[256][256];       /* by the parent's code, and the code's bits so far below a leading 1 */
	uint8_t mirrored[8][256];
};

void *codes_fast_model(void)
{
	struct model *model = malloc(sizeof *model);

	for (unsigned code = 0; code < 256 && model != NULL; code++) {
		for (int so_far = 0; so_far < 256; so_far++)
			model->p[code][so_far] = CODER_EVEN;
		for (unsigned j = 0; j < 8; j++) {
			unsigned mirrored = 0;

			for (unsigned i = 0; i < 8; i++)
				mirrored |= (code >> (i ^ j) & 1) << i;
			model->mirrored[j][code] = (uint8_t)mirrored;
		}
	}
	return model;
}

static inline __attribute__((always_inline)) unsigned code_byte(struct coder *coder, int is_decoding, uint16_t p[256],
                                                                unsigned code)
{
	unsigned so_far = 1;

	for (int i = 7; i > 0; i--)
		so_far = so_far << 1 | coder_adaptive(coder, is_decoding, &p[so_far], 4, code >> i & 1);
	/* No code is 0. */
	return (uint8_t)(so_far == 128 ? 1 : so_far << 1 | coder_adaptive(coder, is_decoding, &p[so_far], 4, code & 1));
}

static inline __attribute__((always_inline)) int code_level(struct codes_job *job, struct coder *coder, int is_decoding)
{
	struct model *model = job->model;
	const struct octree_level *above = job->level > 0 ? &job->levels->at[job->level - 1] : NULL;
	const struct octree_level *level = &job->levels->at[job->level];
	const uint32_t n = above != NULL ? above->n : job->levels->n_roots;

	for (uint32_t i = 0, next = 0; i < n; i++) {
		const uint8_t parent = above != NULL ? above->code[i] : 1;

		for (unsigned left = parent; left != 0; left &= left - 1) {
			const unsigned j = (unsigned)__builtin_ctz(left);
			uint16_t *p = model->p[model->mirrored[j][parent]];

			if (!is_decoding)
				code_byte(coder, 0, p, model->mirrored[j][level->code[next++]]);
			else if (!codes_keep(job, coder, model->mirrored[j][code_byte(coder, 1, p, 0)]))
				return 0;
		}
	}
	return 1;
}

void codes_fast_level(struct codes_job *job, int is_decoding)
{
	struct coder coder = *job->coder; /* in registers */

	if (is_decoding)
		code_level(job, &coder, 1);
	else
		code_level(job, &coder, 0);
	*job->coder = coder;
}
