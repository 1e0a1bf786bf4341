/* Modules: shared objects that are loaded when somebody first needs them, so that nobody else pays for their
 * libraries. */
#ifndef PSR_BASE_MODULE_H
#define PSR_BASE_MODULE_H

#include <stdint.h>
#include "psr/error.h"

/* What a module exports, under the name `symbol`, begins with a uint32_t: the version of its interface. */
struct module {
	const char *file;     /* "psr-image-oiio.so" */
	const char *name;     /* for errors: "image module" */
	const char *symbol;
	const char *variable; /* of the environment; names another file */
	uint32_t version;     /* that this program needs */
	const void *loaded;   /* module_open()'s; NULL before */
};

/* Loads a module, from any thread: the file that the variable names; else the one of this installation (../lib/psr
 * beside the program's folder) or build folder (../lib); else the one that the dynamic linker finds. *out stays valid;
 * later calls return the same. UNSUPPORTED if it is missing or cannot be loaded, VERSION if it is another version's, or
 * no such module; a later call tries again. */
int module_open(const void **out, struct module *module, struct psr_error *err);

#endif
