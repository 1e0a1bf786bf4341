#include <assert.h>
#include <math.h>
#include <stddef.h>
#include "base/vec.h"
#include "crease.h"

/* Angles are told by 1 minus their cosine, which grows with their square: these are squares of 0.6, 1.7 and 1.7. Around
 * a point of a ball k steps of d degrees are d / (2 sin(pi / k)) from their mean: 1 d of six, 1.6 d of ten, as many as
 * few meshes have; of the 16 of a coarse cone 2.6 d. */
#define NEAR 0.36
#define REGULAR 2.9
#define ROUGH 3.0 /* 35 degrees become 62 */

/* Parts of the largest flat area: from MINOR on another one begins to count, from MAJOR on it counts in full. Facets
 * of one curved surface seldom differ by 8, a face and the strips of its fillet by 32. */
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

/* Prim's spanning tree, cut where a step is above the crease: group[i], and widest[g], the greatest step within.
 * Returns the number of groups; corners without area are in none (n). */
static unsigned find_groups(unsigned *group, double *widest, const struct crease_corner *corner, unsigned n,
                            double crease)
{
	double step[CREASE_MAX_CORNERS], nearest[CREASE_MAX_CORNERS]; /* from what was taken; nearest: as an angle */
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
		/* What is left is this far from all that were taken, so the group at hand is complete. */
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

/* The normal of the group's faces that are near `face` (NULL: of all). 0 if there is none. */
static int common_normal(double normal[3], const struct crease_corner *corner, const unsigned *group, unsigned n,
                         unsigned g, const double *face, double reach)
{
	double largest = 0.0, length;

	for (unsigned k = 0; k < n; k++)
		if (group[k] == g && (face == NULL || gap(face, corner[k].face) <= reach))
			largest = fmax(largest, corner[k].area);
	v3d_set(normal, 0.0, 0.0, 0.0);
	for (unsigned k = 0; k < n && largest > 0.0; k++)
		if (group[k] == g && (face == NULL || gap(face, corner[k].face) <= reach))
			v3d_add_scaled(normal, normal, importance(corner[k].area, largest), corner[k].share);
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

static void finish_group(struct crease_corner *corner, const unsigned *group, unsigned n, unsigned g, double reach)
{
	double shared[3], own[3];
	int is_regular = common_normal(shared, corner, group, n, g, NULL, 0.0);

	for (unsigned i = 0; i < n && is_regular; i++)
		is_regular = group[i] != g || gap(corner[i].face, shared) <= reach;
	for (unsigned i = 0; i < n; i++) {
		if (group[i] != g)
			continue;
		if (is_regular)
			put(corner[i].normal, shared);
		else
			put(corner[i].normal,
			    common_normal(own, corner, group, n, g, corner[i].face, reach) ? own : corner[i].face);
	}
}

static double reach_of(const struct crease_corner *corner, const unsigned *group, unsigned n, unsigned g,
                       double widest, double crease)
{
	double most = ROUGH * crease;

	for (unsigned i = 0; i < n; i++)
		if (group[i] == g && corner[i].is_flat)
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
	for (unsigned g = 0; g < n_groups; g++)
		finish_group(corner, group, n, g, reach_of(corner, group, n, g, widest[g], crease));
}
