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

/* A file of words `name=value`, options of `cli`. Blanks separate words, "..." keeps blanks, `name` alone sets a flag,
 * # begins a comment. Errors name the path and the place: `cameras.txt:3:14: ...`. */
struct wordfile {
	const char *path;
	const struct psr_cli *cli;
	int (*on_line)(void *userdata, struct psr_error *err); /* called after each line with words; may be NULL */
	void *userdata;
	int line, column; /* of the word that is read, from 1; callbacks that fail may set the place that is to blame */
};

/* Sets the options. Their strings point into the text, which changes. Errors of options and on_line. */
int wordfile_parse(struct wordfile *file, char *text, struct psr_error *err);

/* Reads the file into *text, which the caller frees, also after an error, and parses it. NOT_FOUND, IO, FORMAT, LIMIT,
 * MEMORY beside the errors above. */
int wordfile_read(struct wordfile *file, char **text, struct psr_error *err);

#endif
