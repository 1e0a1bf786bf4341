/* A psrd of the viewer's own for a file that the user names: it serves that file, on a Unix socket in a temporary
 * folder that only the user can enter. Both are gone once the viewer is, however it ends. */
#ifndef PSR_CLIENT_VIEW_HOME_H
#define PSR_CLIENT_VIEW_HOME_H

#include <limits.h>
#include "psr/error.h"

/* Wish `pixels` as large as the picture, and this for link_wish.coarse_pixels: psrd builds a coarse model first, which
 * takes little more than reading the file (PSR_PREVIEW_RESOLUTION of psr/mesh.h). */
#define HOME_COARSE_PIXELS 64

struct home;

/* Starts psrd, found beside this program or on PATH, and waits until it serves: some hundredths of a second. The model
 * itself is built when it is opened; what is wrong with it is told then. Built models stay in the user's cache.
 * NOT_FOUND: no such file, no psrd; ARG: a folder, or another model of its folder has the name; FORMAT: psrd serves no
 * such file; IO, MEMORY. */
int home_open(struct home **out, const char *path, struct psr_error *err);
void home_close(struct home *home); /* NULL is fine */

const char *home_address(const struct home *home); /* for link_open() */
const char *home_model(const struct home *home);   /* its name there */

const char *home_folder(const struct home *home); /* that the file lies in: psrd --models FOLDER serves it, too */

#endif
