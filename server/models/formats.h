/* Model formats that psr does not read, with advice on such files. */
#ifndef PSRD_FORMATS_H
#define PSRD_FORMATS_H

#include <stddef.h>

/* Returns a sentence for people: what a file with this ending holds, and how to make a model of it. NULL: psr reads
 * such files, or they hold no models. *stem gets the number of bytes before the ending. */
const char *formats_advice(const char *file_name, size_t *stem);

#endif
