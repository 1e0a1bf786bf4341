// The image module's animations: formats of OpenImageIO with several pictures. base/image_module.h has the contract.
#include <OpenImageIO/imageio.h>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "fail.h"
#include "module.h"

namespace {

struct Animation {
	std::unique_ptr<OIIO::ImageOutput> out;
	std::string path;
	std::vector<OIIO::ImageSpec> specs; // of each picture; all equal
	std::size_t n_added = 0;
};

int check(const std::string &ending, char *message, unsigned size)
{
	std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create("x." + ending);
	if (!out)
		return fail(message, size, "OpenImageIO cannot write files with the ending ." + ending);
	if (std::string(out->format_name()) != "gif")
		return fail(message, size, std::string("the format ") + out->format_name()
		            + " has no animations; use .png or .gif, or number the pictures: 'a_%03d." + ending + "'");
	return 0;
}

int open(void **animation, const char *path, const image_module_film &film, char *message, unsigned size)
{
	auto made = std::make_unique<Animation>();
	OIIO::ImageSpec spec(static_cast<int>(film.width), static_cast<int>(film.height), 3, OIIO::TypeDesc::UINT8);

	spec.attribute("oiio:ColorSpace", "sRGB");
	spec.attribute("oiio:Movie", 1);
	spec.attribute("FramesPerSecond", static_cast<float>(1 / film.seconds));
	made->out = OIIO::ImageOutput::create(path);
	made->path = path;
	made->specs.assign(film.n, spec);
	if (!made->out)
		return fail(message, size, OIIO::geterror());
	if (!made->out->open(path, static_cast<int>(film.n), made->specs.data()))
		return fail(message, size, made->out->geterror());
	*animation = made.release();
	return 0;
}

int add(Animation *a, const void *pixels, char *message, unsigned size)
{
	if (a->n_added > 0 && !a->out->open(a->path, a->specs[0], OIIO::ImageOutput::AppendSubimage))
		return fail(message, size, a->out->geterror());
	a->n_added++;
	return a->out->write_image(OIIO::TypeDesc::UINT8, pixels) ? 0 : fail(message, size, a->out->geterror());
}

int close(Animation *a, char *message, unsigned size)
{
	std::unique_ptr<Animation> owned(a);
	return owned->out->close() ? 0 : fail(message, size, owned->out->geterror());
}

}

extern "C" int image_animation_check(const char *ending, char *message, unsigned size)
{
	return guard(message, size, [&] { return check(ending, message, size); });
}

extern "C" int image_animation_open(void **animation, const char *path, const image_module_film *film, char *message,
                                    unsigned size)
{
	return guard(message, size, [&] { return open(animation, path, *film, message, size); });
}

extern "C" int image_animation_add(void *animation, const void *pixels, char *message, unsigned size)
{
	return guard(message, size, [&] { return add(static_cast<Animation *>(animation), pixels, message, size); });
}

extern "C" int image_animation_close(void *animation, char *message, unsigned size)
{
	return guard(message, size, [&] { return close(static_cast<Animation *>(animation), message, size); });
}
