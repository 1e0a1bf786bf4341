#include <string.h>
#include "base/mem.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "mip.h"

/* Which texels along a side one texel of the next level covers, and its share of each. */
struct taps {
	uint32_t first;
	int n;
	float weight[3];
};

void mip_decode(enum mip_kind kind, const uint8_t *texel, float out[4])
{
	float alpha = (float)texel[3] * (1.0f / 255);

	switch (kind) {
	case MIP_COLOR:
	case MIP_COVERED:
		for (int c = 0; c < 3; c++)
			out[c] = psr_srgb_to_linear[texel[c]] * (kind == MIP_COVERED ? alpha : 1);
		out[3] = alpha;
		break;
	case MIP_LINEAR:
		for (int c = 0; c < 4; c++)
			out[c] = (float)texel[c] * (1.0f / 255);
		break;
	case MIP_NORMAL:
		for (int c = 0; c < 3; c++)
			out[c] = (float)(2 * texel[c] - 255);
		v3f_normalize(out, out);
		out[3] = 0;
		break;
	}
}

static void encode_level(enum mip_kind kind, const float value[4], uint16_t *texel)
{
	for (int c = 0; c < 4; c++)
		texel[c] = (uint16_t)(kind == MIP_NORMAL ? value[c] * 32767 + 32768.5f : value[c] * 65535 + 0.5f);
}

static struct taps taps_of(uint32_t i, uint32_t from, uint32_t to)
{
	if (from == to)
		return (struct taps){ i, 1, { 1 } };
	if (from == 2 * to)
		return (struct taps){ 2 * i, 2, { 0.5f, 0.5f } };
	/* from = 2 to + 1: texel i covers (2 + 1 / to) texels from 2 i + i / to on. */
	return (struct taps){ 2 * i, 3,
		                  { (float)(to - i) / (float)from, (float)to / (float)from, (float)(i + 1) / (float)from } };
}

/* Makes one row of a level, from `line`: the blend of the rows of the level before that it covers. */
static void make_row(const struct mip *mip, int level, uint32_t y, float (*line)[4], uint16_t *out)
{
	const struct mip_level *from = &mip->level[level - 1], *to = &mip->level[level];
	struct taps rows = taps_of(y, from->height, to->height);

	for (uint32_t x = 0; x < from->width; x++) {
		memset(line[x], 0, sizeof line[x]);
		for (int i = 0; i < rows.n; i++) {
			float texel[4];

			mip_texel(mip, level - 1, x, rows.first + (uint32_t)i, texel);
			for (int c = 0; c < 4; c++)
				line[x][c] += rows.weight[i] * texel[c];
		}
	}
	for (uint32_t x = 0; x < to->width; x++) {
		struct taps columns = taps_of(x, from->width, to->width);
		float sum[4] = { 0 };

		for (int i = 0; i < columns.n; i++)
			for (int c = 0; c < 4; c++)
				sum[c] += columns.weight[i] * line[columns.first + (uint32_t)i][c];
		encode_level(mip->kind, sum, out + 4 * (size_t)x);
	}
}

static uint32_t half(uint32_t n)
{
	return n > 1 ? n / 2 : 1;
}

int mip_init(struct mip *mip, const struct psr_image *image, enum mip_kind kind)
{
	float (*line)[4];
	size_t n = 0;

	*mip = (struct mip){ .image = image, .kind = kind, .n_levels = 1 };
	mip->level[0] = (struct mip_level){ image->width, image->height, NULL };
	for (; mip->level[mip->n_levels - 1].width > 1 || mip->level[mip->n_levels - 1].height > 1; mip->n_levels++) {
		struct mip_level *level = &mip->level[mip->n_levels];

		level->width = half(level[-1].width);
		level->height = half(level[-1].height);
		n += (size_t)level->width * level->height;
	}
	mip->memory = psr_alloc_array(n, 4 * sizeof *mip->memory);
	line = psr_alloc_array(image->width, sizeof *line);
	if (mip->memory == NULL || line == NULL) {
		psr_free(line);
		return PSR_ERR_MEMORY;
	}
	n = 0;
	for (int i = 1; i < mip->n_levels; i++) {
		struct mip_level *level = &mip->level[i];

		for (uint32_t y = 0; y < level->height; y++)
			make_row(mip, i, y, line, mip->memory + n + 4 * (size_t)y * level->width);
		level->texel = mip->memory + n;
		n += 4 * (size_t)level->width * level->height;
	}
	psr_free(line);
	return PSR_OK;
}

void mip_fini(struct mip *mip)
{
	psr_free(mip->memory);
	*mip = (struct mip){ .memory = NULL };
}
