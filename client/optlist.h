/* Tables of options that several commands put together from the same parts. */
#ifndef PSR_CLIENT_OPTLIST_H
#define PSR_CLIENT_OPTLIST_H

#include "base/cli.h"

#define OPTLIST_MAX 80

struct optlist {
	struct psr_opt opt[OPTLIST_MAX + 1]; /* ended by one without a name, if it is zero at first */
	int n;
};

void optlist_add(struct optlist *list, const struct psr_opt *opts, int n);
void optlist_heading(struct optlist *list, const char *heading, const char *text); /* text may be NULL */

#define OPTLIST_ADD(list, opts) optlist_add(list, opts, (int)(sizeof(opts) / sizeof(opts)[0]))

/* Reads a file of words `name=value` for the options of `cli`: apart by blanks, "..." around what holds blanks, `name`
 * alone for a flag, and # before what is for people. After each line that has words, on_line is called (may be NULL).
 * Strings that options take point into *text, which is the caller's to free, also after an error.
 * The options' errors and those of on_line behind file, line and column; NOT_FOUND, IO, MEMORY. */
int wordfile_read(char **text, const char *path, const struct psr_cli *cli, int (*on_line)(void *, struct psr_error *),
                  void *userdata, struct psr_error *err);

#endif
