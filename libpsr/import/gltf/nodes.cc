#include <cmath>
#include "gltf.h"

namespace gltf {

namespace {

void check_length(const std::vector<double> &v, size_t n, const char *what, int node)
{
	if (!v.empty() && v.size() != n)
		refuse(PSR_ERR_FORMAT, "nodes[%d]: %s has %zu numbers, expected %zu", node, what, v.size(), n);
}

transform local_transform(const tinygltf::Node &node, int index)
{
	double s[3] = { 1, 1, 1 }, q[4] = { 0, 0, 0, 1 }, t[3] = { 0, 0, 0 }, norm = 0.0;
	transform out;
	check_length(node.matrix, 16, "matrix", index);
	check_length(node.scale, 3, "scale", index);
	check_length(node.rotation, 4, "rotation", index);
	check_length(node.translation, 3, "translation", index);
	if (!node.matrix.empty()) {
		for (size_t i = 0; i < 16; i++)
			out.m[i] = node.matrix[i];
		if (out.m[3] != 0.0 || out.m[7] != 0.0 || out.m[11] != 0.0 || out.m[15] != 1.0)
			refuse(PSR_ERR_FORMAT, "nodes[%d]: the last row of its matrix is not 0 0 0 1", index);
		return out;
	}
	for (size_t i = 0; i < node.scale.size(); i++)
		s[i] = node.scale[i];
	for (size_t i = 0; i < node.translation.size(); i++)
		t[i] = node.translation[i];
	for (size_t i = 0; i < node.rotation.size(); i++)
		q[i] = node.rotation[i];
	for (double x : q)
		norm += x * x;
	if (!(norm > 0.0) || !std::isfinite(norm))
		refuse(PSR_ERR_FORMAT, "nodes[%d]: its rotation is not a quaternion of positive length", index);

	double k = 2.0 / norm, x = q[0], y = q[1], z = q[2], w = q[3];
	const double r[9] = { 1 - k * (y * y + z * z), k * (x * y + z * w), k * (x * z - y * w),
		              k * (x * y - z * w), 1 - k * (x * x + z * z), k * (y * z + x * w),
		              k * (x * z + y * w), k * (y * z - x * w), 1 - k * (x * x + y * y) };

	for (int col = 0; col < 3; col++) {
		for (int row = 0; row < 3; row++)
			out.m[4 * col + row] = r[3 * col + row] * s[col];
		out.m[12 + col] = t[col];
	}
	return out;
}

std::vector<int> parentless(const tinygltf::Model &model)
{
	std::vector<char> is_child(model.nodes.size(), 0);
	std::vector<int> out;
	for (const tinygltf::Node &node : model.nodes)
		for (int child : node.children)
			if (child >= 0 && (size_t)child < is_child.size())
				is_child[(size_t)child] = 1;
	for (size_t i = 0; i < is_child.size(); i++)
		if (!is_child[i])
			out.push_back((int)i);
	return out;
}

const std::vector<int> &scene_roots(const tinygltf::Model &model, const std::vector<int> &all)
{
	int scene = model.defaultScene;
	if (scene >= 0)
		check_index(scene, model.scenes.size(), "scene", "");
	if (!model.scenes.empty())
		return model.scenes[(size_t)(scene < 0 ? 0 : scene)].nodes;
	if (all.empty() && !model.nodes.empty())
		refuse(PSR_ERR_FORMAT, "every node is the child of another: the nodes form a cycle");
	return all;
}

/* Nodes must form trees: the walk reaches each once, and ends. */
void walk(reader &r, const std::vector<int> &roots, bool is_scene)
{
	struct open_node {
		int node;
		transform parent;
	};
	const tinygltf::Model &model = r.model;
	std::vector<open_node> stack;

	for (size_t i = roots.size(); i-- > 0;)
		stack.push_back({ roots[i], transform() });
	while (!stack.empty()) {
		open_node at = stack.back();

		stack.pop_back();
		check_index(at.node, model.nodes.size(), "node", "");
		if (r.is_placed[(size_t)at.node] && !is_scene)
			continue;
		if (r.is_placed[(size_t)at.node])
			refuse(PSR_ERR_FORMAT, "nodes[%d] is reached twice: the nodes form a cycle, or it has two parents",
			       at.node);

		const tinygltf::Node &node = model.nodes[(size_t)at.node];

		r.is_placed[(size_t)at.node] = 1;
		r.world[(size_t)at.node] = multiply(at.parent, local_transform(node, at.node));
		if (is_scene)
			r.scene.push_back(at.node);
		for (size_t i = node.children.size(); i-- > 0;)
			stack.push_back({ node.children[i], r.world[(size_t)at.node] });
	}
}

} // namespace

transform multiply(const transform &a, const transform &b)
{
	transform out;
	for (int col = 0; col < 4; col++)
		for (int row = 0; row < 4; row++) {
			double sum = 0.0;
			for (int k = 0; k < 4; k++)
				sum += a.m[4 * k + row] * b.m[4 * col + k];
			out.m[4 * col + row] = sum;
		}
	return out;
}

void place_nodes(reader &r)
{
	const std::vector<int> all = parentless(r.model);
	r.world.resize(r.model.nodes.size());
	r.is_placed.assign(r.model.nodes.size(), 0);
	walk(r, scene_roots(r.model, all), true);
	/* Joints may be outside of the scene. */
	if (!r.model.skins.empty())
		walk(r, all, false);
}

} // namespace gltf
