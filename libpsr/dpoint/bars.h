/* Where a rectangle that grows has to end. */
#ifndef PSR_DPOINT_BARS_H
#define PSR_DPOINT_BARS_H

#include <stddef.h>

/* A cell that does not suit: the rectangle has to end at `at` along u, or along v. */
struct bar {
	float at[2];
	float side[2]; /* 1 or -1: which side it is on */
};

/* None is behind another one: along u they go outwards, along v inwards. */
struct bars {
	struct bar *bar;
	size_t n, room;
	int is_failed;
};

/* Tells where a cell begins, and on which side, by those of its corners that are nearest to S_p: the others of a face
 * that falls away lean over or under the rectangle, and do not touch it. Corners are in the rectangle's frame; above:
 * how far each is from S_p; those that are further by more than `height` than the nearest do not count. */
struct bar bar_of(const float corner[4][3], const float above[4], float height);

/* Returns whether a bar is nearer along both sides: what is behind it ends nothing. */
int bars_is_behind(const struct bars *bars, float u, float v);

/* Returns whether a bar is within the extents. */
int bars_are_within(const struct bars *bars, const float extent[2]);

/* Adds a bar, unless it is behind another one, and takes away what is behind it. Sets is_failed without memory. */
void bars_put(struct bars *bars, const struct bar *bar);

/* Makes the extents those of the best rectangle that no bar is in, and that holds the free one: along u it ends at a
 * bar, along v at the least of those before. */
void bars_end(float extent[2], const struct bars *bars, const float free_one[2], float overhang);

/* Returns which side the bar is on that ends an extent; 0: none does. */
float bars_side(const struct bars *bars, const float extent[2], int k);

#endif
