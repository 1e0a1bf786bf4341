#include <new>
#include <string>
#include <vector>
#include "gltf.h"

namespace gltf {

namespace {

/* A mesh at a node (-1: a file without nodes), and its morph weights. */
struct placement {
	int node;
	const std::vector<double> *weights;
};

std::vector<std::vector<placement>> place_meshes(const reader &r)
{
	std::vector<std::vector<placement>> uses(r.model.meshes.size());
	if (r.model.nodes.empty())
		for (size_t m = 0; m < uses.size(); m++)
			uses[m].push_back({ -1, &r.model.meshes[m].weights });
	for (int n : r.scene) {
		const tinygltf::Node &node = r.model.nodes[(size_t)n];
		if (node.mesh < 0)
			continue;
		check_index(node.mesh, r.model.meshes.size(), "mesh", "nodes[" + std::to_string(n) + "]");
		const std::vector<double> &own = r.model.meshes[(size_t)node.mesh].weights;
		uses[(size_t)node.mesh].push_back({ n, node.weights.empty() ? &own : &node.weights });
	}
	return uses;
}

void place_primitive(reader &r, const tinygltf::Primitive &g, const primitive &p, const material_use &use,
                     const placement &at, const std::string &place)
{
	const std::vector<double> &weights = *at.weights;
	const int skin = at.node >= 0 && !p.joint.empty() ? r.model.nodes[(size_t)at.node].skin : -1;
	const std::vector<transform> *joints = skin >= 0 ? &skin_joints(r, skin) : nullptr;
	const transform world = at.node >= 0 ? r.world[(size_t)at.node] : transform();
	if (g.targets.empty() || weights.empty()) {
		add_instance(r, p, use, world, joints, place);
		return;
	}

	primitive moved = p;

	morph(r, g, weights, moved, place);
	add_instance(r, moved, use, world, joints, place);
}

void read_meshes(reader &r)
{
	const std::vector<std::vector<placement>> uses = place_meshes(r);
	for (size_t m = 0; m < uses.size(); m++) {
		const tinygltf::Mesh &mesh = r.model.meshes[m];
		for (size_t i = 0; i < mesh.primitives.size() && !uses[m].empty(); i++) {
			const tinygltf::Primitive &g = mesh.primitives[i];
			const std::string place = "meshes[" + std::to_string(m) + "].primitives[" + std::to_string(i) + "]";
			const material_use &use = use_material(r, g.material, g.mode == TINYGLTF_MODE_POINTS);
			primitive p;
			if (!read_primitive(r, g, use, p, place))
				continue;
			if (p.n_vertices() * uses[m].size() > IMPORT_MAX_VERTICES ||
			    p.triangle.size() / 3 * uses[m].size() > IMPORT_MAX_TRIANGLES ||
			    p.point.size() * uses[m].size() > IMPORT_MAX_POINTS)
				refuse(PSR_ERR_LIMIT, "%s: %zu vertices under %zu nodes are more than %llu", place.c_str(),
				       p.n_vertices(), uses[m].size(), (unsigned long long)IMPORT_MAX_VERTICES);
			for (const placement &at : uses[m])
				place_primitive(r, g, p, use, at, place);
		}
	}
}

void report(reader &r)
{
	std::string names;
	if (r.n_lines > 0) {
		const uint64_t room = UINT32_MAX - r.im.mesh->n_dropped_primitives;
		import_mesh_warn(&r.im, "lines were left out: %llu", (unsigned long long)r.n_lines);
		r.im.mesh->n_dropped_primitives += (uint32_t)(r.n_lines < room ? r.n_lines : room);
	}
	for (const std::string &name : r.src.ignored)
		names += (names.empty() ? "" : ", ") + name;
	if (!names.empty())
		import_mesh_warn(&r.im, "unsupported extensions were ignored: %.200s", names.c_str());
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
	r.materials.resize(r.model.materials.size() + 1);
	r.image_of.assign(r.src.images.size(), -1);
}

} // namespace

} // namespace gltf

extern "C" int import_gltf(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	try {
		gltf::reader r = { *im, {}, {}, {}, {}, {}, {}, {}, {} };

		gltf::validate(r.src, im->path, bytes, n_bytes);
		gltf::parse(r);
		gltf::place_nodes(r);
		gltf::read_meshes(r);
		gltf::presets_place(r);
		gltf::report(r);
		return import_mesh_merge(im, err);
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
