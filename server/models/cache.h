/* The folder of built models, named KEY-RESOLUTION.psr. Several daemons may share it. */
#ifndef PSRD_CACHE_H
#define PSRD_CACHE_H

#include <stddef.h>
#include "catalogue.h"
#include "psr/error.h"

/* Makes the folder and its parents if they are missing (mode 0700). IO: psrd cannot make it, or it belongs to another
 * user, or others may write to it, who could then put their own models there. MEMORY. */
int cache_make(const char *folder, struct psr_error *err);

/* Makes the folder, then writes a file there and removes it. IO: says why that fails, and what to do. */
int cache_check(const char *folder, struct psr_error *err);

char *cache_path(const char *folder, const char *key, uint32_t resolution); /* the caller frees it; NULL: no memory */

/* Returns the path of the file that a model comes from: of this folder, or its own; NULL: that has changed or is gone, or
 * no memory. The caller frees it. */
char *cache_model_path(const char *folder, const struct catalogue_model *model);

/* Returns whether a built model of ours lies there, and its size. */
int cache_find(uint64_t *bytes, const char *path);

void cache_touch(const char *path); /* marks a model as used now */

/* Removes built models, the longest unused first, until the rest takes max_bytes at most (0: no limit); keeps the
 * models of the n keys. Also removes files that builds left when they were killed long ago. Leaves all other files
 * alone. Any thread. */
void cache_trim(const char *folder, uint64_t max_bytes, const char (*key)[CATALOGUE_KEY], size_t n);

#endif
