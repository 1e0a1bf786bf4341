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

static inline __attribute__((always_inline)) void code_level(struct codes_job *job, uint32_t n, int is_decoding)
{
	struct model *model = job->model;
	const struct octree_level *above = job->level > 0 ? &job->levels->at[job->level - 1] : NULL;
	uint8_t *code = job->levels->at[job->level].code;
	const uint8_t *const end = code + n;
	struct coder coder = *job->coder; /* in registers */

	for (uint32_t i = 0; code < end && !coder.has_failed; i++) {
		const uint8_t parent = above != NULL ? above->code[i] : 1;

		for (unsigned left = parent; left != 0; left &= left - 1) {
			const uint8_t *mirrored = model->mirrored[__builtin_ctz(left)];
			uint16_t *p = model->p[mirrored[parent]];

			if (is_decoding)
				*code++ = mirrored[code_byte(&coder, 1, p, 0)];
			else
				code_byte(&coder, 0, p, mirrored[*code++]);
		}
	}
	*job->coder = coder;
}

void codes_fast_level(struct codes_job *job, int is_decoding)
{
	const uint32_t n = codes_count(job);

	if (!is_decoding) {
		code_level(job, n, 0);
		return;
	}
	codes_begin_level(job, n);
	if (job->rc == PSR_OK)
		code_level(job, n, 1);
	codes_end_level(job, n);
}
