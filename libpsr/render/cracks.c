#include "cracks.h"

#include <math.h>
#include "base/maths.h"

struct crack {
	uint32_t at[CRACK_MOST][2];
	int n;
	float own, limit; /* depths: what is around is nearer than `own` by the threshold, and no further than `limit` */
	uint64_t nearest; /* of the words around; UINT64_MAX: none */
	float farthest;   /* of their depths */
};

static int has(const struct crack *c, uint32_t x, uint32_t y)
{
	for (int k = 0; k < c->n; k++)
		if (c->at[k][0] == x && c->at[k][1] == y)
			return 1;
	return 0;
}

/* Adds the pixel, unless it is known. Returns 0 if there is no room. */
static int add(struct crack *c, uint32_t x, uint32_t y)
{
	if (has(c, x, y))
		return 1;
	if (c->n == CRACK_MOST)
		return 0;
	c->at[c->n][0] = x;
	c->at[c->n++][1] = y;
	return 1;
}

static int is_at_border(const struct psr_zstack *stack, uint32_t x, uint32_t y)
{
	return x == 0 || y == 0 || x + 1 == stack->width || y + 1 == stack->height;
}

/* Looks at what is around a pixel of the crack. Returns 0 if the crack reaches the border, or is too long. */
static int look_around(struct crack *c, const struct plan *plan, const struct psr_zstack *stack, int k)
{
	const uint32_t x = c->at[k][0], y = c->at[k][1];

	if (is_at_border(stack, x, y))
		return 0;
	for (uint32_t v = y - 1; v <= y + 1; v++)
		for (uint32_t u = x - 1; u <= x + 1; u++) {
			const uint64_t word = psr_zstack_row(stack, v)[u];
			const float z = psr_word_z(word);

			if (z <= c->limit && z * plan->gap_scale[1] + plan->gap_offset[1] < c->own) {
				c->nearest = word < c->nearest ? word : c->nearest;
				c->farthest = z > c->farthest ? z : c->farthest;
			} else if (!add(c, u, v)) {
				return 0;
			}
		}
	return 1;
}

/* The depth of the first pixel of a direction that is not of the crack. */
static float depth_beside(const struct crack *c, const struct psr_zstack *stack, const uint32_t at[2], int dx, int dy)
{
	uint32_t x = at[0], y = at[1];

	while (has(c, x, y)) {
		x += (uint32_t)dx;
		y += (uint32_t)dy;
	}
	return psr_word_z(psr_zstack_row(stack, y)[x]);
}

static int goes_on(const struct crack *c, const struct psr_zstack *stack, int k, float most)
{
	static const int way[4][2] = { { 1, 0 }, { 0, 1 }, { 1, 1 }, { 1, -1 } };

	for (int w = 0; w < 4; w++)
		if (fabsf(depth_beside(c, stack, c->at[k], way[w][0], way[w][1]) -
		          depth_beside(c, stack, c->at[k], -way[w][0], -way[w][1])) <= most)
			return 1;
	return 0;
}

static uint64_t nearest_beside(const struct psr_zstack *stack, uint32_t x, uint32_t y)
{
	uint64_t nearest = UINT64_MAX;

	for (uint32_t v = y - 1; v <= y + 1; v++)
		for (uint32_t u = x - 1; u <= x + 1; u++) {
			const uint64_t word = psr_zstack_row(stack, v)[u];

			nearest = word < nearest ? word : nearest;
		}
	return nearest;
}

/* Whether the pixel that `begun` has is in a crack of at most `most` pixels, whose rims are within `apart` of its nearest
 * neighbour, and across which a surface goes on within `step`. */
static int is_in(const struct plan *plan, const struct psr_zstack *stack, const struct crack *begun, int most,
                 float apart, float step)
{
	struct crack c = *begun;

	c.limit += apart;
	for (int k = 0; k < c.n; k++)
		if (!look_around(&c, plan, stack, k))
			return 0;
	if (c.n > most || c.nearest == UINT64_MAX || c.farthest - psr_word_z(c.nearest) > apart)
		return 0;
	for (int k = 0; k < c.n; k++)
		if (!goes_on(&c, stack, k, step))
			return 0;
	return 1;
}

int is_in_crack(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y)
{
	struct crack c = { .at = { { x, y } }, .n = 1, .nearest = UINT64_MAX };
	uint32_t instance;
	uint64_t near;
	float spacing;

	if (is_at_border(stack, x, y))
		return 0;
	near = nearest_beside(stack, x, y);
	if (near == PSR_WORD_EMPTY)
		return 0;
	instance = plan_find_instance(plan, (uint32_t)near / PSR_BLOCK_SAMPLES);
	if (plan->warp[instance].points == NULL)
		return 0;
	spacing = plan->instance[instance].level_spacing;
	c.own = psr_word_z(psr_zstack_row(stack, y)[x]);
	c.limit = psr_word_z(near);
	return is_in(plan, stack, &c, CRACK_MOST, CRACK_APART / 4 * spacing, CRACK_STEP * spacing)
	       || is_in(plan, stack, &c, CRACK_SHORT, CRACK_APART / 2 * spacing, CRACK_STEP * spacing)
	       || is_in(plan, stack, &c, 1, CRACK_APART * spacing, CRACK_STEP_ALONE * spacing);
}
