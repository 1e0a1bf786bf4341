/* The hash of a plane of a picture, as the protocol defines it: XXH64, seed 0, of the little-endian XXH64s of its
 * strips, so that threads share the work. */
#ifndef PSR_BASE_HASH_H
#define PSR_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

#define HASH_STRIP_ROWS 128 /* from the top; the last strip may have fewer */

uint64_t hash_strip(const void *pixels, size_t n_bytes); /* hashes a strip's packed rows */
uint64_t hash_join(const uint64_t *strip, size_t n);     /* joins the hashes of all strips of a plane, from the top */

/* Hashes a plane of packed rows: hash_strip() and hash_join() in turn. */
uint64_t hash_plane(const void *pixels, size_t row_bytes, uint32_t height);

#endif
