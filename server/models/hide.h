/* Removes the server's folders from texts for clients. */
#ifndef PSRD_HIDE_H
#define PSRD_HIDE_H

#include <stddef.h>

/* Removes each `folder` with its slash from the text, and all folders of each absolute path: files of the models folder
 * keep their names within it, others their last name. */
void hide_paths(char *text, const char *const *folder, size_t n_folders);

#endif
