// The image module's decoder. base/image_module.h has the contract.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include "import/import.h"
#include "module.h"

extern "C" {
#include "base/srgb.h"
}

namespace {

/* Channels of red, green, blue and alpha in a decoded pixel; alpha -1: opaque. */
struct channels {
	int n, red, green, blue, alpha;
};

channels channels_of(const OIIO::ImageSpec &spec)
{
	channels c = { spec.nchannels < 4 ? spec.nchannels : 4, 0, 0, 0, -1 };

	if (spec.nchannels >= 3) {
		c.green = 1;
		c.blue = 2;
	}
	if (spec.nchannels == 2 || spec.nchannels >= 4)
		c.alpha = spec.nchannels == 2 ? 1 : 3;
	return c;
}

struct problem {
	char *message;
	unsigned size;
};

int fail(const problem &problem, int code, const std::string &why)
{
	std::snprintf(problem.message, problem.size, "%s", why.c_str());
	return code;
}

int check_spec(const OIIO::ImageSpec &spec, uint64_t max_pixels, const problem &problem)
{
	const std::string size = std::to_string(spec.width) + " x " + std::to_string(spec.height) + " pixels";
	if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep)
		return fail(problem, PSR_ERR_UNSUPPORTED, "not a 2D image with one to four channels");
	if (spec.width > IMPORT_MAX_IMAGE_SIDE || spec.height > IMPORT_MAX_IMAGE_SIDE)
		return fail(problem, PSR_ERR_LIMIT,
		            size + ", the limit is " + std::to_string(IMPORT_MAX_IMAGE_SIDE) + " on a side");
	if ((uint64_t)spec.width * (uint64_t)spec.height > max_pixels)
		return fail(problem, PSR_ERR_LIMIT, "with its " + size + " the images of this mesh have more than "
		                                    + std::to_string(IMPORT_MAX_PIXELS));
	return PSR_OK;
}

/* Integers are sRGB codes, whatever the file says, as in glTF; floats are linear light. */
bool read_integers(OIIO::ImageInput &in, const channels &c, size_t n_pixels, uint8_t *rgba)
{
	if (!in.read_image(0, 0, 0, c.n, OIIO::TypeDesc::UINT8, rgba, 4))
		return false;
	for (size_t i = 0; i < n_pixels; i++) {
		uint8_t *p = rgba + 4 * i, r = p[c.red], g = p[c.green], b = p[c.blue], a = c.alpha < 0 ? 255 : p[c.alpha];
		p[0] = r;
		p[1] = g;
		p[2] = b;
		p[3] = a;
	}
	return true;
}

bool read_floats(OIIO::ImageInput &in, const channels &c, size_t n_pixels, uint8_t *rgba)
{
	std::vector<float> linear(n_pixels * (size_t)c.n);
	if (!in.read_image(0, 0, 0, c.n, OIIO::TypeDesc::FLOAT, linear.data()))
		return false;
	for (size_t i = 0; i < n_pixels; i++) {
		const float *p = linear.data() + i * (size_t)c.n;
		float a = c.alpha < 0 ? 1.0f : p[c.alpha];
		rgba[4 * i] = psr_linear_to_srgb(p[c.red]);
		rgba[4 * i + 1] = psr_linear_to_srgb(p[c.green]);
		rgba[4 * i + 2] = psr_linear_to_srgb(p[c.blue]);
		rgba[4 * i + 3] = (uint8_t)std::lrint(255.0f * (a > 0.0f ? a < 1.0f ? a : 1.0f : 0.0f));
	}
	return true;
}

int decode(uint8_t **out, uint32_t size[2], const image_module_source &source, const problem &problem)
{
	OIIO::Filesystem::IOMemReader reader(const_cast<uint8_t *>(source.bytes), source.n_bytes);
	std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::create(source.format);
	OIIO::ImageSpec spec, config;

	if (!in || !in->supports("ioproxy") || !in->set_ioproxy(&reader)) {
		OIIO::geterror();
		return fail(problem, PSR_ERR_UNSUPPORTED,
		            std::string("OpenImageIO has no reader for ") + source.format + " in memory");
	}
	config.attribute("oiio:UnassociatedAlpha", 1);
	if (!in->open(std::string("memory.") + source.format, spec, config))
		return fail(problem, PSR_ERR_FORMAT, "broken image: " + in->geterror());

	int rc = check_spec(spec, source.max_pixels, problem);
	if (rc != PSR_OK)
		return rc;

	const channels c = channels_of(spec);
	const size_t n_pixels = (size_t)spec.width * (size_t)spec.height;
	const bool is_float = spec.format.is_floating_point();

	if (is_float && n_pixels > (IMPORT_MAX_PIXELS >> 3))
		return fail(problem, PSR_ERR_LIMIT, "too many pixels for an image of floats");
	std::unique_ptr<uint8_t, decltype(&std::free)> rgba((uint8_t *)std::calloc(n_pixels, 4), &std::free);
	if (!rgba)
		return fail(problem, PSR_ERR_MEMORY, "no memory for the pixels");
	if (!(is_float ? read_floats(*in, c, n_pixels, rgba.get()) : read_integers(*in, c, n_pixels, rgba.get())))
		return fail(problem, PSR_ERR_FORMAT, "broken image: " + in->geterror());
	size[0] = (uint32_t)spec.width;
	size[1] = (uint32_t)spec.height;
	*out = rgba.release();
	return PSR_OK;
}

} // namespace

extern "C" int image_read(uint8_t **rgba, uint32_t size[2], const image_module_source *source, char *message,
                          unsigned message_size)
{
	const problem problem = { message, message_size };
	try {
		return decode(rgba, size, *source, problem);
	} catch (const std::bad_alloc &) {
		std::snprintf(message, message_size, "no memory to decode this image");
		return PSR_ERR_MEMORY;
	} catch (const std::exception &e) {
		std::snprintf(message, message_size, "broken image: %s", e.what());
	} catch (...) {
		std::snprintf(message, message_size, "broken image");
	}
	return PSR_ERR_FORMAT;
}
