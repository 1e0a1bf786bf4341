#include <dlfcn.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "picture.h"

#define MODULE "psr-image-oiio.so"

/* The module of this installation (PREFIX/bin beside PREFIX/lib/psr) or build folder. */
static int find_module(char path[PATH_MAX + 64])
{
	static const char *const beside[] = { "/../lib/psr/" MODULE, "/../lib/" MODULE };
	char folder[PATH_MAX];
	const char *chosen = getenv("PSR_IMAGE_MODULE");
	ssize_t n;
	char *slash;

	if (chosen != NULL && chosen[0] != '\0') {
		snprintf(path, PATH_MAX + 64, "%s", chosen);
		return 1;
	}
	n = readlink("/proc/self/exe", folder, sizeof folder - 1);
	if (n <= 0)
		return 0;
	folder[n] = '\0';
	slash = strrchr(folder, '/');
	if (slash == NULL)
		return 0;
	*slash = '\0';
	for (size_t i = 0; i < sizeof beside / sizeof beside[0]; i++) {
		snprintf(path, PATH_MAX + 64, "%s%s", folder, beside[i]);
		if (access(path, R_OK) == 0)
			return 1;
	}
	return 0;
}

int picture_module_load(picture_module_write **write, picture_module_check **check, struct psr_error *err)
{
	char path[PATH_MAX + 64];
	void *module;

	if (!find_module(path))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "only .png, .ppm and .pfm can be written: the module " MODULE " for other "
		                "formats is not installed beside this program; PSR_IMAGE_MODULE can name it");
	module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (module == NULL)
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "only .png, .ppm and .pfm can be written: the module for other formats "
		                "cannot be loaded: %.300s",
		                dlerror());
	*write = (picture_module_write *)(uintptr_t)dlsym(module, "psr_image_module_write");
	*check = (picture_module_check *)(uintptr_t)dlsym(module, "psr_image_module_check");
	if (*write == NULL || *check == NULL) {
		dlclose(module);
		return psr_fail(err, PSR_ERR_VERSION, "%.300s is not the image module of this version of psr", path);
	}
	return PSR_OK;
}
