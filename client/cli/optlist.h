/* Tables of options, which several commands assemble from common parts. */
#ifndef PSR_CLIENT_CLI_OPTLIST_H
#define PSR_CLIENT_CLI_OPTLIST_H

#include "base/cli.h"

#define OPTLIST_MAX 80

struct optlist {
	struct psr_opt opt[OPTLIST_MAX + 1]; /* the entry behind the last has no name, if the struct was zeroed at first */
	int n;
};

void optlist_add(struct optlist *list, const struct psr_opt *opts, int n);
void optlist_heading(struct optlist *list, const char *heading, const char *text); /* text may be NULL */

#define OPTLIST_ADD(list, opts) optlist_add(list, opts, (int)(sizeof(opts) / sizeof(opts)[0]))

/* Reads a file of words `name=value`, options of `cli`. Blanks separate words, "..." keeps blanks, `name` alone sets a
 * flag, # begins a comment. Calls on_line (may be NULL) after each line with words. Strings of options point into
 * *text, which the caller frees, also after an error. Errors of options and on_line name file, line and column;
 * NOT_FOUND, IO, FORMAT, LIMIT, MEMORY. */
int wordfile_read(char **text, const char *path, const struct psr_cli *cli, int (*on_line)(void *, struct psr_error *),
                  void *userdata, struct psr_error *err);

#endif
