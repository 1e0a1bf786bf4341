/* How far pixels that get their depth from cells are from samples, which bounds their error (decision 0164). */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "fill_bricks.h"

#define ROUNDING 0.01f /* pixels: places and depths are floats; those of 2^14 pixels are rounded by 2^-10 */

void fill_note_own(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by)
{
	const uint32_t x0 = bx0 * BRICK, x1 = bx1 * BRICK < fill->width ? bx1 * BRICK : fill->width;

	for (uint32_t y = by * BRICK; y < (by + 1) * BRICK && y < fill->height; y++)
		fill->simd->fill_own(fill_own_row(fill, y) + x0, psr_zstack_row(fill->picture.stack, y) + x0,
		                     fill->picture.weight + (size_t)y * fill->width + x0, x1 - x0);
}

void fill_forget_own(struct fill *fill, uint32_t bx, uint32_t by)
{
	for (uint32_t y = by * BRICK; y < (by + 1) * BRICK && y < fill->height; y++)
		for (uint32_t x = bx * BRICK; x < (bx + 1) * BRICK && x < fill->width; x++)
			fill_own_row(fill, y)[x] = NAN;
}

/* What is at a filled pixel and around it. */
struct beside {
	float distance2; /* of the nearest, in pixels, INFINITY without any */
	float along;     /* the least distance along the view axis, of any; */
	float z;         /* and the depth of that one; of equal ones the nearest aside, */
	float aside2;    /* which is so far aside */
	int n;           /* how many */
	int is_among;    /* many show another surface */
};

static int is_marked(const struct fill *fill, uint32_t x, uint32_t y)
{
	return fill->picture.bricks[y / BRICK * fill->bricks_x + x / BRICK];
}

/* The depth of the sample that a pixel shows: NAN or INFINITY without any. */
static float own_depth(const struct fill *fill, int32_t column, int32_t row)
{
	const uint32_t x = (uint32_t)column, y = (uint32_t)row;
	uint64_t word;

	if (column < 0 || row < 0 || x >= fill->width || y >= fill->height)
		return NAN;
	if (is_marked(fill, x, y))
		return fill_own_row(fill, y)[x];
	word = psr_zstack_row(fill->picture.stack, y)[x];
	return word == PSR_WORD_EMPTY ? NAN : psr_word_z(word);
}

/* Looks at a pixel dx and dy aside that shows a sample of depth z. */
static void look_at(struct beside *beside, const struct fill_from *from, int32_t dx, int32_t dy, float z)
{
	const float apart = z - from->z, shift = apart * from->wider, along = fabsf(apart) * from->steep;
	const float x = (float)dx + shift * (from->x + (float)dx), y = (float)dy + shift * (from->y + (float)dy);
	const float distance2 = x * x + y * y + along * along, aside2 = (float)(dx * dx + dy * dy);

	if (!(z < INFINITY))
		return;
	beside->n++;
	beside->distance2 = distance2 < beside->distance2 ? distance2 : beside->distance2;
	if (along < beside->along || (along == beside->along && aside2 < beside->aside2)) {
		beside->along = along;
		beside->aside2 = aside2;
		beside->z = z;
	}
}

/* Looks pixel by pixel. Ends early where what is found is no farther than `enough`, and the pixel's depth stays. */
static struct beside look_beside(const struct fill *fill, const struct fill_from *from, uint32_t x, uint32_t y,
                                 float enough)
{
	struct beside beside = { INFINITY, INFINITY, from->z, INFINITY, 0, 0 };
	int32_t last = FILL_NEAR, first = FILL_NEAR;

	for (int32_t ring = 0; ring <= last; ring++) {
		for (int32_t dy = -ring; dy <= ring; dy++)
			for (int32_t dx = -ring; dx <= ring; dx += abs(dy) == ring ? 1 : 2 * ring) {
				look_at(&beside, from, dx, dy, own_depth(fill, (int32_t)x + dx, (int32_t)y + dy));
				if (beside.distance2 <= enough * enough && beside.along <= FILL_APART)
					return beside;
			}
		if (beside.along <= FILL_APART)
			last = last < ring + 1 ? last : ring + 1;
		else if (ring == first + 1 && beside.n >= FILL_MANY) {
			beside.is_among = 1;
			return beside;
		}
		first = beside.n > 0 && ring < first ? ring : first;
	}
	return beside;
}

/* Whether the pixels of a square are of marked bricks, so that `own` has them all. */
static int has_square(const struct fill *fill, uint32_t x, uint32_t y, uint32_t reach)
{
	return x >= reach && y >= reach && x + reach < fill->width && y + reach < fill->height
	       && is_marked(fill, x - reach, y - reach) && is_marked(fill, x + reach, y - reach)
	       && is_marked(fill, x - reach, y + reach) && is_marked(fill, x + reach, y + reach);
}
_Static_assert(2 * FILL_SQUARE < BRICK, "the bricks of its corners are all");

