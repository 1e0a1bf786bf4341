#include <set>
#include <nlohmann/json.hpp>
#include "gltf.h"

using nlohmann::json;

namespace gltf {

namespace {

const std::set<std::string> known = {
	"EXT_texture_webp",
	"KHR_draco_mesh_compression",
	"KHR_lights_punctual",
	"KHR_materials_emissive_strength",
	"KHR_materials_pbrSpecularGlossiness",
	"KHR_materials_unlit",
	"KHR_mesh_quantization",
	"KHR_texture_transform",
};

/* Unless required, these do not change the picture. */
const std::set<std::string> harmless = {
	"EXT_meshopt_compression", "KHR_animation_pointer", "KHR_materials_variants", "KHR_meshopt_compression",
	"KHR_texture_basisu",      "KHR_xmp",               "KHR_xmp_json_ld",        "MSFT_lod",
	"MSFT_texture_dds",
};

} // namespace

bool extension_is_known(const std::string &name)
{
	return known.count(name) != 0;
}

void extensions_check(source &s, json &doc)
{
	if (doc.contains("extensionsRequired"))
		for (const json &e : doc["extensionsRequired"])
			if (!e.is_string() || !extension_is_known(e.get<std::string>()))
				refuse(PSR_ERR_UNSUPPORTED, "requires the extension %s, which is not supported",
				       e.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
	if (doc.contains("extensionsUsed") && doc["extensionsUsed"].is_array())
		for (const json &e : doc["extensionsUsed"])
			if (e.is_string() && !extension_is_known(e.get<std::string>()) && harmless.count(e.get<std::string>()) == 0)
				s.ignored.push_back(e.get<std::string>());
	doc.erase("extensionsRequired");
	doc.erase("extensionsUsed");
}

} // namespace gltf
