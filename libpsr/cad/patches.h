// Faces of Open CASCADE to trimmed NURBS.
#ifndef PSR_CAD_PATCHES_H
#define PSR_CAD_PATCHES_H

#include "triangles.h"

struct cad_patch {
	int degree[2];
	std::array<uint32_t, 2> n;
	std::array<std::vector<double>, 2> knot;
	std::vector<std::array<double, 4>> control;
	std::vector<std::array<double, 2>> corner;
	std::vector<std::array<uint32_t, 3>> triangle;
	std::vector<uint8_t> rim;
	uint32_t color, first_vertex; // vertices are those of cad_triangles, a corner each
};

// Sides of faces' triangles that one triangle of the face has.
struct cad_rim {
	uint32_t vertex[2];
	uint32_t patch, triangle; // patch UINT32_MAX: the face has none
	int side;
};

struct cad_patches {
	std::vector<cad_patch> patch;
	std::vector<uint32_t> patch_of; // of each triangle of `triangles`
	std::vector<cad_rim> rim;
	uint32_t n_unlike = 0;
	int most_degree;
	double tolerance; // in units of the file, between a surface and its NURBS

	// The face is the last one that `triangles` got, of which first_triangle and first_vertex were the first.
	void add(const cad_triangles &triangles, const TopoDS_Face &face, uint32_t color, size_t first_triangle,
	         size_t first_vertex);

	// When all are there, and `triangles` is joined: marks rims that nothing goes on beside smoothly.
	void find_ends(const cad_triangles &triangles);
};

#endif
