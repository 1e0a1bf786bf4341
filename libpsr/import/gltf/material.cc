#include <cmath>
#include "gltf.h"

extern "C" {
#include "base/maths.h"
}

namespace gltf {

namespace {

enum psr_wrap wrap_of(int wrap)
{
	return wrap == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? PSR_WRAP_CLAMP
	       : wrap == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? PSR_WRAP_MIRROR
	                                                       : PSR_WRAP_REPEAT;
}

const tinygltf::Texture &texture_at(const reader &r, int index, const std::string &place)
{
	check_index(index, r.model.textures.size(), "texture", place);
	return r.model.textures[(size_t)index];
}

int image_of_texture(const reader &r, int texture, const std::string &place)
{
	const tinygltf::Texture &t = texture_at(r, texture, place);
	auto webp = t.extensions.find("EXT_texture_webp");
	int image = webp != t.extensions.end() ? value_int(webp->second, "source", t.source) : t.source;
	if (image < 0)
		refuse(PSR_ERR_UNSUPPORTED, "textures[%d] has no image in a supported format", texture);
	check_index(image, r.src.images.size(), "image", "textures[" + std::to_string(texture) + "]");
	return image;
}

struct image_bytes {
	std::vector<uint8_t> owned;
	span bytes;
	std::string name;
};

image_bytes read_image(const reader &r, int image)
{
	const image_source &source = r.src.images[(size_t)image];
	image_bytes i;
	i.name = "images[" + std::to_string(image) + "]";
	if (source.uri.empty()) {
		i.bytes = view_bytes(r, source.buffer_view, i.name);
	} else {
		i.owned = read_uri(r.src, source.uri, i.name);
		i.bytes = { i.owned.data(), i.owned.size() };
		if (source.uri.compare(0, 5, "data:") != 0)
			i.name += " (" + source.uri + ")";
	}
	return i;
}

int psr_image_of(reader &r, int image)
{
	struct psr_error error = {};
	if (r.image_of[(size_t)image] >= 0)
		return r.image_of[(size_t)image];

	image_bytes i = read_image(r, image);
	int index = import_mesh_add_image(&r.im, i.bytes.bytes, (size_t)i.bytes.n, i.name.c_str(), &error);

	if (index < 0)
		refuse(error.code, "%s", error.text);
	r.image_of[(size_t)image] = index;
	return index;
}

/* A reference to a texture, from tinygltf's several kinds, or a member of an extension. */
struct texture_info {
	int index = -1;
	int tex_coord = 0;
	const tinygltf::Value *transform = nullptr; /* KHR_texture_transform */
	std::string place;
};

template<class info> texture_info info_of(const info &t, const std::string &place)
{
	texture_info out;
	auto it = t.extensions.find("KHR_texture_transform");
	out.index = t.index;
	out.tex_coord = t.texCoord;
	out.transform = it != t.extensions.end() ? &it->second : nullptr;
	out.place = place;
	return out;
}

texture_info info_of(const tinygltf::Value &extension, const char *key, const std::string &place)
{
	texture_info out;
	if (!extension.Has(key))
		return out;

	const tinygltf::Value &t = extension.Get(key);

	out.index = value_int(t, "index", -1);
	out.tex_coord = value_int(t, "texCoord", 0);
	out.place = place + "." + key;
	if (t.Has("extensions") && t.Get("extensions").Has("KHR_texture_transform"))
		out.transform = &t.Get("extensions").Get("KHR_texture_transform");
	return out;
}

/* Reads the numbers of an array member; keeps the others. */
void value_numbers(const tinygltf::Value &v, const char *key, double *out, int n)
{
	if (!v.IsObject() || !v.Has(key) || !v.Get(key).IsArray())
		return;
	for (int i = 0; i < n; i++)
		if (v.Get(key).Get(i).IsNumber())
			out[i] = v.Get(key).Get(i).GetNumberAsDouble();
}

/* Takes any angle; gives the same bits on every machine. */
void sine_and_cosine(double angle, double &s, double &c)
{
	double turn = std::isfinite(angle) ? std::fmod(angle, 2.0 * M_PI) : 0.0;
	if (turn < 0.0)
		turn += 2.0 * M_PI;
	psr_sincos(turn > M_PI ? 2.0 * M_PI - turn : turn, &s, &c);
	s = turn > M_PI ? -s : s;
}

void set_transform(struct psr_texture &out, const tinygltf::Value &t)
{
	double offset[2] = { 0, 0 }, scale[2] = { 1, 1 }, s, c;
	value_numbers(t, "offset", offset, 2);
	value_numbers(t, "scale", scale, 2);
	sine_and_cosine(value_number(t, "rotation", 0.0), s, c);

	const double m[6] = { c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1] };

