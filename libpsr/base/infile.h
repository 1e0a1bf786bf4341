/* Reads whole files into memory of malloc(). */
#ifndef PSR_BASE_INFILE_H
#define PSR_BASE_INFILE_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a regular file of at most max_bytes. NOT_FOUND, IO (also for any other kind of file), LIMIT, MEMORY. */
int infile_read(uint8_t **bytes, size_t *n_bytes, const char *path, uint64_t max_bytes, struct psr_error *err);

/* Reads a file or pipe as text, and adds a NUL. FORMAT: the text itself contains one. */
int infile_read_text(char **text, const char *path, uint64_t max_bytes, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
