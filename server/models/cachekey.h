/* The keys of built models in the cache. */
#ifndef PSRD_CACHEKEY_H
#define PSRD_CACHEKEY_H

#include "catalogue.h"
#include "psr/error.h"

/* Computes the key: XXH128, in hexadecimal, of all that decides how a built model looks: psrd's version, the builder's
 * bytes, the source's ending and bytes. For formats that may name further files (all but .stl, .off, .las, .pcd, and a
 * .glb or .ply that names none) it covers the relative path, size and time of change of each other regular file in the
 * source's folder and below, except files that are models by themselves. It does not read these neighbours: they may be
 * many and large, and a change of one changes its time. At most 10,000 neighbours, 4 folders deep. On any thread.
 * NOT_FOUND, IO, MEMORY, LIMIT. */
int cachekey_find(char key[CATALOGUE_KEY], const char *source, const char *builder, struct psr_error *err);

#endif
