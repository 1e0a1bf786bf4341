/* How far apart two looks are: attributes (model/blocks.h) without their normals, by channels. A file has no more than
 * one look a point, so rectangles end where looks change. */
#ifndef PSR_DPOINT_LOOK_H
#define PSR_DPOINT_LOOK_H

#include <stdint.h>
#include <string.h>

/* Channels as 255ths: unlit, red, green, blue (sRGB-coded), metallic, reflectance, shut, roughness. */
#define LOOK_CHANNELS 8

#define LOOK_NORMAL 0x7fff /* bits of attributes that are no look */

static const struct look_channel {
	uint8_t at, most, step; /* its lowest bit, its greatest code, 255ths a code */
} look_channel[LOOK_CHANNELS] = {
	{ 15, 1, 255 }, { 16, 255, 1 }, { 24, 255, 1 }, { 32, 255, 1 }, { 40, 31, 8 }, { 45, 31, 8 }, { 50, 63, 4 },
	{ 56, 255, 1 },
};

/* The least and greatest of some looks. */
struct look_range {
	uint8_t low[LOOK_CHANNELS], high[LOOK_CHANNELS];
};

static inline void look_of(uint8_t look[LOOK_CHANNELS], uint64_t attr)
{
	for (int k = 0; k < LOOK_CHANNELS; k++)
		look[k] = (uint8_t)((attr >> look_channel[k].at & look_channel[k].most) * look_channel[k].step);
}

static inline void look_range_of(struct look_range *range, uint64_t attr)
{
	look_of(range->low, attr);
	memcpy(range->high, range->low, sizeof range->high);
}

static inline void look_range_join(struct look_range *range, const struct look_range *other)
{
	for (int k = 0; k < LOOK_CHANNELS; k++) {
		range->low[k] = other->low[k] < range->low[k] ? other->low[k] : range->low[k];
		range->high[k] = other->high[k] > range->high[k] ? other->high[k] : range->high[k];
	}
}

/* Returns how many 255ths the range is wide in its widest channel. */
static inline int look_range_width(const struct look_range *range)
{
	int width = 0;

	for (int k = 0; k < LOOK_CHANNELS; k++)
		width = range->high[k] - range->low[k] > width ? range->high[k] - range->low[k] : width;
	return width;
}

/* Returns how far the range goes from the look, likewise. */
static inline int look_range_distance(const struct look_range *range, const uint8_t look[LOOK_CHANNELS])
{
	int away = 0;

	for (int k = 0; k < LOOK_CHANNELS; k++) {
		away = range->high[k] - look[k] > away ? range->high[k] - look[k] : away;
		away = look[k] - range->low[k] > away ? look[k] - range->low[k] : away;
	}
	return away;
}

/* Returns the attributes in the range's middle: no look of the range is further off than half its width and a code. */
static inline uint64_t look_range_middle(const struct look_range *range)
{
	uint64_t attr = 0;

	for (int k = 0; k < LOOK_CHANNELS; k++)
		attr |= (uint64_t)((range->low[k] + range->high[k]) / 2 / look_channel[k].step) << look_channel[k].at;
	return attr;
}

#endif
