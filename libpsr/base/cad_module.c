#include "cad_module.h"
#include "module.h"

int cad_module_open(const struct cad_module **out, struct psr_error *err)
{
	static struct module module = { .file = "psr-cad-occ.so", .name = "CAD module", .symbol = "psr_cad_module",
		                            .variable = "PSR_CAD_MODULE", .version = CAD_MODULE_VERSION };
	const void *loaded;
	const int rc = module_open(&loaded, &module, err);

	*out = loaded;
	return rc;
}
