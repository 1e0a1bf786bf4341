#include <cmath>
#include <nlohmann/json.hpp>
#include "gltf.h"

using nlohmann::json;

namespace gltf {

namespace {

double number(const json &o, const char *key, double fallback)
{
	return o.is_object() && o.contains(key) && o[key].is_number() ? o[key].get<double>() : fallback;
}

std::string text(const json &o, const char *key)
{
	return o.contains(key) && o[key].is_string() ? o[key].get<std::string>() : std::string();
}

camera_source read_camera(const json &o)
{
	const std::string type = text(o, "type");
	const json &body = o.contains(type) ? o[type] : json();
	camera_source out = { text(o, "name"), {}, false };
	out.camera.near_z = number(body, "znear", 0.0);
	if (type == "perspective") {
		out.camera.kind = PSR_CAMERA_PERSPECTIVE;
		out.camera.fov_y = number(body, "yfov", 0.0);
		out.is_valid = out.camera.fov_y >= 1e-6 && out.camera.fov_y <= 3.14159;
	} else if (type == "orthographic") {
		out.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
		out.camera.ortho_height = 2.0 * std::fabs(number(body, "ymag", 0.0));
		out.is_valid = out.camera.ortho_height > 0.0 && std::isfinite(out.camera.ortho_height);
	}
	out.is_valid = out.is_valid && out.camera.near_z >= 0.0 && std::isfinite(out.camera.near_z);
	return out;
}

light_source read_light(const json &o)
{
	const std::string type = text(o, "type");
	const json &spot = o.contains("spot") ? o["spot"] : json();
	const double intensity = number(o, "intensity", 1.0);
	light_source out = { text(o, "name"), {}, type == "directional" || type == "point" || type == "spot" };
	out.light.kind = type == "point" ? PSR_LIGHT_POINT : type == "spot" ? PSR_LIGHT_SPOT : PSR_LIGHT_DIRECTIONAL;
	for (size_t c = 0; c < 3; c++) {
		double x = 1.0;
		if (o.contains("color") && o["color"].is_array() && c < o["color"].size() && o["color"][c].is_number())
			x = o["color"][c].get<double>();
		out.light.color[c] = x * intensity;
		out.is_valid = out.is_valid && out.light.color[c] >= 0.0 && std::isfinite(out.light.color[c]);
	}
	if (out.light.kind != PSR_LIGHT_DIRECTIONAL)
		out.light.reference = 1.0;
	if (out.light.kind == PSR_LIGHT_SPOT) {
		out.light.inner = number(spot, "innerConeAngle", 0.0);
		out.light.outer = number(spot, "outerConeAngle", M_PI / 4.0);
		out.is_valid = out.is_valid && out.light.inner >= 0.0 && out.light.inner <= out.light.outer &&
		               out.light.outer > 0.0 && out.light.outer <= M_PI;
	}
	return out;
}

struct axes {
	double origin[3], right[3], up[3], back[3]; /* unit length but for `origin` */
	double scale[3];
};

bool axes_of(axes &out, const transform &t)
{
	double *axis[3] = { out.right, out.up, out.back };
	bool is_good = true;
	for (int k = 0; k < 3; k++) {
		const double *column = &t.m[4 * k];
		double largest = std::fmax(std::fabs(column[0]), std::fmax(std::fabs(column[1]), std::fabs(column[2])));
		double sum = 0.0;
		for (int i = 0; i < 3; i++)
			sum += column[i] / largest * (column[i] / largest);
		out.scale[k] = largest * std::sqrt(sum);
		is_good = is_good && out.scale[k] > 0.0 && std::isfinite(out.scale[k]) && std::isfinite(t.m[12 + k]);
		for (int i = 0; i < 3; i++)
			axis[k][i] = column[i] / out.scale[k];
		out.origin[k] = t.m[12 + k];
	}
	return is_good;
}

/* Finds the middle of the mesh; false if it is not finite. */
bool middle_of(double out[3], const struct psr_mesh *mesh)
{
	double low[3], high[3];
	bool is_good = true;
	import_mesh_bounds(low, high, mesh);
	for (int k = 0; k < 3; k++) {
		out[k] = 0.5 * low[k] + 0.5 * high[k];
		is_good = is_good && std::isfinite(out[k]);
	}
	return is_good;
}

/* glTF cameras have no target: takes the point of the axis nearest to the middle of the scene. */
bool place_camera(struct psr_camera &c, const axes &a, const double *middle)
{
	double distance = 0.0, cosine = 0.0;
	bool is_good = true;
	for (int k = 0; k < 3; k++) {
		distance -= middle != nullptr ? a.back[k] * (middle[k] - a.origin[k]) : 0.0;
		cosine += a.up[k] * a.back[k];
	}
	if (!(distance > 0.0) || !std::isfinite(distance))
		distance = a.scale[2];
	for (int k = 0; k < 3; k++) {
		c.eye[k] = a.origin[k];
		c.target[k] = a.origin[k] - distance * a.back[k];
		c.up[k] = a.up[k];
		is_good = is_good && std::isfinite(c.target[k]);
	}
	c.near_z *= a.scale[2];
	c.ortho_height *= a.scale[1];
	return is_good && std::isfinite(c.near_z) && std::isfinite(c.ortho_height) && std::fabs(cosine) < 1.0 - 1e-9 &&
	       (c.target[0] != c.eye[0] || c.target[1] != c.eye[1] || c.target[2] != c.eye[2]);
}

void add_camera(reader &r, int node, int index, const axes *a, const double *middle)
{
	check_index(index, r.src.cameras.size(), "camera", "nodes[" + std::to_string(node) + "]");
	const camera_source &s = r.src.cameras[(size_t)index];
	const std::string &name = r.model.nodes[(size_t)node].name;
	struct psr_camera camera = s.camera;
	struct psr_error error = {};

	if (!s.is_valid || a == nullptr || !place_camera(camera, *a, middle))
		import_mesh_warn(&r.im, "cameras[%d] at nodes[%d] makes no picture and was left out", index, node);
	else if (import_mesh_add_camera(&r.im, name.empty() ? s.name.c_str() : name.c_str(), &camera, &error) != PSR_OK)
		refuse(error.code, "%s", error.text);
}

void add_light(reader &r, int node, int index, const axes *a)
{
	check_index(index, r.src.lights.size(), "light", "nodes[" + std::to_string(node) + "]");
	const light_source &s = r.src.lights[(size_t)index];
	const std::string &name = r.model.nodes[(size_t)node].name;
	struct psr_light light = s.light;
	struct psr_error error = {};

	if (!s.is_valid || a == nullptr) {
		import_mesh_warn(&r.im, "light %d at nodes[%d] gives no light and was left out", index, node);
		return;
	}
	for (int k = 0; k < 3; k++) {
		light.position[k] = a->origin[k];
		light.direction[k] = 0.0 - a->back[k]; /* no -0 */
	}
	if (import_mesh_add_light(&r.im, name.empty() ? s.name.c_str() : name.c_str(), &light, &error) != PSR_OK)
		refuse(error.code, "%s", error.text);
}

} // namespace

void presets_read(source &s, json &doc)
{
	for (const json &camera : array_of(doc, "cameras"))
		s.cameras.push_back(read_camera(camera));
	doc.erase("cameras");
	if (!doc.contains("extensions") || !doc["extensions"].is_object() ||
	    !doc["extensions"].contains("KHR_lights_punctual"))
		return;

	json &extension = doc["extensions"]["KHR_lights_punctual"];

	if (!extension.is_object())
		refuse(PSR_ERR_FORMAT, "extensions.KHR_lights_punctual is not an object");
	for (const json &light : array_of(extension, "lights"))
		s.lights.push_back(read_light(light));
	doc["extensions"].erase("KHR_lights_punctual");
}

void presets_place(reader &r)
{
	double middle[3];
	const bool has_middle = middle_of(middle, r.im.mesh);
	for (int n : r.scene) {
		const tinygltf::Node &node = r.model.nodes[(size_t)n];
		auto light = node.extensions.find("KHR_lights_punctual");
		axes a;
		const bool is_good = axes_of(a, r.world[(size_t)n]);
		if (node.camera >= 0)
			add_camera(r, n, node.camera, is_good ? &a : nullptr, has_middle ? middle : nullptr);
		if (light != node.extensions.end())
			add_light(r, n, value_int(light->second, "light", -1), is_good ? &a : nullptr);
	}
}

} // namespace gltf
