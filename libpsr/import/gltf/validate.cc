#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <set>
#include <nlohmann/json.hpp>
#include "gltf.h"

using nlohmann::json;

namespace gltf {

namespace {

const size_t max_json = (size_t)512 << 20;
const int max_depth = 64;

/* Keys of indices and counts, or arrays of them; tinygltf would truncate larger numbers to 32 bits. */
const std::set<std::string> integer_keys = {
	"buffer", "bufferView", "byteStride", "count", "componentType", "indices", "material", "mode", "mesh", "skin",
	"scene", "source", "sampler", "index", "texCoord", "children", "nodes", "wrapS", "wrapT", "magFilter", "minFilter",
	"joints", "inverseBindMatrices", "camera", "light",
};

span text_of(const uint8_t *bytes, size_t n, span &bin)
{
	bin = { nullptr, 0 };
	if (n < 4 || std::memcmp(bytes, "glTF", 4) != 0)
		return { bytes, n };
	if (n < 20)
		refuse(PSR_ERR_FORMAT, "truncated: a GLB header has 20 bytes, the file has %zu", n);
	if (load_u32(bytes + 4) == 1)
		refuse(PSR_ERR_UNSUPPORTED, "binary glTF 1; convert it to glTF 2.0");
	if (load_u32(bytes + 4) != 2)
		refuse(PSR_ERR_UNSUPPORTED, "GLB version %u is not supported; 2 is", load_u32(bytes + 4));

	uint64_t length = load_u32(bytes + 8), json_length = load_u32(bytes + 12), at = 20 + json_length;

	if (length > n)
		refuse(PSR_ERR_FORMAT, "truncated: the GLB header promises %llu bytes, the file has %zu",
		       (unsigned long long)length, n);
	if (load_u32(bytes + 16) != 0x4e4f534a)
		refuse(PSR_ERR_FORMAT, "the first chunk of the GLB is not JSON");
	if (at > length)
		refuse(PSR_ERR_FORMAT, "the JSON chunk ends at byte %llu, behind the end of the GLB", (unsigned long long)at);
	if (at == length)
		return { bytes + 20, json_length };
	if (at + 8 > length)
		refuse(PSR_ERR_FORMAT, "the header of the chunk at byte %llu is truncated", (unsigned long long)at);
	if (load_u32(bytes + at + 4) == 0x004e4942) {
		bin = { bytes + at + 8, load_u32(bytes + at) };
		if (bin.n > length - at - 8)
			refuse(PSR_ERR_FORMAT, "the BIN chunk of %llu bytes reaches behind the end of the GLB",
			       (unsigned long long)bin.n);
	}
	return { bytes + 20, json_length };
}

/* tinygltf and nlohmann recurse into values: bounds the depth before they do. */
void check_depth(span text)
{
	int depth = 0;
	bool in_string = false;
	for (uint64_t i = 0; i < text.n; i++) {
		char c = (char)text.bytes[i];
		if (in_string) {
			if (c == '\\')
				i++;
			else if (c == '"')
				in_string = false;
		} else if (c == '"') {
			in_string = true;
		} else if (c == '{' || c == '[') {
			if (++depth > max_depth)
				refuse(PSR_ERR_LIMIT, "JSON nested deeper than %d at byte %llu", max_depth, (unsigned long long)i);
		} else if (c == '}' || c == ']') {
			depth--;
		}
	}
}

void tidy_integer(json &v, const std::string &place, uint64_t max)
{
	if (v.is_number_float()) {
		double x = v.get<double>();
		if (x == std::floor(x) && x >= 0.0 && x <= (double)max)
			v = (uint64_t)x;
	}
	if (!v.is_number_unsigned() || v.get<uint64_t>() > max)
		refuse(PSR_ERR_FORMAT, "%s is not an integer from 0 to %llu", place.c_str(), (unsigned long long)max);
}

/* An object whose members are indices. */
void tidy_members(json &v, const std::string &place)
{
	if (!v.is_object())
		refuse(PSR_ERR_FORMAT, "%s is not an object", place.c_str());
	for (auto it = v.begin(); it != v.end(); ++it)
		tidy_integer(it.value(), place + "." + it.key(), INT32_MAX);
}

void tidy(json &v, const std::string &place, bool integers)
{
	if (v.is_object()) {
		v.erase("extras");
		if (v.contains("extensions")) {
			json &e = v["extensions"];
			if (!e.is_object())
				refuse(PSR_ERR_FORMAT, "%s.extensions is not an object", place.c_str());
			for (auto it = e.begin(); it != e.end();)
				it = extension_is_known(it.key()) ? std::next(it) : e.erase(it);
		}
		for (auto it = v.begin(); it != v.end(); ++it) {
			const std::string &key = it.key(), where = place.empty() ? key : place + "." + key;
			if (key == "byteOffset" || key == "byteLength")
				tidy_integer(it.value(), where, UINT64_C(1) << 53);
			else
				tidy(it.value(), where, integer_keys.count(key) != 0);
			if (key == "attributes" && it.value().is_object())
				tidy_members(it.value(), where);
			if (key == "targets" && it.value().is_array())
				for (size_t i = 0; i < it.value().size(); i++)
					tidy_members(it.value()[i], where + "[" + std::to_string(i) + "]");
		}
	} else if (v.is_array()) {
		for (size_t i = 0; i < v.size(); i++)
			tidy(v[i], place + "[" + std::to_string(i) + "]", integers);
	} else if (integers) {
		tidy_integer(v, place, INT32_MAX);
	} else if (v.is_number_integer() && (v > INT32_MAX || v < INT32_MIN)) {
		v = v.get<double>();
	}
}

void check_head(const json &doc)
{
	if (!doc.is_object() || !doc.contains("asset") || !doc["asset"].is_object())
		refuse(PSR_ERR_FORMAT, "not glTF: the JSON has no \"asset\"");

	const json &v = doc["asset"].value("version", json(""));
	std::string version = v.is_string() ? v.get<std::string>() : v.dump();

	if (version.compare(0, 2, "1.") == 0 || version == "1")
		refuse(PSR_ERR_UNSUPPORTED, "glTF %s; convert it to glTF 2.0", version.c_str());
	if (version.compare(0, 2, "2.") != 0)
		refuse(PSR_ERR_UNSUPPORTED, "glTF version \"%s\" is not supported; 2.0 is", version.c_str());
}

void read_buffers(source &s, json &doc, span bin)
{
	json &list = array_of(doc, "buffers");
	uint64_t total = 0;
	for (size_t i = 0; i < list.size(); i++) {
		std::string place = "buffers[" + std::to_string(i) + "]", uri = list[i].value("uri", "");
		if (!list[i].contains("byteLength"))
			refuse(PSR_ERR_FORMAT, "%s has no byteLength", place.c_str());

		uint64_t length = list[i]["byteLength"].get<uint64_t>();
		std::vector<uint8_t> data;

		if (!uri.empty())
			data = read_uri(s, uri, place);
		else if (i == 0 && bin.bytes != nullptr)
			data.assign(bin.bytes, bin.bytes + bin.n);
		else
			refuse(PSR_ERR_FORMAT, "%s has neither a uri nor a BIN chunk", place.c_str());
		if (data.size() < length)
			refuse(PSR_ERR_FORMAT, "%s promises %llu bytes, but there are %zu", place.c_str(),
			       (unsigned long long)length, data.size());
		if (data.size() > length) {
			data.resize(length);
			data.shrink_to_fit();
		}
		total += length;
		if (total > IMPORT_MAX_FILE)
			refuse(PSR_ERR_LIMIT, "the buffers together have more than %llu bytes", IMPORT_MAX_FILE);
		s.buffers.push_back(std::move(data));
	}
}

void list_images(source &s, json &doc)
{
	for (json &i : array_of(doc, "images")) {
		image_source image;
		image.uri = i.value("uri", "");
		image.buffer_view = i.value("bufferView", -1);
		s.images.push_back(image);
	}
}

/* tinygltf silently drops primitives whose attributes are not an object, and refuses Draco indices without a buffer
 * view. */
void tidy_primitives(json &doc)
{
	json &meshes = array_of(doc, "meshes");
	for (size_t m = 0; m < meshes.size(); m++) {
		json &primitives = array_of(meshes[m], "primitives");
		for (size_t p = 0; p < primitives.size(); p++) {
			if (!primitives[p].contains("attributes") || !primitives[p]["attributes"].is_object())
				refuse(PSR_ERR_FORMAT, "meshes[%zu].primitives[%zu] has no attributes", m, p);
			if (primitives[p].contains("extensions") &&
			    primitives[p]["extensions"].contains("KHR_draco_mesh_compression"))
				primitives[p].erase("indices");
		}
	}
}

} // namespace

void refuse(int code, const char *format, ...)
{
	char text[PSR_ERROR_TEXT];
	va_list args;
	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	throw failure{ code, text };
}

void check_index(int index, size_t n, const char *kind, const std::string &place)
{
	if (index < 0 || (size_t)index >= n)
		refuse(PSR_ERR_FORMAT, "%s%s%s %d does not exist, there are %zu", place.c_str(), place.empty() ? "" : ": ",
		       kind, index, n);
}

json &array_of(json &doc, const char *key)
{
	json &a = doc[key];
	if (a.is_null())
		a = json::array();
	if (!a.is_array())
		refuse(PSR_ERR_FORMAT, "%s is not an array", key);
	for (size_t i = 0; i < a.size(); i++)
		if (!a[i].is_object())
			refuse(PSR_ERR_FORMAT, "%s[%zu] is not an object", key, i);
	return a;
}

void validate(source &s, const char *path, const uint8_t *bytes, size_t n_bytes)
{
	struct psr_error error = {};
	char *folder = nullptr;
	span bin, text = text_of(bytes, n_bytes, bin);
	if (import_path_folder(&folder, path, &error) != PSR_OK)
		refuse(error.code, "%s", error.text);
	s.folder = folder;
	std::free(folder);
	if (text.n > max_json)
		refuse(PSR_ERR_LIMIT, "%llu bytes of JSON, the limit is %zu; put the data into a .bin or .glb",
		       (unsigned long long)text.n, max_json);
	check_depth(text);
	try {
		json doc = json::parse(text.bytes, text.bytes + text.n);
		check_head(doc);
		extensions_check(s, doc);
		doc.erase("animations");
		tidy(doc, "", false);
		presets_read(s, doc);
		read_buffers(s, doc, bin);
		list_images(s, doc);
		tidy_primitives(doc);
		doc.erase("buffers");
		doc.erase("images");
		s.json = doc.dump();
	} catch (const json::exception &e) {
		refuse(PSR_ERR_FORMAT, "broken JSON: %s", e.what());
	}
}

} // namespace gltf
