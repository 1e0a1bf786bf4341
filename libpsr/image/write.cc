// The image module's writers: all formats that OpenImageIO writes. base/image_module.h has the contract.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "fail.h"
#include "module.h"

namespace {

int check(const std::string &ending, bool is_depth, char *message, unsigned size)
{
	std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create("x." + ending);
	if (!out)
		return fail(message, size, "OpenImageIO cannot write files with the ending ." + ending);
	if (is_depth) {
		static const char *const formats[] = { "openexr", "tiff", "zfile", "null" };
		for (const char *name : formats)
			if (name == std::string(out->format_name()))
				return 0;
		return fail(message, size, std::string("the format ") + out->format_name()
		            + " cannot hold floats, which depth needs; use .pfm, .exr or .tif");
	}
	return 0;
}

bool is_linear(const OIIO::ImageOutput &out)
{
	const std::string name = out.format_name();
	return name == "openexr" || name == "hdr";
}

std::vector<float> linearize(const std::uint8_t *codes, std::size_t n)
{
	std::vector<float> linear(n);
	float table[256];
	for (int i = 0; i < 256; i++)
		table[i] = static_cast<float>(i <= 10 ? i / 255.0 / 12.92 : std::pow((i / 255.0 + 0.055) / 1.055, 2.4));
	for (std::size_t i = 0; i < n; i++)
		linear[i] = table[codes[i]];
	return linear;
}

// Some codecs (libjpeg) end the process when the disk is full: write to memory first where the codec can.
bool wants_memory(const OIIO::ImageOutput &out)
{
	const std::string name = out.format_name();
	return name != "openexr" && name != "tiff" && out.supports("ioproxy");
}

int write_bytes(const char *path, const std::vector<unsigned char> &bytes, char *message, unsigned size)
{
	std::FILE *file = std::fopen(path, "wb");
	int reason = file == nullptr ? errno : 0;
	if (file != nullptr && std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size())
		reason = errno;
	if (file != nullptr && std::fclose(file) != 0 && reason == 0)
		reason = errno;
	return reason == 0 ? 0 : fail(message, size, std::strerror(reason));
}

int write(const char *path, const image_module_picture &picture, char *message, unsigned size)
{
	const bool is_depth = picture.is_depth != 0;
	const void *pixels = picture.pixels;
	std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(path);
	std::vector<float> linear;
	OIIO::TypeDesc type = OIIO::TypeDesc::UINT8;

	if (!out)
		return fail(message, size, OIIO::geterror());
	if (is_depth || is_linear(*out))
		type = OIIO::TypeDesc::FLOAT;
	OIIO::ImageSpec spec(static_cast<int>(picture.width), static_cast<int>(picture.height), is_depth ? 1 : 3, type);
	if (is_depth) {
		spec.channelnames.assign(1, "Z");
		spec.z_channel = 0;
	} else {
		spec.attribute("oiio:ColorSpace", is_linear(*out) ? "Linear" : "sRGB");
		if (is_linear(*out)) {
			linear = linearize(static_cast<const std::uint8_t *>(pixels),
			                   std::size_t(picture.width) * picture.height * 3);
			pixels = linear.data();
		}
	}
	OIIO::Filesystem::IOVecOutput memory;
	const bool in_memory = wants_memory(*out);
	if (in_memory && !out->set_ioproxy(&memory))
		return fail(message, size, out->geterror());
	if (!out->open(path, spec))
		return fail(message, size, out->geterror());
	if (!out->write_image(type, pixels) || !out->close())
		return fail(message, size, out->geterror());
	return in_memory ? write_bytes(path, memory.buffer(), message, size) : 0;
}

}

extern "C" int image_check(const char *ending, int is_depth, char *message, unsigned size)
{
	return guard(message, size, [&] { return check(ending, is_depth != 0, message, size); });
}

extern "C" int image_write(const char *path, const image_module_picture *picture, char *message, unsigned size)
{
	return guard(message, size, [&] { return write(path, *picture, message, size); });
}
