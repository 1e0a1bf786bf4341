#include <functional>
#include "gltf.h"

namespace gltf {

namespace {

const size_t max_joint_sets = 4;

void set_triangles(reader &r, int mode, const std::vector<uint32_t> &index, primitive &out)
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

void check_count(size_t n, const char *name, size_t n_vertices, const std::string &place)
{
	if (n != 0 && n != n_vertices)
		refuse(PSR_ERR_FORMAT, "%s: %s has %zu elements where POSITION has %zu", place.c_str(), name, n, n_vertices);
}

void check_counts(const primitive &p, const material_use &use, const std::string &place)
{
	const size_t n = p.n_vertices();
	check_count(p.normal.size() / 3, "NORMAL", n, place);
	check_count(p.tangent.size() / 4, "TANGENT", n, place);
	check_count(p.color.size() / 4, "COLOR_0", n, place);
	for (int set = 0; set < PSR_UV_SETS; set++)
		check_count(p.uv[set].size() / 2, use.uv_name[set].c_str(), n, place);
	for (size_t set = 0; set < p.joint.size(); set++) {
		if (p.joint[set].size() != p.weight[set].size())
			refuse(PSR_ERR_FORMAT, "%s: JOINTS_%zu and WEIGHTS_%zu have different numbers of elements", place.c_str(),
			       set, set);
		check_count(p.joint[set].size() / 4, "JOINTS", n, place);
	}
	for (const auto *list : { &p.triangle, &p.point })
		for (size_t i = 0; i < list->size(); i++)
			if ((*list)[i] >= n)
				refuse(PSR_ERR_FORMAT, "%s: corner %zu is vertex %u, but POSITION has %zu", place.c_str(), i,
				       (*list)[i], n);
}

uint64_t count_flat(int mode, uint64_t n)
{
	return mode == TINYGLTF_MODE_POINTS || mode == TINYGLTF_MODE_LINE_LOOP ? n
	       : mode == TINYGLTF_MODE_LINE                                    ? n / 2
	       : n > 0                                                         ? n - 1
	                                                                       : 0;
}

void count_lines(reader &r, const tinygltf::Primitive &g, int position, const std::string &place)
{
	r.n_lines += g.indices >= 0 ? count_flat(g.mode, accessor_count(r, g.indices, place + ".indices")) :
	                              count_flat(g.mode, accessor_count(r, position, place + ".POSITION"));
}

using list_reader = std::function<std::vector<float>(const std::string &, size_t, bool)>;

void read_attributes(const tinygltf::Primitive &g, const material_use &use, const list_reader &list, primitive &out)
{
	out.position = list("POSITION", 3, false);
	out.normal = list("NORMAL", 3, false);
	/* Tangents without normals would not fit the generated ones. */
	if (use.has_normal_map && !out.normal.empty())
		out.tangent = list("TANGENT", 4, false);
	out.color = list("COLOR_0", 4, true);
	for (int set = 0; set < PSR_UV_SETS; set++)
		if (!use.uv_name[set].empty())
			out.uv[set] = list(use.uv_name[set], 2, false);
	for (size_t set = 0; set < max_joint_sets; set++) {
		const std::string digit = std::to_string(set);
		if (g.attributes.count("JOINTS_" + digit) == 0 || g.attributes.count("WEIGHTS_" + digit) == 0)
			break;
		out.joint.push_back(list("JOINTS_" + digit, 4, false));
		out.weight.push_back(list("WEIGHTS_" + digit, 4, true));
	}
}

} // namespace

bool read_primitive(reader &r, const tinygltf::Primitive &g, const material_use &use, primitive &out,
                    const std::string &place)
{
	auto position = g.attributes.find("POSITION");
	if (position == g.attributes.end()) {
		import_mesh_warn(&r.im, "%s has no POSITION and was left out", place.c_str());
		return false;
	}
	if (g.mode < TINYGLTF_MODE_POINTS || g.mode > TINYGLTF_MODE_TRIANGLE_FAN)
		refuse(PSR_ERR_FORMAT, "%s: unknown mode %d", place.c_str(), g.mode);
	if (g.extensions.count("KHR_draco_mesh_compression") != 0) {
		const std::shared_ptr<draco::Mesh> mesh = draco_open(r, g, place);
		read_attributes(g, use, [&](const std::string &name, size_t n, bool is_normalized) {
			return draco_floats(r, *mesh, g, place + "." + name, n, is_normalized);
		}, out);
		out.triangle = draco_triangles(*mesh);
	} else if (g.mode != TINYGLTF_MODE_POINTS && g.mode < TINYGLTF_MODE_TRIANGLES) {
		count_lines(r, g, position->second, place);
		return false;
	} else {
		std::vector<uint32_t> index;
		read_attributes(g, use, [&](const std::string &name, size_t n, bool is_normalized) {
			auto it = g.attributes.find(name);
			return it == g.attributes.end() ? std::vector<float>() :
			                                  accessor_floats(r, it->second, n, place + "." + name, is_normalized);
		}, out);
		if (g.indices >= 0)
			index = accessor_indices(r, g.indices, place + ".indices");
		else
			for (uint32_t i = 0; i < out.n_vertices(); i++)
				index.push_back(i);
		if (g.mode == TINYGLTF_MODE_POINTS)
			out.point = std::move(index);
		else
			set_triangles(r, g.mode, index, out);
	}
	check_counts(out, use, place);
	return true;
}

} // namespace gltf
