#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>
#include <strings.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include "import.h"

extern "C" {
#include "base/srgb.h"
}

namespace {

struct magic {
	const char *format; /* as OpenImageIO calls it */
	size_t offset, n;
	const char *bytes;
};

const magic magics[] = {
	{ "png", 0, 8, "\x89PNG\r\n\x1a\n" }, { "jpeg", 0, 3, "\xff\xd8\xff" }, { "gif", 0, 4, "GIF8" },
	{ "webp", 8, 4, "WEBP" },             { "tiff", 0, 4, "II*\0" },        { "tiff", 0, 4, "MM\0*" },
	{ "hdr", 0, 2, "#?" },                { "openexr", 0, 4, "v/1\x01" },   { "psd", 0, 4, "8BPS" },
	{ "dds", 0, 4, "DDS " },              { "bmp", 0, 2, "BM" },            { "pnm", 0, 2, "P3" },
	{ "pnm", 0, 2, "P5" },                { "pnm", 0, 2, "P6" },
};

const char *format_of(const uint8_t *bytes, size_t n_bytes, const char *name)
{
	size_t n = strlen(name);

	for (const magic &m : magics)
		if (n_bytes >= m.offset + m.n && memcmp(bytes + m.offset, m.bytes, m.n) == 0)
			return m.format;
	if (n >= 4 && strcasecmp(name + n - 4, ".tga") == 0)
		return "targa";
	return nullptr;
}

/* Where a decoded pixel's red, green, blue and alpha stand; alpha -1: opaque. */
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

int fail(struct psr_error *err, int code, const char *name, const std::string &why)
{
	return psr_fail(err, code, "%s: %s", name, why.c_str());
}

int check_spec(const OIIO::ImageSpec &spec, uint64_t max_pixels, const char *name, struct psr_error *err)
{
	if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep)
		return fail(err, PSR_ERR_UNSUPPORTED, name, "not a plain picture with one to four channels");
	if (spec.width > IMPORT_MAX_IMAGE_SIDE || spec.height > IMPORT_MAX_IMAGE_SIDE)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: %d x %d pixels, the limit is %d on a side", name, spec.width,
		                spec.height,
		                IMPORT_MAX_IMAGE_SIDE);
	if ((uint64_t)spec.width * (uint64_t)spec.height > max_pixels)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: with its %d x %d pixels the images of this mesh have more than %llu",
		                name,
		                spec.width, spec.height, (unsigned long long)IMPORT_MAX_PIXELS);
	return PSR_OK;
}

/* Integers are taken as sRGB-coded, whatever the file says, as glTF wants it; floats are linear light. */
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

int decode(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, const char *name, uint64_t max_pixels,
           struct psr_error *err)
{
	const char *format = format_of(bytes, n_bytes, name);

	if (format == nullptr)
		return fail(err, PSR_ERR_UNSUPPORTED, name, "not an image of a known format (PNG, JPEG, WebP, TIFF, TGA, ...)");

	OIIO::Filesystem::IOMemReader reader(const_cast<uint8_t *>(bytes), n_bytes);
	std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::create(format);
	OIIO::ImageSpec spec, config;

	if (!in || !in->supports("ioproxy") || !in->set_ioproxy(&reader)) {
		OIIO::geterror();
		return fail(err, PSR_ERR_UNSUPPORTED, name,
		            std::string("OpenImageIO has no reader for ") + format + " in memory");
	}
	config.attribute("oiio:UnassociatedAlpha", 1);
	if (!in->open(std::string("memory.") + format, spec, config))
		return fail(err, PSR_ERR_FORMAT, name, "broken image: " + in->geterror());

	int rc = check_spec(spec, max_pixels, name, err);
	if (rc != PSR_OK)
		return rc;

	const channels c = channels_of(spec);
	const size_t n_pixels = (size_t)spec.width * (size_t)spec.height;
	const bool is_float = spec.format.is_floating_point();

	if (is_float && n_pixels > (IMPORT_MAX_PIXELS >> 3))
		return fail(err, PSR_ERR_LIMIT, name, "too many pixels for an image of floats");
	std::unique_ptr<uint8_t, decltype(&std::free)> rgba((uint8_t *)std::calloc(n_pixels, 4), &std::free);
	if (!rgba)
		return fail(err, PSR_ERR_MEMORY, name, "no memory for its pixels");
	if (!(is_float ? read_floats(*in, c, n_pixels, rgba.get()) : read_integers(*in, c, n_pixels, rgba.get())))
		return fail(err, PSR_ERR_FORMAT, name, "broken image: " + in->geterror());
	out->width = (uint32_t)spec.width;
	out->height = (uint32_t)spec.height;
	out->rgba = rgba.release();
	return PSR_OK;
}

} // namespace

extern "C" int import_image_decode(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, const char *name,
                                   uint64_t max_pixels, struct psr_error *err)
{
	try {
		return decode(out, bytes, n_bytes, name, max_pixels, err);
	} catch (const std::bad_alloc &) {
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to decode this image", name);
	} catch (const std::exception &e) {
		return psr_fail(err, PSR_ERR_FORMAT, "%s: broken image: %s", name, e.what());
	} catch (...) {
		return psr_fail(err, PSR_ERR_FORMAT, "%s: broken image", name);
	}
}
