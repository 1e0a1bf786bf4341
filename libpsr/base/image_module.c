#include "image_module.h"
#include "module.h"

int image_module_open(const struct image_module **out, struct psr_error *err)
{
	static struct module module = { .file = "psr-image-oiio.so", .name = "image module", .symbol = "psr_image_module",
		                            .variable = "PSR_IMAGE_MODULE", .version = IMAGE_MODULE_VERSION };
	const void *loaded;
	const int rc = module_open(&loaded, &module, err);

	*out = loaded;
	return rc;
}