/* As look_beside(), if a square of FILL_SQUARE pixels to each side tells; returns whether. */
static int look_near(struct beside *beside, const struct fill *fill, const struct fill_from *from, uint32_t x,
                     uint32_t y, float enough)
{
	const float *const own = fill_own_row(fill, y) + x;
	const ptrdiff_t stride = (ptrdiff_t)fill->width + 2;
	int first = *own < INFINITY ? 0 : FILL_NEAR;
	int last = fabsf(*own - from->z) * from->steep <= FILL_APART ? 1 : FILL_NEAR;
	struct fill_beside square;

	for (int reach = 1; reach <= FILL_SQUARE && has_square(fill, x, y, (uint32_t)reach); reach++) {
		square = fill->simd->fill_beside(from, own, stride, reach);
		*beside = (struct beside){ .distance2 = square.distance2, .along = square.along };
		if (square.along <= FILL_APART)
			last = last < reach + 1 ? last : reach + 1;
		if (reach == last || (square.along <= FILL_APART && square.distance2 <= enough * enough))
			return 1;
		if (reach == first + 1 && square.n >= FILL_MANY && square.along > FILL_APART) {
			const struct fill_place place = fill->simd->fill_pick(from, own, stride, reach, square.along);

			beside->z = own[place.y * stride + place.x];
			beside->aside2 = (float)(place.x * place.x + place.y * place.y);
			beside->is_among = 1;
			return 1;
		}
		first = square.n > 0 && reach < first ? reach : first;
	}
	return 0;
}

/* Notes how far the depth that pixel (x, y) gets is from those of samples; returns the depth. */
static float note_depth(struct fill_counts *counts, const struct fill *fill, uint32_t x, uint32_t y, float z)
{
	const struct plan *plan = fill->plan;
	const struct fill_from from = {
		(float)((double)x + 0.5 - plan->center[0]), (float)((double)y + 0.5 - plan->center[1]), z,
		plan->perspective ? 1 / z : 0, plan->perspective ? plan->focal / z : plan->focal,
	};
	struct beside beside;
	float reach;

	if (!look_near(&beside, fill, &from, x, y, counts->reach))
		beside = look_beside(fill, &from, x, y, counts->reach);
	reach = sqrtf(beside.is_among ? beside.aside2 : beside.distance2);
	if (beside.distance2 == INFINITY)
		counts->n_far++;
	else if (reach > counts->reach)
		counts->reach = reach;
	return beside.is_among ? beside.z : z;
}

/* How far a depth may be from a sample in the pixel or one around it, along the view axis and in pixels, so that it is
 * surely no farther than counts->reach from that in all: one that is `along` off is aside by no more than sqrt 2 and
 * `along` times the tangent of its angle to the axis. Below 0: no depth. */
static float reach_along(const struct fill_counts *counts, const struct fill *fill)
{
	const struct plan *plan = fill->plan;
	const float reach = counts->reach - ROUNDING, rest = reach > 0 ? reach * reach - 2 : -1;
	float tangent = 0, along;

	if (rest <= 0)
		return -1;
	if (plan->perspective) {
		const double x = fmax(plan->center[0], fill->width - plan->center[0]);
		const double y = fmax(plan->center[1], fill->height - plan->center[1]);

		tangent = (float)hypot(x, y) / plan->focal;
	}
	along = sqrtf(2 * tangent * tangent + (1 + tangent * tangent) * rest) - (float)M_SQRT2 * tangent;
	along /= 1 + tangent * tangent;
	return along < FILL_APART - ROUNDING ? along : FILL_APART - ROUNDING;
}

void fill_note_depths(struct fill_counts *counts, const struct fill *fill, uint32_t x, uint32_t y,
                      struct fill_places *places, uint32_t n)
{
	const float along = reach_along(counts, fill) / fill->plan->focal;
	const float *own[3] = { fill_own_row(fill, y - 1) + x, fill_own_row(fill, y) + x, fill_own_row(fill, y + 1) + x };
	const uint32_t end = places->at[n - 1] + 1u;
	float z[FILL_PIECE];
	uint16_t place[FILL_PIECE], far[FILL_PIECE];
	uint32_t n_far;

	if (!fill->looks) {
		for (uint32_t i = 0; i < n && counts->n_far == 0; i++)
			counts->n_far = places->weight[i] < WEIGHT_ONE / 2 && places->z[i] < INFINITY;
		return;
	}
	memset(z, 0xff, end * sizeof *z); /* no numbers */
	for (uint32_t i = 0; i < n; i++) {
		z[places->at[i]] = places->weight[i] < WEIGHT_ONE / 2 ? places->z[i] : INFINITY;
		place[places->at[i]] = (uint16_t)i;
	}
	n_far = fill->simd->fill_far(far, z, own, end, fill->plan->perspective ? along : 0,
	                             fill->plan->perspective ? 0 : along);
	for (uint32_t i = 0; i < n_far; i++)
		places->z[place[far[i]]] = note_depth(counts, fill, x + far[i], y, z[far[i]]);
}

/* A place is as far from the surface as the sample beside it may be, and as it is from that; in perspective, that one's
 * pixels are wider by a share of at most the distance over the focal length. */
void fill_add_error(struct psr_report *report, const struct fill *fill)
{
	double reach = (double)fill->reach;

	if (fill->n_far)
		reach = fmax(reach, M_SQRT2 * (double)(2 << fill->deepest)); /* along both axes */
	if (fill->plan->perspective)
		report->error_px += report->error_px * reach / (double)fill->plan->focal;
	report->error_px += reach;
}
