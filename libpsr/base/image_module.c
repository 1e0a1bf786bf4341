#include <pthread.h>
#include "image_module.h"
#include "module.h"

int image_module_open(const struct image_module **out, struct psr_error *err)
{
	static const struct module_kind kind = { "psr-image-oiio.so", "image module", "psr_image_module", "PSR_IMAGE_MODULE",
		                                     IMAGE_MODULE_VERSION };
	static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
	static const void *module;
	int rc = PSR_OK;

	pthread_mutex_lock(&lock);
	if (module == NULL)
		rc = module_load(&module, &kind, err);
	*out = module;
	pthread_mutex_unlock(&lock);
	return rc;
}
