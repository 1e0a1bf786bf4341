#include <math.h>
#include <stdlib.h>
#include "lean.h"
#include "base/maths.h"
#include "base/vec.h"
#include "surface/normal.h"

#define SLIT 4.0          /* leaves: what is narrower is filled in. A face so wide in sight is not, at the finest level */
#define LEAST_DEGREES 10  /* of a mapped normal, which leans on however small a face */
#define MOST_PARTS 1000   /* one leaf of so many may lean further than the cell tells */

/* Finds a facet's face, which is of unit length; 0: the triangle has none. Returns how wide the triangle is, in leaves. */
static double face_of(double face[3], const struct facet *facet)
{
	double side[3][3], longest = 0;

	for (int i = 0; i < 3; i++) {
		v3d_sub(side[i], facet->corner[(i + 1) % 3], facet->corner[i]);
		longest = fmax(longest, v3d_length(side[i]));
	}
	v3d_cross(face, side[0], side[1]);
	return longest > 0 ? v3d_normalize(face, face) / longest : 0;
}

void lean_add(struct lean *lean, uint64_t path, const float normal[3], const struct facet *facet, size_t n_facets)
{
	const struct psr_mesh *mesh = lean->mesh;
	struct lean_cell *cell = &lean->cell[octree_lean_first(path, lean->levels)];
	double sum[3] = { 0 }, cosine = 0, width = 0;
	int is_mapped = 0;

	cell->n_leaves++;
	for (size_t i = 0; i < n_facets; i++) {
		double face[3];

		width = fmax(width, face_of(face, &facet[i]));
		is_mapped |= normal_is_mapped(&mesh->material[mesh->triangle_material[facet[i].triangle]]);
		v3d_add_scaled(sum, sum, lean->is_turned[facet[i].triangle] ? -facet[i].area : facet[i].area, face);
	}
	if (v3d_normalize(sum, sum) == 0)
		return;
	for (int c = 0; c < 3; c++)
		cosine += sum[c] * (double)normal[c];
	const double sine = sqrt(fmax(1 - cosine * cosine, 0));
	const int degrees = cosine <= 0 ? 90 : (int)(acos(fmin(cosine, 1)) / PSR_DEGREE);
	if (cosine <= 0 || sine * width >= SLIT || (is_mapped && degrees >= LEAST_DEGREES))
		cell->n[degrees]++;
}

static uint8_t lean_of(const struct lean_cell *cell)
{
	uint32_t n_beyond = 0;
	int degrees = 91; /* so many from here on */

	while (degrees > 0 && n_beyond + cell->n[degrees - 1] <= cell->n_leaves / MOST_PARTS)
		n_beyond += cell->n[--degrees];
	return degrees > 0 ? (uint8_t)ceil(sin(fmin(degrees, 90) * PSR_DEGREE) * 255) : 0;
}

int lean_set(struct octree *tree, const struct lean *lean)
{
	uint8_t any = 0;

	if ((tree->lean = malloc(OCTREE_LEAN_CELLS)) == NULL)
		return 0;
	for (int i = 0; i < OCTREE_LEAN_CELLS; i++)
		any |= tree->lean[i] = lean_of(&lean->cell[i]);
	if (any == 0) {
		free(tree->lean);
		tree->lean = NULL;
	}
	return 1;
}
