#include <cmath>
#include <cstring>
#include <new>
#include <string>
#include <vector>
#include "gltf.h"

namespace gltf {

/* An error whose text names the path already. */
struct reported {
	struct psr_error error;
};

namespace {

void set_triangles(const reader &r, int mode, const std::vector<uint32_t> &index, primitive &out)
{
	const size_t n = index.size();

	if (mode == TINYGLTF_MODE_TRIANGLES) {
		out.triangle.assign(index.begin(), index.end() - (ptrdiff_t)(n % 3));
		if (n % 3 != 0)
			import_mesh_warn(&r.im, "indices beyond the last whole triangle were left out");
		return;
	}
	for (size_t i = 0; i + 2 < n; i++) {
		size_t odd = i & 1;

		if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
			out.triangle.insert(out.triangle.end(), { index[i], index[i + 1 + odd], index[i + 2 - odd] });
		else
			out.triangle.insert(out.triangle.end(), { index[i + 1], index[i + 2], index[0] });
	}
}

void check_counts(const primitive &p, const std::string &uv_name, const std::string &place)
{
	const size_t n = p.n_vertices();
	const struct {
		const char *name;
		size_t n;
	} lists[] = {
		{ "NORMAL", p.normal.size() / 3 },
		{ uv_name.c_str(), p.uv.size() / 2 },
		{ "COLOR_0", p.color.size() / 4 },
	};

	for (const auto &list : lists)
		if (list.n != 0 && list.n != n)
			refuse(PSR_ERR_FORMAT, "%s: %s has %zu elements where POSITION has %zu", place.c_str(), list.name, list.n,
			       n);
	for (size_t i = 0; i < p.triangle.size(); i++)
		if (p.triangle[i] >= n)
			refuse(PSR_ERR_FORMAT, "%s: corner %zu of its triangles is vertex %u, but POSITION has %zu", place.c_str(),
			       i,
			       p.triangle[i], n);
}

uint64_t count_flat(int mode, uint64_t n)
{
	return mode == TINYGLTF_MODE_POINTS || mode == TINYGLTF_MODE_LINE_LOOP ? n
	       : mode == TINYGLTF_MODE_LINE                                    ? n / 2
	       : n > 0                                                         ? n - 1
	                                                                       : 0;
}

/* False if the primitive has no triangles: points and lines are counted, not read. */
bool read_primitive(const reader &r, const tinygltf::Primitive &g, const texture_use &use, primitive &out,
                    const std::string &place)
{
	auto position = g.attributes.find("POSITION");
	auto list = [&](const std::string &name, size_t n_components) {
		auto it = g.attributes.find(name);

		return it == g.attributes.end() ? std::vector<float>() :
		                                  accessor_floats(r, it->second, n_components, place + "." + name);
	};

	if (position == g.attributes.end()) {
		import_mesh_warn(&r.im, "%s has no POSITION and was left out", place.c_str());
		return false;
	}
	if (g.mode < TINYGLTF_MODE_POINTS || g.mode > TINYGLTF_MODE_TRIANGLE_FAN)
		refuse(PSR_ERR_FORMAT, "%s: mode %d is not known", place.c_str(), g.mode);
	if (g.extensions.count("KHR_draco_mesh_compression") != 0) {
		draco_read(r, g, use.uv_name, out, place);
	} else {
		std::vector<uint32_t> index;

		out.position = list("POSITION", 3);
		if (g.indices >= 0)
			index = accessor_indices(r, g.indices, place + ".indices");
		else
			for (uint32_t i = 0; i < out.n_vertices(); i++)
				index.push_back(i);
		if (g.mode < TINYGLTF_MODE_TRIANGLES) {
			r.im.mesh->n_dropped_primitives += (uint32_t)count_flat(g.mode, index.size());
			return false;
		}
		out.normal = list("NORMAL", 3);
		out.color = list("COLOR_0", 4);
		if (!use.uv_name.empty())
			out.uv = list(use.uv_name, 2);
		set_triangles(r, g.mode, index, out);
	}
	check_counts(out, use.uv_name, place);
	for (size_t i = 0; i < out.uv.size(); i += 2) {
		double u = out.uv[i], v = out.uv[i + 1];

		out.uv[i] = (float)(use.m[0] * u + use.m[1] * v + use.m[2]);
		out.uv[i + 1] = (float)(use.m[3] * u + use.m[4] * v + use.m[5]);
	}
	return true;
}

/* Normals go with the inverse transpose: cofactors over the determinant, of which only the sign matters. */
void add_instance(reader &r, const primitive &p, int material, const transform &world)
{
	const double *m = world.m;
	const double cofactor[9] = { m[5] * m[10] - m[6] * m[9], m[6] * m[8] - m[4] * m[10], m[4] * m[9] - m[5] * m[8],
		                     m[9] * m[2] - m[10] * m[1], m[10] * m[0] - m[8] * m[2], m[8] * m[1] - m[9] * m[0],
		                     m[1] * m[6] - m[2] * m[5], m[2] * m[4] - m[0] * m[6], m[0] * m[5] - m[1] * m[4] };
	const double determinant = m[0] * cofactor[0] + m[1] * cofactor[1] + m[2] * cofactor[2];
	const double sign = determinant < 0.0 ? -1.0 : 1.0;
	struct psr_mesh *mesh = r.im.mesh;
	struct psr_error error = {};
	const uint32_t first_v = mesh->n_vertices, first_t = mesh->n_triangles;
	double largest = 0.0;

	for (double c : cofactor)
		largest = std::fmax(largest, std::fabs(c));
	if (import_mesh_grow(&r.im, p.n_vertices(), p.triangle.size() / 3,
	                     (p.uv.empty() ? 0 : IMPORT_HAS_UV0) | (p.color.empty() ? 0 : IMPORT_HAS_COLOR), &error) != PSR_OK)
		throw reported{ error };
	for (size_t i = 0; i < p.n_vertices(); i++) {
		const float *x = &p.position[3 * i];

		for (int row = 0; row < 3; row++)
			mesh->position[first_v + i][row] = m[row] * x[0] + m[4 + row] * x[1] + m[8 + row] * x[2] + m[12 + row];
		if (!p.normal.empty() && largest > 0.0) {
			const float *n = &p.normal[3 * i];

			for (int row = 0; row < 3; row++)
				mesh->normal[first_v + i][row] = (float)(sign * (cofactor[row] / largest * n[0] +
				                                                 cofactor[3 + row] / largest * n[1] +
				                                                 cofactor[6 + row] / largest * n[2]));
		}
	}
	if (!p.uv.empty())
		std::memcpy(mesh->uv[0] + first_v, p.uv.data(), p.uv.size() * sizeof(float));
	if (!p.color.empty())
		std::memcpy(mesh->color + first_v, p.color.data(), p.color.size() * sizeof(float));
	for (size_t t = 0; t < p.triangle.size() / 3; t++) {
		uint32_t *v = mesh->triangle[first_t + t];

		v[0] = first_v + p.triangle[3 * t];
		v[1] = first_v + p.triangle[3 * t + (sign < 0.0 ? 2 : 1)];
		v[2] = first_v + p.triangle[3 * t + (sign < 0.0 ? 1 : 2)];
		mesh->triangle_material[first_t + t] = (uint32_t)material;
	}
}

void read_meshes(reader &r)
{
	std::vector<std::vector<transform>> uses(r.model.meshes.size());

	for (const placement &p : place_meshes(r))
		uses[(size_t)p.mesh].push_back(p.world);
	for (size_t m = 0; m < uses.size(); m++) {
		const tinygltf::Mesh &mesh = r.model.meshes[m];

		for (size_t i = 0; i < mesh.primitives.size() && !uses[m].empty(); i++) {
			const std::string place = "meshes[" + std::to_string(m) + "].primitives[" + std::to_string(i) + "]";
			texture_use use;
			primitive p;
			int material = material_index(r, mesh.primitives[i].material, use);

			if (!read_primitive(r, mesh.primitives[i], use, p, place))
				continue;
			if (p.n_vertices() * uses[m].size() > IMPORT_MAX_VERTICES ||
			    p.triangle.size() / 3 * uses[m].size() > IMPORT_MAX_TRIANGLES)
				refuse(PSR_ERR_LIMIT, "%s: %zu vertices under %zu nodes are more than %llu", place.c_str(),
				       p.n_vertices(),
				       uses[m].size(), (unsigned long long)IMPORT_MAX_VERTICES);
			for (const transform &world : uses[m])
				add_instance(r, p, material, world);
		}
		if (!mesh.weights.empty() && !uses[m].empty())
			import_mesh_warn(&r.im, "morph targets are not used");
	}
}

void parse(reader &r)
{
	tinygltf::TinyGLTF parser;
	std::string errors, warnings;

	if (!parser.LoadASCIIFromString(&r.model, &errors, &warnings, r.src.json.data(), (unsigned)r.src.json.size(), "")) {
		while (!errors.empty() && errors.back() == '\n')
			errors.pop_back();
		refuse(PSR_ERR_FORMAT, "%s", errors.empty() ? "broken glTF" : errors.c_str());
	}
	r.src.json.clear();
	r.material_of.assign(r.model.materials.size() + 1, -1);
	r.image_of.assign(r.src.images.size(), -1);
}

} // namespace

} // namespace gltf

extern "C" int import_gltf(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	try {
		gltf::reader r = { *im, {}, {}, {}, {} };

		gltf::door_open(r.src, im->path, bytes, n_bytes);
		gltf::parse(r);
		gltf::read_meshes(r);
		return PSR_OK;
	} catch (const gltf::failure &f) {
		return psr_fail(err, f.code, "%s: %s", im->path, f.text.c_str());
	} catch (const gltf::reported &f) {
		return psr_fail(err, f.error.code, "%s", f.error.text);
	} catch (const std::bad_alloc &) {
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read this file", im->path);
	} catch (const std::exception &e) {
		return psr_fail(err, PSR_ERR_FORMAT, "%s: broken glTF: %s", im->path, e.what());
	} catch (...) {
		return psr_fail(err, PSR_ERR_FORMAT, "%s: broken glTF", im->path);
	}
}
