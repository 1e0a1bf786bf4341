#include <map>
#include "gltf.h"

namespace gltf {

namespace {

const uint64_t max_morphed = UINT64_C(1) << 28; /* of the whole file: vertices times targets */

/* An attribute that targets move, and its numbers a vertex. */
struct channel {
	const char *name;
	size_t n_components;
};

/* A morph target: the accessor of each attribute that it moves. */
struct target {
	const std::map<std::string, int> &accessor;
	double weight;
	std::string place;
};

void add_target(reader &r, const target &target, const channel &c, std::vector<double> &sum)
{
	auto it = target.accessor.find(c.name);
	if (it == target.accessor.end() || sum.empty())
		return;
	const std::string where = target.place + "." + c.name;
	const size_t n = sum.size() / c.n_components;
	if (accessor_count(r, it->second, where) != n)
		refuse(PSR_ERR_FORMAT, "%s has %zu elements where the primitive has %zu", where.c_str(),
		       accessor_count(r, it->second, where), n);
	const std::vector<float> delta = accessor_floats(r, it->second, 3, where);
	for (size_t i = 0; i < n; i++)
		for (size_t k = 0; k < 3; k++)
			sum[i * c.n_components + k] += target.weight * (double)delta[3 * i + k];
}

void morph_list(reader &r, const tinygltf::Primitive &g, const channel &c, const std::vector<double> &weights,
                std::vector<float> &list, const std::string &place)
{
	std::vector<double> sum(list.begin(), list.end());
	for (size_t t = 0; t < g.targets.size() && t < weights.size(); t++)
		if (weights[t] != 0.0)
			add_target(r, { g.targets[t], weights[t], place + ".targets[" + std::to_string(t) + "]" }, c, sum);
	for (size_t i = 0; i < sum.size(); i++)
		list[i] = (float)sum[i];
}

} // namespace

void morph(reader &r, const tinygltf::Primitive &g, const std::vector<double> &weights, primitive &p,
           const std::string &place)
{
	for (size_t t = 0; t < g.targets.size() && t < weights.size(); t++)
		r.n_morphed += weights[t] != 0.0 ? p.n_vertices() : 0;
	if (r.n_morphed > max_morphed)
		refuse(PSR_ERR_LIMIT, "%s: the file has too many morph targets times vertices", place.c_str());
	morph_list(r, g, { "POSITION", 3 }, weights, p.position, place);
	morph_list(r, g, { "NORMAL", 3 }, weights, p.normal, place);
	morph_list(r, g, { "TANGENT", 4 }, weights, p.tangent, place);
}

const std::vector<transform> &skin_joints(reader &r, int skin)
{
	const std::string place = "skins[" + std::to_string(skin) + "]";
	check_index(skin, r.model.skins.size(), "skin", "");
	r.joints.resize(r.model.skins.size());

	const tinygltf::Skin &s = r.model.skins[(size_t)skin];
	std::vector<transform> &out = r.joints[(size_t)skin];
	std::vector<float> inverse;

	if (!out.empty())
		return out;
	if (s.joints.empty())
		refuse(PSR_ERR_FORMAT, "%s has no joints", place.c_str());
	if (s.inverseBindMatrices >= 0)
		inverse = accessor_floats(r, s.inverseBindMatrices, 16, place + ".inverseBindMatrices");
	if (s.inverseBindMatrices >= 0 && inverse.size() / 16 < s.joints.size())
		refuse(PSR_ERR_FORMAT, "%s has %zu joints, but %zu inverse bind matrices", place.c_str(), s.joints.size(),
		       inverse.size() / 16);
	for (size_t i = 0; i < s.joints.size(); i++) {
		const int joint = s.joints[i];
		transform bind;
		if (joint < 0 || (size_t)joint >= r.world.size() || !r.is_placed[(size_t)joint])
			refuse(PSR_ERR_FORMAT, "%s: node %d, its joint %zu, is missing or part of a cycle", place.c_str(), joint,
			       i);
		/* The last row is 0 0 0 1 up to rounding. */
		for (size_t k = 0; k < 16 && !inverse.empty(); k++)
			bind.m[k] = k % 4 < 3 ? (double)inverse[16 * i + k] : bind.m[k];
		out.push_back(multiply(r.world[(size_t)joint], bind));
	}
	return out;
}

transform blend(const primitive &p, const std::vector<transform> &joints, size_t v, const std::string &place)
{
	double total = 0.0;
	transform out;
	for (const auto &set : p.weight)
		for (size_t k = 0; k < 4; k++)
			total += set[4 * v + k] > 0.0f ? (double)set[4 * v + k] : 0.0;
	/* A vertex without weights follows its first joint, as in other viewers. */
	const bool is_loose = !(total > 0.0 && total <= 1e30);

	for (double &x : out.m)
		x = 0.0;
	for (size_t set = 0; set < p.joint.size(); set++)
		for (size_t k = 0; k < 4; k++) {
			const float weight = p.weight[set][4 * v + k], joint = p.joint[set][4 * v + k];
			const bool is_first = set == 0 && k == 0;
			const double share = is_loose ? (is_first ? 1.0 : 0.0) : weight > 0.0f ? (double)weight / total : 0.0;
			if (share == 0.0)
				continue;
			if (!(joint >= 0.0f && joint < (float)joints.size()))
				refuse(PSR_ERR_FORMAT, "%s: vertex %zu uses joint %.0f, but its skin has %zu", place.c_str(), v,
				       (double)joint, joints.size());
			for (size_t i = 0; i < 16; i++)
				out.m[i] += share * joints[(size_t)joint].m[i];
		}
	return out;
}

} // namespace gltf
