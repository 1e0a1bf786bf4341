/* A psrd of this program's own, on a Unix socket in a temporary folder that only the user can enter. Both are gone once
 * the program is, however it ends. */
#ifndef PSR_CLIENT_HOME_DAEMON_H
#define PSR_CLIENT_HOME_DAEMON_H

#include "psr/error.h"

#define DAEMON_MAX_OPTIONS 16

struct daemon;

/* Makes the folder. IO, MEMORY. */
int daemon_create(struct daemon **out, struct psr_error *err);
const char *daemon_folder(const struct daemon *daemon); /* its path has less than 64 bytes */

/* Starts psrd, found beside this program or on PATH, with at most DAEMON_MAX_OPTIONS words of options behind `--models
 * DIR --listen ADDRESS`, NULL at their end, and waits until it serves: some hundredths of a second. NOT_FOUND: no psrd;
 * IO: the last line that psrd said. */
int daemon_start(struct daemon *daemon, const char *models, const char *const *options, struct psr_error *err);
const char *daemon_address(const struct daemon *daemon);

/* Ends psrd and removes the folder; one in which psrd has not started must be empty. NULL is fine. */
void daemon_destroy(struct daemon *daemon);

#endif
