#include "result.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

// Copies to memory that cad_destroy() frees.
template <typename To, typename From> To *copy(const std::vector<From> &from)
{
	static_assert(sizeof(To) == sizeof(From));
	void *block = std::malloc((from.size() + 1) * sizeof(From));
	if (block == nullptr)
		throw std::bad_alloc();
	std::memcpy(block, from.data(), from.size() * sizeof(From));
	return static_cast<To *>(block);
}

void hand_over(psr_patch *out, const cad_patch &p)
{
	for (int k = 0; k < 2; k++) {
		out->degree[k] = p.degree[k];
		out->n[k] = p.n[k];
		out->knot[k] = copy<double>(p.knot[k]);
	}
	out->control = copy<double[4]>(p.control);
	out->corner = copy<double[2]>(p.corner);
	out->triangle = copy<uint32_t[3]>(p.triangle);
	out->rim = copy<uint8_t>(p.rim);
	out->n_corners = static_cast<uint32_t>(p.corner.size());
	out->n_triangles = static_cast<uint32_t>(p.triangle.size());
	out->material = p.color;
}

} // namespace

void cad_hand_over(cad_module_mesh *out, const cad_walk &w)
{
	const cad_triangles &t = w.triangles;
	std::vector<std::array<double, 3>> position;
	std::vector<std::array<float, 3>> normal;
	for (const cad_vertex &v : t.vertex) {
		position.push_back(v.at);
		normal.push_back(v.normal);
	}
	out->position = copy<double[3]>(position);
	out->normal = copy<float[3]>(normal);
	out->triangle = copy<uint32_t[3]>(t.triangle);
	out->color_of = copy<uint32_t>(t.color_of);
	out->color = copy<float[4]>(w.color);
	out->n_vertices = static_cast<uint32_t>(t.vertex.size());
	out->n_triangles = static_cast<uint32_t>(t.triangle.size());
	out->n_colors = static_cast<uint32_t>(w.color.size());
	if (w.patches.patch.size() > 0) {
		out->patch = static_cast<psr_patch *>(std::calloc(w.patches.patch.size(), sizeof *out->patch));
		if (out->patch == nullptr)
			throw std::bad_alloc();
		out->n_patches = static_cast<uint32_t>(w.patches.patch.size());
		for (uint32_t i = 0; i < out->n_patches; i++)
			hand_over(&out->patch[i], w.patches.patch[i]);
		out->patch_of = copy<uint32_t>(w.patches.patch_of);
	}
	out->n_unlike = w.patches.n_unlike;
	out->n_faces = w.n_faces;
	out->n_left_out = w.n_left_out;
	out->n_open = w.n_open;
	std::snprintf(out->first_left_out, sizeof out->first_left_out, "%s", w.first_left_out.c_str());
}

extern "C" void cad_destroy(cad_module_mesh *mesh)
{
	if (mesh == nullptr)
		return;
	std::free(mesh->position);
	std::free(mesh->normal);
	std::free(mesh->triangle);
	std::free(mesh->color_of);
	std::free(mesh->color);
	for (uint32_t i = 0; i < mesh->n_patches; i++)
		cad_patch_free(&mesh->patch[i]);
	std::free(mesh->patch);
	std::free(mesh->patch_of);
	std::free(mesh);
}
