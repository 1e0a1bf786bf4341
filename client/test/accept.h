/* Writes hashes that were accepted into their suite. */
#ifndef PSR_CLIENT_TEST_ACCEPT_H
#define PSR_CLIENT_TEST_ACCEPT_H

#include "result.h"

/* Replaces the words hash= of the tests that are accepted by the hashes of their pictures, and leaves all else of the
 * file as it is. ARG: the file is not the one that was read, or has such a word in quotes; NOT_FOUND, IO, MEMORY. */
int accept_write(const struct results *results, struct psr_error *err);

#endif
