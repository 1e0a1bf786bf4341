// Faces of Open CASCADE to triangles with exact normals.
#ifndef PSR_CAD_TRIANGLES_H
#define PSR_CAD_TRIANGLES_H

#include <array>
#include <stdexcept>
#include <string>
#include <vector>
#include <TopoDS_Face.hxx>

extern "C" {
#include "base/cad_module.h"
}

// What a reader throws; the code is one of psr/error.h.
struct cad_failure : std::runtime_error {
	int code;
	cad_failure(int psr_code, const std::string &text) : std::runtime_error(text), code(psr_code) {}
};

struct cad_vertex {
	std::array<double, 3> at;
	std::array<float, 3> normal; // 0,0,0: none
};

struct cad_triangles {
	std::vector<cad_vertex> vertex;
	std::vector<std::array<uint32_t, 3>> triangle;
	std::vector<uint32_t> color_of;
	uint64_t max_triangles;

	// Appends a face that has been meshed, with its location. Returns false, and appends nothing, if it has no
	// triangle with an area. At poles others have none. Throws cad_failure LIMIT.
	bool add(const TopoDS_Face &face, uint32_t color);

	// Makes normals of vertices at one place equal where they nearly are: across smooth joints of faces.
	void join();
};

#endif
