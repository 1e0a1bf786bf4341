/* A psrd of a program's own for a file that the user names: it serves that file, on a Unix socket in a temporary folder
 * that only the user can enter. Both are gone once the program is, however it ends. */
#ifndef PSR_CLIENT_HOME_HOME_H
#define PSR_CLIENT_HOME_HOME_H

#include <limits.h>
#include "psr/error.h"

/* Wish `pixels` as large as the picture, and this for link_wish.coarse_pixels: psrd builds a coarse model first, which
 * takes little more than reading the file (PSR_PREVIEW_RESOLUTION of psr/mesh.h). */
#define HOME_COARSE_PIXELS 64

struct home;

/* Checks that there is such a file, and finds the name that psrd will give it. NOT_FOUND: no such file; ARG: a folder, or
 * a name too long; IO, MEMORY. */
int home_create(struct home **out, const char *path, struct psr_error *err);

/* Starts psrd, found beside this program or on PATH, and waits until it serves: some hundredths of a second. The model
 * itself is built when it is opened; what is wrong with it is told then. Built models stay in the user's cache.
 * NOT_FOUND: no psrd; ARG: another model of the file's folder has the name; FORMAT: psrd serves no such file; IO,
 * MEMORY. */
int home_start(struct home *home, struct psr_error *err);

int home_open(struct home **out, const char *path, struct psr_error *err); /* both */
void home_close(struct home *home); /* NULL is fine */

const char *home_address(const struct home *home); /* where it listens, once started */
const char *home_model(const struct home *home);   /* its name there */
const char *home_file(const struct home *home);    /* the file's whole path */

#endif
