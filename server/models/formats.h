/* Model formats that psr does not read, and what a user can do with such files. */
#ifndef PSRD_FORMATS_H
#define PSRD_FORMATS_H

#include <stddef.h>

/* A sentence for people: what a file of this name holds, by its ending, and how it becomes a model. NULL: it is no file
 * of models, or one that is read. *stem gets the bytes of the name before the ending. */
const char *formats_advice(const char *file_name, size_t *stem);

#endif
