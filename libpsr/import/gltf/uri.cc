#include <cstdlib>
#include <memory>
#include "base/infile.h"
#include "gltf.h"

namespace gltf {

namespace {

int base64_value(char c)
{
	return c >= 'A' && c <= 'Z'               ? c - 'A'
	       : c >= 'a' && c <= 'z'             ? c - 'a' + 26
	       : c >= '0' && c <= '9'             ? c - '0' + 52
	       : c == '+' || c == '-'             ? 62
	       : c == '/' || c == '_'             ? 63
	                                          : -1;
}

std::vector<uint8_t> base64_decode(const std::string &uri, size_t at, const std::string &place)
{
	std::vector<uint8_t> out;
	uint32_t word = 0;
	int n_bits = 0;
	out.reserve((uri.size() - at) / 4 * 3 + 3);
	for (; at < uri.size() && uri[at] != '='; at++) {
		int value = base64_value(uri[at]);
		if (value < 0)
			refuse(PSR_ERR_FORMAT, "%s: byte %zu of its data uri is not base64", place.c_str(), at);
		word = word << 6 | (uint32_t)value;
		n_bits += 6;
		if (n_bits >= 8) {
			n_bits -= 8;
			out.push_back((uint8_t)(word >> n_bits));
		}
	}
	return out;
}

int hex_value(char c)
{
	return c >= '0' && c <= '9'   ? c - '0'
	       : c >= 'a' && c <= 'f' ? c - 'a' + 10
	       : c >= 'A' && c <= 'F' ? c - 'A' + 10
	                              : -1;
}

std::string percent_decode(const std::string &uri)
{
	std::string out;
	for (size_t i = 0; i < uri.size(); i++) {
		if (uri[i] == '%' && i + 2 < uri.size() && hex_value(uri[i + 1]) >= 0 && hex_value(uri[i + 2]) >= 0) {
			out += (char)(hex_value(uri[i + 1]) * 16 + hex_value(uri[i + 2]));
			i += 2;
		} else {
			out += uri[i];
		}
	}
	return out;
}

} // namespace

std::vector<uint8_t> read_uri(const source &s, const std::string &uri, const std::string &place)
{
	if (uri.compare(0, 5, "data:") == 0) {
		size_t comma = uri.find(',');
		if (comma == std::string::npos || comma < 12 || uri.compare(comma - 7, 7, ";base64") != 0)
			refuse(PSR_ERR_UNSUPPORTED, "%s: its data uri is not base64", place.c_str());
		return base64_decode(uri, comma + 1, place);
	}

	std::string name = percent_decode(uri);
	struct psr_error error = {};
	char *path = nullptr;
	uint8_t *bytes = nullptr;
	size_t n_bytes = 0;

	if (name.find('\0') != std::string::npos)
		refuse(PSR_ERR_FORMAT, "%s: its file name has a zero byte", place.c_str());
	if (uri.find("://") != std::string::npos)
		refuse(PSR_ERR_UNSUPPORTED, "%s is at \"%.200s\"; only files are read", place.c_str(), uri.c_str());
	if (import_path_inside(&path, s.folder.c_str(), name.c_str(), &error) != PSR_OK)
		refuse(error.code, "%s %s", place.c_str(), error.text);

	std::unique_ptr<char, decltype(&std::free)> path_guard(path, &std::free);

	if (infile_read(&bytes, &n_bytes, path, IMPORT_MAX_FILE, &error) != PSR_OK)
		refuse(error.code, "%s: %s", place.c_str(), error.text);

	std::unique_ptr<uint8_t, decltype(&std::free)> bytes_guard(bytes, &std::free);

	return std::vector<uint8_t>(bytes, bytes + n_bytes);
}

} // namespace gltf
