#include <assert.h>
#include <math.h>
#include <stddef.h>
#include "base/vec.h"
#include "crease.h"

/* Angles are 1 minus their cosine, proportional to their square: these are squares of 0.6, 1.7 and 1.7. Around a point
 * of a ball k steps of d degrees are d / (2 sin(pi / k)) from their mean: 1 d for six steps, 1.6 d for ten, which few
 * meshes exceed; 2.6 d for the 16 of a coarse cone. */
#define NEAR 0.36
#define REGULAR 2.9
#define ROUGH 3.0 /* 35 degrees become 62 */

/* Areas relative to the largest flat part: others begin to count at MINOR, and count in full from MAJOR on. Facets of
 * one curved surface seldom differ by 8, a face and the strips of its fillet by 32. */
#define MINOR (1.0 / 32)
#define MAJOR (1.0 / 8)

static double gap(const double a[3], const double b[3])
{
	return 1.0 - v3d_dot(a, b);
}

static int has_area(const struct crease_corner *corner)
{
	return v3d_dot(corner->face, corner->face) > 0.0;
}

/* Prim's spanning tree, cut at steps above the crease. Sets group[i], n for corners without area, and widest[g], the
 * greatest step within a group. Returns the number of groups. */
static unsigned find_groups(unsigned *group, double *widest, const struct crease_corner *corner, unsigned n,
                            double crease)
{
	double step[CREASE_MAX_CORNERS], nearest[CREASE_MAX_CORNERS]; /* from the tree; nearest: the same as an angle */
	unsigned n_groups = 0;

	for (unsigned i = 0; i < n; i++) {
		step[i] = nearest[i] = INFINITY;
		group[i] = n;
	}
	for (;;) {
		unsigned next = n;

		for (unsigned i = 0; i < n; i++)
			if (group[i] == n && has_area(&corner[i]) && (next == n || step[i] < step[next]))
				next = i;
		if (next == n)
			return n_groups;
		/* All remaining corners are at least this far: the group is complete. */
		if (step[next] > crease)
			widest[n_groups++] = 0.0;
		else
			widest[n_groups - 1] = fmax(widest[n_groups - 1], nearest[next]);
		group[next] = n_groups - 1;
		for (unsigned i = 0; i < n; i++) {
			const double angle = fmax(gap(corner[i].face, corner[next].face), 0.0);
			const double s = corner[i].is_flat || corner[next].is_flat ? angle : angle / ROUGH;

			if (s < step[i]) {
				step[i] = s;
				nearest[i] = angle;
			}
		}
	}
}

static double importance(double area, double largest)
{
	return fmin(fmax((area - MINOR * largest) / ((MAJOR - MINOR) * largest), 0.0), 1.0);
}

/* Lists the corners of group g. */
struct members {
	struct crease_corner *corner;
	const unsigned *group;
	unsigned n, g;
};

/* Whether corner k belongs to the group, and lies within `reach` of `face` (NULL: anywhere). */
static int counts(const struct members *m, unsigned k, const double *face, double reach)
{
	return m->group[k] == m->g && (face == NULL || gap(face, m->corner[k].face) <= reach);
}

/* Computes the normal of the group's faces near `face` (NULL: of all). Returns 0 if it is undefined. */
static int common_normal(double normal[3], const struct members *m, const double *face, double reach)
{
	double largest = 0.0, length;

	for (unsigned k = 0; k < m->n; k++)
		if (counts(m, k, face, reach))
			largest = fmax(largest, m->corner[k].area);
	v3d_set(normal, 0.0, 0.0, 0.0);
	for (unsigned k = 0; k < m->n && largest > 0.0; k++)
		if (counts(m, k, face, reach))
			v3d_add_scaled(normal, normal, importance(m->corner[k].area, largest), m->corner[k].share);
	length = v3d_length(normal);
	if (!(length > 0.0) || !isfinite(length))
		return 0;
	v3d_scale(normal, normal, 1.0 / length);
	return 1;
}

static void put(float out[3], const double normal[3])
{
	for (int c = 0; c < 3; c++)
		out[c] = (float)normal[c];
}

static void finish_group(const struct members *m, double reach)
{
	double shared[3], own[3];
	int is_regular = common_normal(shared, m, NULL, 0.0);

	for (unsigned i = 0; i < m->n && is_regular; i++)
		is_regular = m->group[i] != m->g || gap(m->corner[i].face, shared) <= reach;
	for (unsigned i = 0; i < m->n; i++) {
		struct crease_corner *corner = &m->corner[i];

		if (m->group[i] != m->g)
			continue;
		if (is_regular)
			put(corner->normal, shared);
		else
			put(corner->normal, common_normal(own, m, corner->face, reach) ? own : corner->face);
	}
}

static double reach_of(const struct members *m, double widest, double crease)
{
	double most = ROUGH * crease;

	for (unsigned i = 0; i < m->n; i++)
		if (m->group[i] == m->g && m->corner[i].is_flat)
			most = crease;
	return fmax(NEAR * crease, fmin(REGULAR * widest, most));
}

void crease_normals(struct crease_corner *corner, unsigned n, double crease)
{
	double widest[CREASE_MAX_CORNERS];
	unsigned group[CREASE_MAX_CORNERS], n_groups;

	assert(n <= CREASE_MAX_CORNERS);
	n_groups = find_groups(group, widest, corner, n, crease);
	for (unsigned i = 0; i < n; i++)
		for (int c = 0; c < 3; c++)
			corner[i].normal[c] = 0.0f;
	for (unsigned g = 0; g < n_groups; g++) {
		const struct members members = { corner, group, n, g };

		finish_group(&members, reach_of(&members, widest[g], crease));
	}
}
