#include <math.h>
#include "facet.h"
#include "base/vec.h"

#define OPPOSITE (-0.5f)          /* cosines: another side of a thing; */
#define ASIDE (-0.1f)             /* the same one, or one around an edge; */
#define CREASE 0.8191520442889918 /* 35 degrees: of two faces, as where a file has no normals */

static const struct facet *find_greatest(const struct facet *facet, size_t n)
{
	const struct facet *greatest = facet;

	for (size_t i = 1; i < n; i++)
		greatest = facet[i].area > greatest->area ? &facet[i] : greatest;
	return greatest;
}

int facets_keep_side(struct facet *facet, size_t *n)
{
	const struct facet *greatest = find_greatest(facet, *n);
	const float side[3] = { greatest->normal[0], greatest->normal[1], greatest->normal[2] };
	size_t n_kept = 0;
	int is_both = 0;

	for (size_t i = 0; i < *n; i++) {
		const float cosine = v3f_dot(facet[i].normal, side);

		is_both |= cosine < OPPOSITE;
		if (cosine > ASIDE)
			facet[n_kept++] = facet[i];
	}
	*n = n_kept;
	return is_both;
}

/* Whether a facet is nearer to the second of two normals. */
static int is_second(const struct facet *facet, const float normal[2][3])
{
	return v3f_dot(facet->normal, normal[1]) > v3f_dot(facet->normal, normal[0]);
}

int facets_keep_face(struct facet *facet, size_t *n)
{
	const struct facet *greatest = find_greatest(facet, *n), *farthest = greatest;
	double area[2] = { 0 }, sum[2][3] = { { 0 } };
	float normal[2][3];
	size_t n_kept = 0;

	for (size_t i = 0; i < *n; i++)
		if (v3f_dot(facet[i].normal, greatest->normal) < v3f_dot(farthest->normal, greatest->normal))
			farthest = &facet[i];
	for (int c = 0; c < 3; c++) {
		normal[0][c] = greatest->normal[c];
		normal[1][c] = farthest->normal[c];
	}
	for (size_t i = 0; i < *n; i++) {
		const int face = is_second(&facet[i], normal);

		area[face] += facet[i].area;
		for (int c = 0; c < 3; c++)
			sum[face][c] += facet[i].area * (double)facet[i].normal[c];
	}
	if (v3d_dot(sum[0], sum[1]) >= CREASE * sqrt(v3d_dot(sum[0], sum[0]) * v3d_dot(sum[1], sum[1])))
		return 0;
	for (size_t i = 0; i < *n; i++)
		if (is_second(&facet[i], normal) == (area[1] > area[0]))
			facet[n_kept++] = facet[i];
	*n = n_kept;
	return 1;
}
