/* Random tiles of pictures for the tests of warps. */
#ifndef TESTS_SIMD_PICTURE_H
#define TESTS_SIMD_PICTURE_H

#include "check.h"

struct picture {
	uint32_t width, height, levels;
	struct warp_target target;
};

/* Any tile of a picture, as render/warp.c makes it; the levels of a bit mask. */
void picture_make(struct check *c, struct picture *p, uint32_t width, uint32_t height, uint32_t levels);
void picture_random(struct check *c, struct picture *p);

/* Depths as they are while a tile is drawn: nothing, or something nearer. */
float picture_depth(struct check *c);

/* Sets where an instance is seen from. */
void picture_sight(struct check *c, struct warp_instance *in, const struct warp_target *t, int is_spoilt);

#endif
