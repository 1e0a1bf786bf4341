#include <dlfcn.h>
#include <inttypes.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "image_module.h"

#define FILE_NAME "psr-image-oiio.so"
#define MOST_PATH (PATH_MAX + 64)

/* Returns 0 if the module is not beside this program. */
static int find_beside(char path[MOST_PATH])
{
	static const char *const beside[] = { "/../lib/psr/" FILE_NAME, "/../lib/" FILE_NAME };
	char folder[PATH_MAX], *slash;
	ssize_t n = readlink("/proc/self/exe", folder, sizeof folder - 1);

	if (n <= 0)
		return 0;
	folder[n] = '\0';
	slash = strrchr(folder, '/');
	if (slash == NULL)
		return 0;
	*slash = '\0';
	for (size_t i = 0; i < sizeof beside / sizeof beside[0]; i++) {
		snprintf(path, MOST_PATH, "%s%s", folder, beside[i]);
		if (access(path, R_OK) == 0)
			return 1;
	}
	return 0;
}

static int load(const struct image_module **module, struct psr_error *err)
{
	const char *chosen = getenv("PSR_IMAGE_MODULE");
	char path[MOST_PATH] = FILE_NAME;
	const struct image_module *found;
	int is_anywhere = 0, rc = PSR_OK;
	void *handle;

	if (chosen != NULL && chosen[0] != '\0') {
		snprintf(path, sizeof path, "%s", chosen);
	} else if (!find_beside(path)) {
		snprintf(path, sizeof path, "%s", FILE_NAME);
		is_anywhere = 1;
	}
	handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (handle == NULL && is_anywhere)
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "the module " FILE_NAME " is not installed beside this program; PSR_IMAGE_MODULE can name it");
	if (handle == NULL)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "the image module cannot be loaded: %.300s", dlerror());
	found = dlsym(handle, "psr_image_module");
	if (found == NULL)
		rc = psr_fail(err, PSR_ERR_VERSION, "%.300s is not psr's image module", path);
	else if (found->version != IMAGE_MODULE_VERSION)
		rc = psr_fail(err, PSR_ERR_VERSION,
		              "%.300s is image module version %" PRIu32 ", and this program needs version %d: install both from "
		              "the same psr", path, found->version, IMAGE_MODULE_VERSION);
	if (rc != PSR_OK)
		dlclose(handle);
	else
		*module = found;
	return rc;
}

int image_module_open(const struct image_module **out, struct psr_error *err)
{
	static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
	static const struct image_module *module;
	int rc = PSR_OK;

	pthread_mutex_lock(&lock);
	if (module == NULL)
		rc = load(&module, err);
	*out = module;
	pthread_mutex_unlock(&lock);
	return rc;
}
