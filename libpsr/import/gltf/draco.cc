#include <memory>
#include <draco/compression/decode.h>
#include "gltf.h"

namespace gltf {

namespace {

/* glTF's accessor decides whether values are normalized, not the Draco data. */
float scale_of(const draco::PointAttribute &a, bool normalized)
{
	if (!normalized || a.normalized())
		return 1.0f;
	switch (a.data_type()) {
	case draco::DT_INT8:
		return 1.0f / 127.0f;
	case draco::DT_UINT8:
		return 1.0f / 255.0f;
	case draco::DT_INT16:
		return 1.0f / 32767.0f;
	case draco::DT_UINT16:
		return 1.0f / 65535.0f;
	default:
		return 1.0f;
	}
}

} // namespace

std::vector<float> draco_floats(const reader &r, const draco::Mesh &mesh, const tinygltf::Primitive &p,
                                const std::string &where, size_t n_wanted, bool is_normalized)
{
	const std::string name = where.substr(where.rfind('.') + 1);
	std::vector<float> out;
	int id = value_int(p.extensions.at("KHR_draco_mesh_compression").Get("attributes"), name.c_str(), -1);
	if (id < 0) { /* not compressed: an accessor may have it */
		auto it = p.attributes.find(name);

		return it == p.attributes.end() ? out : accessor_floats(r, it->second, n_wanted, where, is_normalized);
	}

	const draco::PointAttribute *a = mesh.GetAttributeByUniqueId((uint32_t)id);
	auto it = p.attributes.find(name);

	is_normalized |= it != p.attributes.end() && it->second >= 0 && (size_t)it->second < r.model.accessors.size() &&
	                 r.model.accessors[(size_t)it->second].normalized;

	if (a == nullptr)
		refuse(PSR_ERR_FORMAT, "%s: the Draco data have no attribute %d", where.c_str(), id);
	if ((size_t)a->num_components() != n_wanted && !(n_wanted == 4 && a->num_components() == 3))
		refuse(PSR_ERR_FORMAT, "%s: Draco attribute %d has %d components, expected %zu", where.c_str(), id,
		       (int)a->num_components(), n_wanted);

	float scale = scale_of(*a, is_normalized);
	int n_components = a->num_components();

	out.assign((size_t)mesh.num_points() * n_wanted, 1.0f);
	for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
		float value[4] = { 0.0f, 0.0f, 0.0f, 0.0f };
		draco::AttributeValueIndex at = a->mapped_index(i);
		if (at.value() >= a->size() || !a->ConvertValue<float>(at, (int8_t)n_components, value))
			refuse(PSR_ERR_FORMAT, "%s: the Draco data have no value for point %u", where.c_str(), i.value());
		for (int c = 0; c < n_components; c++)
			out[(size_t)i.value() * n_wanted + (size_t)c] = value[c] * scale;
	}
	return out;
}

std::shared_ptr<draco::Mesh> draco_open(const reader &r, const tinygltf::Primitive &p, const std::string &place)
{
	const tinygltf::Value &extension = p.extensions.at("KHR_draco_mesh_compression");
	if (!extension.IsObject() || !extension.Get("attributes").IsObject())
		refuse(PSR_ERR_FORMAT, "%s: KHR_draco_mesh_compression has no attributes", place.c_str());

	span s = view_bytes(r, value_int(extension, "bufferView", -1), place + ".KHR_draco_mesh_compression");
	draco::DecoderBuffer buffer;
	draco::Decoder decoder;

	if (p.mode != TINYGLTF_MODE_TRIANGLES && p.mode != TINYGLTF_MODE_TRIANGLE_STRIP)
		refuse(PSR_ERR_FORMAT, "%s: Draco data are triangles, mode %d is not", place.c_str(), p.mode);
	buffer.Init((const char *)s.bytes, (size_t)s.n);

	auto decoded = decoder.DecodeMeshFromBuffer(&buffer);

	if (!decoded.ok())
		refuse(PSR_ERR_FORMAT, "%s: broken Draco data: %s", place.c_str(), decoded.status().error_msg());

	std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();

	if (mesh->num_points() > IMPORT_MAX_VERTICES || mesh->num_faces() > IMPORT_MAX_TRIANGLES)
		refuse(PSR_ERR_LIMIT, "%s: %u points and %u faces of Draco data are too many", place.c_str(),
		       (unsigned)mesh->num_points(), (unsigned)mesh->num_faces());
	return mesh;
}

std::vector<uint32_t> draco_triangles(const draco::Mesh &mesh)
{
	std::vector<uint32_t> out;
	for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
		for (size_t c = 0; c < 3; c++)
			out.push_back(mesh.face(f)[c].value());
	return out;
}

} // namespace gltf
