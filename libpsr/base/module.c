#include <dlfcn.h>
#include <inttypes.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "module.h"

#define MOST_PATH (PATH_MAX + 64)

/* Returns 0 if the module is not beside this program. */
static int find_beside(char path[MOST_PATH], const char *file)
{
	static const char *const beside[] = { "/../lib/psr/", "/../lib/" };
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
		snprintf(path, MOST_PATH, "%s%s%s", folder, beside[i], file);
		if (access(path, R_OK) == 0)
			return 1;
	}
	return 0;
}

static int load(const void **out, const struct module *kind, struct psr_error *err)
{
	const char *chosen = getenv(kind->variable);
	char path[MOST_PATH];
	const uint32_t *found;
	int is_anywhere = 0, rc = PSR_OK;
	void *handle;

	if (chosen != NULL && chosen[0] != '\0') {
		snprintf(path, sizeof path, "%s", chosen);
	} else if (!find_beside(path, kind->file)) {
		snprintf(path, sizeof path, "%s", kind->file);
		is_anywhere = 1;
	}
	handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (handle == NULL && is_anywhere)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "the module %s is not installed beside this program; %s can name it",
		                kind->file, kind->variable);
	if (handle == NULL)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "the %s cannot be loaded: %.300s", kind->name, dlerror());
	found = dlsym(handle, kind->symbol);
	if (found == NULL)
		rc = psr_fail(err, PSR_ERR_VERSION, "%.300s is not psr's %s", path, kind->name);
	else if (*found != kind->version)
		rc = psr_fail(err, PSR_ERR_VERSION,
		              "%.300s is %s version %" PRIu32 ", and this program needs version %" PRIu32 ": install both from "
		              "the same psr", path, kind->name, *found, kind->version);
	if (rc != PSR_OK)
		dlclose(handle);
	else
		*out = found;
	return rc;
}

int module_open(const void **out, struct module *module, struct psr_error *err)
{
	static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
	int rc = PSR_OK;

	pthread_mutex_lock(&lock);
	if (module->loaded == NULL)
		rc = load(&module->loaded, module, err);
	*out = module->loaded;
	pthread_mutex_unlock(&lock);
	return rc;
}