	for (int i = 0; i < 6; i++)
		out.transform[i] = (float)m[i];
}

/* Returns the mesh's set for TEXCOORD_n: n if possible, else another free one; -1: none is free. */
int take_set(material_use &use, int n)
{
	const std::string name = "TEXCOORD_" + std::to_string(n);
	for (int set = 0; set < PSR_UV_SETS; set++)
		if (use.uv_name[set] == name)
			return set;
	for (int k = 0; k < PSR_UV_SETS; k++) {
		int set = n < PSR_UV_SETS ? (n + k) % PSR_UV_SETS : k;
		if (use.uv_name[set].empty()) {
			use.uv_name[set] = name;
			return set;
		}
	}
	return -1;
}

/* Called for the base color first, which so gets its own set. */
void set_texture(reader &r, struct psr_texture &out, material_use &use, const texture_info &info)
{
	if (info.index < 0)
		return;

	const tinygltf::Texture &texture = texture_at(r, info.index, info.place);
	const int tex_coord = info.transform != nullptr ? value_int(*info.transform, "texCoord", info.tex_coord) :
	                                                  info.tex_coord;
	const int set = take_set(use, tex_coord);

	if (set < 0) {
		import_mesh_warn(&r.im, "%s was left out: its material uses more than %d sets of coordinates",
		                 info.place.c_str(), PSR_UV_SETS);
		return;
	}
	out.image = psr_image_of(r, image_of_texture(r, info.index, info.place));
	out.uv_set = set;
	if (info.transform != nullptr)
		set_transform(out, *info.transform);
	if (texture.sampler >= 0) {
		check_index(texture.sampler, r.model.samplers.size(), "sampler",
		            "textures[" + std::to_string(info.index) + "]");
		const tinygltf::Sampler &sampler = r.model.samplers[(size_t)texture.sampler];
		out.wrap_s = wrap_of(sampler.wrapS);
		out.wrap_t = wrap_of(sampler.wrapT);
		out.is_nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
	}
}

void set_specular_glossiness(reader &r, struct psr_material &m, material_use &use, const tinygltf::Value &v,
                             const std::string &place)
{
	double diffuse[4] = { 1, 1, 1, 1 }, specular[3] = { 1, 1, 1 };
	value_numbers(v, "diffuseFactor", diffuse, 4);
	value_numbers(v, "specularFactor", specular, 3);
	for (int c = 0; c < 4; c++)
		m.base_color[c] = (float)diffuse[c];
	for (int c = 0; c < 3; c++)
		m.specular[c] = (float)specular[c];
	m.glossiness = (float)value_number(v, "glossinessFactor", 1.0);
	m.is_specular_glossiness = 1;
	m.metallic = 0.0f;
	m.roughness = 1.0f - m.glossiness;
	set_texture(r, m.base_texture, use, info_of(v, "diffuseTexture", place));
	if (!m.unlit)
		set_texture(r, m.specular_texture, use, info_of(v, "specularGlossinessTexture", place));
}

void set_metallic_roughness(reader &r, struct psr_material &m, material_use &use,
                            const tinygltf::PbrMetallicRoughness &pbr, const std::string &place)
{
	for (size_t c = 0; c < 4 && c < pbr.baseColorFactor.size(); c++)
		m.base_color[c] = (float)pbr.baseColorFactor[c];
	m.metallic = (float)pbr.metallicFactor;
	m.roughness = (float)pbr.roughnessFactor;
	set_texture(r, m.base_texture, use, info_of(pbr.baseColorTexture, place + ".baseColorTexture"));
	if (!m.unlit && (m.metallic > 0.0f || m.roughness > 0.0f))
		set_texture(r, m.metallic_roughness_texture, use,
		            info_of(pbr.metallicRoughnessTexture, place + ".metallicRoughnessTexture"));
}

/* Skips textures whose factor is 0. */
void set_relief_and_light(reader &r, struct psr_material &m, material_use &use, const tinygltf::Material &g,
                          const std::string &place)
{
	auto strength = g.extensions.find("KHR_materials_emissive_strength");
	const double factor =
		strength != g.extensions.end() ? value_number(strength->second, "emissiveStrength", 1.0) : 1.0;
	m.normal_scale = (float)g.normalTexture.scale;
	if (m.normal_scale != 0.0f)
		set_texture(r, m.normal_texture, use, info_of(g.normalTexture, place + ".normalTexture"));
	use.has_normal_map = m.normal_texture.image >= 0;
	m.occlusion_strength = (float)g.occlusionTexture.strength;
	if (m.occlusion_strength > 0.0f)
		set_texture(r, m.occlusion_texture, use, info_of(g.occlusionTexture, place + ".occlusionTexture"));
	for (size_t c = 0; c < 3 && c < g.emissiveFactor.size(); c++)
		m.emissive[c] = (float)(g.emissiveFactor[c] * factor);
	if (m.emissive[0] > 0.0f || m.emissive[1] > 0.0f || m.emissive[2] > 0.0f)
		set_texture(r, m.emissive_texture, use, info_of(g.emissiveTexture, place + ".emissiveTexture"));
}

struct psr_material convert(reader &r, material_use &use, const tinygltf::Material &g, const std::string &place)
{
	auto glossiness = g.extensions.find("KHR_materials_pbrSpecularGlossiness");
	struct psr_material m;
	psr_material_default(&m);
	m.unlit = g.extensions.count("KHR_materials_unlit") != 0;
	m.alpha = g.alphaMode == "MASK" ? PSR_ALPHA_MASK : g.alphaMode == "BLEND" ? PSR_ALPHA_BLEND : PSR_ALPHA_OPAQUE;
	m.alpha_cutoff = (float)g.alphaCutoff;
	m.two_sided = g.doubleSided;
	if (glossiness != g.extensions.end() && glossiness->second.IsObject())
		set_specular_glossiness(r, m, use, glossiness->second, place);
	else
		set_metallic_roughness(r, m, use, g.pbrMetallicRoughness, place);
	if (!m.unlit)
		set_relief_and_light(r, m, use, g, place);
	return m;
}

int add_material(reader &r, const struct psr_material &m)
{
	struct psr_error error = {};
	int index = import_mesh_add_material(&r.im, &m, &error);
	if (index < 0)
		refuse(error.code, "%s", error.text);
	return index;
}

/* Makes the variant of a material for points, which have no texture coordinates. */
int add_textureless(reader &r, const material_use &use)
{
	struct psr_material m = r.im.mesh->material[use.index];
	bool has_texture = false;
	for (struct psr_texture *t : { &m.base_texture, &m.metallic_roughness_texture, &m.emissive_texture,
	                               &m.occlusion_texture, &m.normal_texture, &m.specular_texture }) {
		has_texture |= t->image >= 0;
		t->image = -1;
	}
	if (!has_texture)
		return use.index;
	import_mesh_warn(&r.im, "textures of points were left out");
	return add_material(r, m);
}

} // namespace

double value_number(const tinygltf::Value &v, const char *key, double fallback)
{
	return v.IsObject() && v.Has(key) && v.Get(key).IsNumber() ? v.Get(key).GetNumberAsDouble() : fallback;
}

int value_int(const tinygltf::Value &v, const char *key, int fallback)
{
	return v.IsObject() && v.Has(key) && v.Get(key).IsInt() ? v.Get(key).GetNumberAsInt() : fallback;
}

const material_use &use_material(reader &r, int material, bool for_points)
{
	const size_t n = r.model.materials.size();
	if (material >= 0)
		check_index(material, n, "material", "");

	material_use &use = r.materials[material < 0 ? n : (size_t)material];

	if (use.index < 0) {
		struct psr_material m;
		/* Without a material, matt and white. glTF's default, a rough metal, has no diffuse color: without an
		 * environment to reflect it would be black. */
		psr_material_default(&m);
		if (material >= 0)
			m = convert(r, use, r.model.materials[(size_t)material], "materials[" + std::to_string(material) + "]");
		use.index = add_material(r, m);
	}
	if (for_points && use.point_index < 0)
		use.point_index = add_textureless(r, use);
	return use;
}

} // namespace gltf
