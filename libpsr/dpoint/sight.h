/* A rectangle's frame in lanes, x, y and z or u, v and the normal at once: most of what fitting does is to look at
 * nodes of the tree of cells. Each lane is computed as rectangle.h's functions do, bit by bit. */
#ifndef PSR_DPOINT_SIGHT_H
#define PSR_DPOINT_SIGHT_H

#include <math.h>
#include <string.h>
#include "rectangle.h"
#ifdef __SSE2__ /* as every x86-64 has */
#include <emmintrin.h>
#endif

/* Four numbers, which the compiler has a register for on any machine that has some. */
typedef float lanes __attribute__((vector_size(16)));
typedef int32_t lanes_if __attribute__((vector_size(16))); /* of a comparison: -1 or 0 */

struct sight_frame {
	lanes at, axis[3], slant[3]; /* [k]: of x, y or z, the parts along u, v and the normal; lane 3 is 0 */
};

static inline lanes lanes_all(float x)
{
	return (lanes){ x, x, x, x };
}

static inline lanes lanes_size(lanes x)
{
	return (lanes)((lanes_if)x & INT32_MAX);
}

/* lanes_any, lanes_all_are: of a comparison. */
#ifdef __SSE2__
static inline lanes lanes_greater(lanes a, lanes b)
{
	return (lanes)_mm_max_ps((__m128)b, (__m128)a);
}

static inline int lanes_any(lanes_if x)
{
	return _mm_movemask_ps((__m128)x) != 0;
}

static inline int lanes_all_are(lanes_if x)
{
	return _mm_movemask_ps((__m128)x) == 15;
}
#else
static inline lanes lanes_greater(lanes a, lanes b)
{
	const lanes_if is_greater = b > a;

	return (lanes)(((lanes_if)b & is_greater) | ((lanes_if)a & ~is_greater));
}

static inline int lanes_any(lanes_if x)
{
	int64_t half[2];

	memcpy(half, &x, sizeof half);
	return (half[0] | half[1]) != 0;
}

static inline int lanes_all_are(lanes_if x)
{
	return !lanes_any(~x);
}
#endif

static inline lanes sight_place(const float p[3])
{
	return (lanes){ p[0], p[1], p[2], 0 };
}

static inline void sight_frame_of(struct sight_frame *f, const struct rectangle *r)
{
	f->at = sight_place(r->at);
	for (int k = 0; k < 3; k++) {
		f->axis[k] = (lanes){ r->axis[0][k], r->axis[1][k], r->axis[2][k], 0 };
		f->slant[k] = (lanes){ r->slant[0][k], r->slant[1][k], r->slant[2][k], 0 };
	}
}

/* The first half of a ball, and the second one: its middle and radius; half of its sides and `widest`. */
static inline lanes sight_middle(const struct cell_ball *ball)
{
	lanes middle;

	memcpy(&middle, ball->middle, sizeof middle);
	return middle;
}

static inline lanes sight_half(const struct cell_ball *ball)
{
	lanes half;

	memcpy(&half, ball->half, sizeof half);
	return half;
}

static inline lanes sight_turned(const lanes axis[3], lanes v)
{
	return axis[0] * lanes_all(v[0]) + axis[1] * lanes_all(v[1]) + axis[2] * lanes_all(v[2]);
}

#endif
