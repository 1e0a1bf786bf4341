#include "screen.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "base/direction.h"

/* A triangle clipped by a rectangle has at most 7 corners; rounding may double some. */
#define MOST_CORNERS 24

/* A cone over a convex polygon on the sphere of rays: the part of a triangle seen in a region. */
struct part {
	int n;
	double corner[MOST_CORNERS][3];
};

/* Clips the part to a . v >= 0. */
static void clip(struct part *out, const struct part *in, const double a[3])
{
	out->n = 0;
	for (int i = 0; i < in->n; i++) {
		const double *p = in->corner[i], *q = in->corner[(i + 1) % in->n];
		double dp = v3d_dot(a, p), dq = v3d_dot(a, q);

		assert(out->n + 2 <= MOST_CORNERS);
		if (dp >= 0)
			v3d_set(out->corner[out->n++], p[0], p[1], p[2]);
		if ((dp < 0) != (dq < 0) && dp != 0 && dq != 0) {
			double part = fabs(dp) / (fabs(dp) + fabs(dq));

			v3d_scale(out->corner[out->n], p, 1 - part);
			v3d_add_scaled(out->corner[out->n], out->corner[out->n], part, q);
			out->n++;
		}
	}
}

struct region {
	double low[2], high[2]; /* x and y of rays with z = 1 */
};

/* Marks the regions that the triangle reaches; each split cuts it at a plane through the eye. */
static void descend(struct screen *screen, unsigned triangle, int node, int depth, const struct region *region,
                    const struct part *part)
{
	int axis = depth & 1;
	double middle = (region->low[axis] + region->high[axis]) / 2;

	if (part->n == 0)
		return;
	screen->mask[node][triangle >> 6] |= UINT64_C(1) << (triangle & 63);
	if (depth == 2 * screen->n)
		return;
	for (int half = 0; half < 2; half++) {
		struct region child = *region;
		struct part cut;
		double plane[3] = { 0, 0, half == 0 ? middle : -middle };

		(half == 0 ? child.high : child.low)[axis] = middle;
		plane[axis] = half == 0 ? -1 : 1;
		clip(&cut, part, plane);
		descend(screen, triangle, 2 * node + half, depth + 1, &child, &cut);
	}
}

void screen_make(struct screen *screen, int n, const double axes[3][3], const double tangent[2], int level)
{
	static const double sides[4][2] = { { 1, 0 }, { -1, 0 }, { 0, 1 }, { 0, -1 } };
	double corner[3][3];
	const struct region whole = { { -tangent[0], -tangent[1] }, { tangent[0], tangent[1] } };

	screen->n = n;
	memset(screen->mask, 0, (size_t)(2 << 2 * n) * sizeof *screen->mask);
	/* Triangles of octant 0, mirrored into the others. */
	for (unsigned t = 0; t < 8u << 2 * level; t++) {
		const unsigned octant = t & 7, one = t >> 3;
		struct part part[2] = { { .n = 3 } };
		int last = 0;

		if (octant == 0)
			psr_direction_corners(level, one, corner);
		for (int i = 0; i < 3; i++) {
			double from_eye[3];

			for (int k = 0; k < 3; k++)
				from_eye[k] = octant >> k & 1 ? corner[i][k] : -corner[i][k];
			m3d_apply(part[0].corner[i], axes, from_eye);
		}
		for (int i = 0; i < 4 && part[last].n > 0; i++, last ^= 1) {
			double plane[3] = { sides[i][0], sides[i][1], tangent[i / 2] };

			clip(&part[last ^ 1], &part[last], plane);
		}
		descend(screen, octant << 2 * level | one, 1, 0, &whole, &part[last]);
	}
}

int screen_node(const struct screen *screen, double x0, double y0, double x1, double y1)
{
	double low[2] = { x0, y0 }, high[2] = { x1, y1 }, from[2] = { -1, -1 }, size[2] = { 2, 2 };
	int node = 1;

	for (int depth = 0; depth < 2 * screen->n; depth++) {
		int axis = depth & 1;
		double middle = from[axis] + size[axis] / 2;

		size[axis] /= 2;
		if (high[axis] <= middle) {
			node = 2 * node;
		} else if (low[axis] >= middle) {
			node = 2 * node + 1;
			from[axis] = middle;
		} else {
			break;
		}
	}
	return node;
}
