/* Keys of built models in the cache. */
#ifndef PSRD_CACHEKEY_H
#define PSRD_CACHEKEY_H

#include "catalogue.h"
#include "psr/error.h"

/* XXH128, in hexadecimal, of what decides how a built model looks: the version of psrd and the bytes of the builder,
 * the source's ending and bytes, and for formats that may name further files (not .stl, .off, .las, nor a .glb or
 * .ply that names none), the relative path, size and time of change of each other regular file in the source's folder
 * and below, but for models of their own. Contents of neighbours are not read: they may be many and large, and
 * whoever changes one changes its time. At most 10,000 neighbours, 4 folders deep. On any thread. NOT_FOUND, IO,
 * MEMORY, LIMIT. */
int cachekey_find(char key[CATALOGUE_KEY], const char *source, const char *builder, struct psr_error *err);

#endif
