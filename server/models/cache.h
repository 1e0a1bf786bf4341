/* The folder of built models. */
#ifndef PSRD_CACHE_H
#define PSRD_CACHE_H

#include "psr/error.h"

/* Makes the folder and its parents if they are missing (mode 0700). IO, MEMORY. */
int cache_make(const char *folder, struct psr_error *err);

/* The same; then writes a file there and removes it. IO: says why it cannot, and what to do. */
int cache_check(const char *folder, struct psr_error *err);

#endif
