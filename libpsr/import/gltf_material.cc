#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include "gltf.h"

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
	if (index < 0 || (size_t)index >= r.model.textures.size())
		refuse(PSR_ERR_FORMAT, "%s: texture %d does not exist, there are %zu", place.c_str(), index,
		       r.model.textures.size());
	return r.model.textures[(size_t)index];
}

int image_of_texture(const reader &r, int texture, const std::string &place)
{
	const tinygltf::Texture &t = texture_at(r, texture, place);
	auto webp = t.extensions.find("EXT_texture_webp");
	int image = webp != t.extensions.end() ? value_int(webp->second, "source", t.source) : t.source;

	if (image < 0)
		refuse(PSR_ERR_UNSUPPORTED, "textures[%d] has no image in a supported format", texture);
	if ((size_t)image >= r.src.images.size())
		refuse(PSR_ERR_FORMAT, "textures[%d]: image %d does not exist, there are %zu", texture, image,
		       r.src.images.size());
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
		i.owned = door_read_uri(r.src, source.uri, i.name);
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

/* psr has one roughness and one metallic value a material, so a texture of them counts with its mean. */
void apply_roughness_texture(reader &r, int texture, struct psr_material &m, const std::string &place)
{
	int image = image_of_texture(r, texture, place);
	image_bytes i = read_image(r, image);
	struct psr_image pixels = {};
	struct psr_error error = {};
	uint64_t green = 0, blue = 0, n;

	if (import_image_decode(&pixels, i.bytes.bytes, (size_t)i.bytes.n, i.name.c_str(),
	                        IMPORT_MAX_PIXELS - r.im.n_pixels, &error) != PSR_OK)
		refuse(error.code, "%s", error.text);
	n = (uint64_t)pixels.width * pixels.height;
	for (uint64_t k = 0; k < n; k++) {
		green += pixels.rgba[4 * k + 1];
		blue += pixels.rgba[4 * k + 2];
	}
	std::free(pixels.rgba);
	m.roughness *= (float)((double)green / (255.0 * (double)n));
	m.metallic *= (float)((double)blue / (255.0 * (double)n));
	import_mesh_warn(&r.im, "metallic-roughness textures count with their mean");
}

void use_texture(texture_use &use, int set, const tinygltf::ExtensionMap &extensions)
{
	auto it = extensions.find("KHR_texture_transform");

	use.uv_name = "TEXCOORD_" + std::to_string(set);
	if (it == extensions.end() || !it->second.IsObject())
		return;

	const tinygltf::Value &t = it->second;
	double offset[2] = { 0, 0 }, scale[2] = { 1, 1 }, angle = value_number(t, "rotation", 0.0);

	set = value_int(t, "texCoord", set);
	use.uv_name = "TEXCOORD_" + std::to_string(set);
	for (int c = 0; c < 2; c++) {
		if (t.Has("offset") && t.Get("offset").IsArray() && t.Get("offset").Get(c).IsNumber())
			offset[c] = t.Get("offset").Get(c).GetNumberAsDouble();
		if (t.Has("scale") && t.Get("scale").IsArray() && t.Get("scale").Get(c).IsNumber())
			scale[c] = t.Get("scale").Get(c).GetNumberAsDouble();
	}

	double cosine = std::cos(angle), sine = std::sin(angle);
	const double m[6] = { cosine * scale[0], sine * scale[1],   offset[0],
		              -sine * scale[0],  cosine * scale[1], offset[1] };

	std::memcpy(use.m, m, sizeof m);
}

void set_texture(reader &r, struct psr_material &m, int texture, const std::string &place)
{
	int sampler = texture_at(r, texture, place).sampler;

	m.base_texture.image = psr_image_of(r, image_of_texture(r, texture, place));
	if (sampler >= 0 && (size_t)sampler < r.model.samplers.size()) {
		m.base_texture.wrap_s = wrap_of(r.model.samplers[(size_t)sampler].wrapS);
		m.base_texture.wrap_t = wrap_of(r.model.samplers[(size_t)sampler].wrapT);
	}
}

bool emits(const tinygltf::Material &m)
{
	const auto &e = m.emissiveFactor;

	return e.size() == 3 && (e[0] > 0.0 || e[1] > 0.0 || e[2] > 0.0);
}

/* A black surface that shines, as labels do: drawn unlit, in the colour that it emits. */
bool only_emits(const tinygltf::Material &m)
{
	const auto &pbr = m.pbrMetallicRoughness;
	const auto &base = pbr.baseColorFactor;

	return emits(m) && pbr.baseColorTexture.index < 0 && base.size() == 4 && base[0] == 0.0 && base[1] == 0.0 &&
	       base[2] == 0.0 && m.extensions.count("KHR_materials_pbrSpecularGlossiness") == 0;
}

/* The texture that gives the base color: of metallic-roughness, the diffuse one of specular-glossiness, or the
 * emissive one of what only emits. */
tinygltf::TextureInfo base_texture(const tinygltf::Material &m)
{
	auto it = m.extensions.find("KHR_materials_pbrSpecularGlossiness");
	tinygltf::TextureInfo info;

	if (only_emits(m))
		return m.emissiveTexture;
	if (it == m.extensions.end() || !it->second.IsObject())
		return m.pbrMetallicRoughness.baseColorTexture;
	if (!it->second.Has("diffuseTexture"))
		return info;

	const tinygltf::Value &t = it->second.Get("diffuseTexture");

	info.index = value_int(t, "index", -1);
	info.texCoord = value_int(t, "texCoord", 0);
	if (t.Has("extensions") && t.Get("extensions").IsObject())
		info.extensions = t.Get("extensions").Get<tinygltf::Value::Object>();
	return info;
}

void set_specular_glossiness(struct psr_material &m, const tinygltf::Value &v)
{
	for (int c = 0; c < 4; c++) {
		m.base_color[c] = 1.0f;
		if (v.Has("diffuseFactor") && v.Get("diffuseFactor").IsArray() && v.Get("diffuseFactor").Get(c).IsNumber())
			m.base_color[c] = (float)v.Get("diffuseFactor").Get(c).GetNumberAsDouble();
	}
	m.metallic = 0.0f;
	m.roughness = 1.0f - (float)value_number(v, "glossinessFactor", 1.0);
}

struct psr_material plain_material()
{
	struct psr_material m;

	psr_material_default(&m);
	return m;
}

struct psr_material convert(reader &r, const tinygltf::Material &g, const std::string &place)
{
	struct psr_material m = plain_material();
	auto glossiness = g.extensions.find("KHR_materials_pbrSpecularGlossiness");
	const auto &pbr = g.pbrMetallicRoughness;

	if (glossiness != g.extensions.end() && glossiness->second.IsObject()) {
		set_specular_glossiness(m, glossiness->second);
	} else {
		for (size_t c = 0; c < 4 && c < pbr.baseColorFactor.size(); c++)
			m.base_color[c] = (float)pbr.baseColorFactor[c];
		m.metallic = (float)pbr.metallicFactor;
		m.roughness = (float)pbr.roughnessFactor;
		if (pbr.metallicRoughnessTexture.index >= 0)
			apply_roughness_texture(r, pbr.metallicRoughnessTexture.index, m, place);
	}
	if (base_texture(g).index >= 0)
		set_texture(r, m, base_texture(g).index, place);
	m.alpha = g.alphaMode == "MASK" ? PSR_ALPHA_MASK : g.alphaMode == "BLEND" ? PSR_ALPHA_BLEND : PSR_ALPHA_OPAQUE;
	m.alpha_cutoff = (float)g.alphaCutoff;
	m.two_sided = g.doubleSided;
	m.unlit = g.extensions.count("KHR_materials_unlit") != 0;
	if (g.normalTexture.index >= 0)
		import_mesh_warn(&r.im, "normal maps are not used");
	if (only_emits(g)) {
		m.unlit = 1;
		for (size_t c = 0; c < 3; c++)
			m.base_color[c] = (float)g.emissiveFactor[c];
	} else if (emits(g)) {
		import_mesh_warn(&r.im, "emission is used only where nothing else colours a material");
	}
	return m;
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

int material_index(reader &r, int material, texture_use &use)
{
	const size_t n = r.model.materials.size();
	const std::string place = "materials[" + std::to_string(material) + "]";
	struct psr_error error = {};

	if (material >= 0 && (size_t)material >= n)
		refuse(PSR_ERR_FORMAT, "material %d does not exist, there are %zu", material, n);

	int &made = r.material_of[material < 0 ? n : (size_t)material];

	if (made < 0) {
		/* Nothing is said about a primitive without a material. glTF's default is a rough metal, which has no diffuse
		 * color to show without surroundings to mirror, so it is matt and white here. */
		struct psr_material m = material < 0 ? plain_material() : convert(r, r.model.materials[(size_t)material],
		                                                                  place);

		made = import_mesh_add_material(&r.im, &m, &error);
		if (made < 0)
			refuse(error.code, "%s", error.text);
	}
	if (material >= 0) {
		tinygltf::TextureInfo info = base_texture(r.model.materials[(size_t)material]);

		if (info.index >= 0)
			use_texture(use, info.texCoord, info.extensions);
	}
	return made;
}

} // namespace gltf
