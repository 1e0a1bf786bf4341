#include <pthread.h>
#include "cad_module.h"
#include "module.h"

int cad_module_open(const struct cad_module **out, struct psr_error *err)
{
	static const struct module_kind kind = { "psr-cad-occ.so", "CAD module", "psr_cad_module", "PSR_CAD_MODULE",
		                                     CAD_MODULE_VERSION };
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
