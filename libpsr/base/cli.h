/* Command lines for all programs: one table of options gives the parser, --help with the real defaults, configuration
 * files, and what a shell completes. */
#ifndef PSR_BASE_CLI_H
#define PSR_BASE_CLI_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

enum psr_opt_type {
	PSR_OPT_FLAG,   /* int: set to 1 */
	PSR_OPT_INT,    /* int64_t, within min..max; suffixes k, m, g (1024) are understood */
	PSR_OPT_REAL,   /* double, finite, within min..max */
	PSR_OPT_STRING, /* const char *, points into argv */
	PSR_OPT_VEC3,   /* double[3], "x,y,z", finite */
	PSR_OPT_SIZE,   /* uint32_t[2], "WxH", each within min..max */
	PSR_OPT_COLOR,  /* uint8_t[3], "#rrggbb" */
	PSR_OPT_CALL,   /* int (*)(const char *text, void *userdata, struct psr_error *): repeatable, own syntax */
	PSR_OPT_HEADING, /* not an option: --help prints `name` above the options that follow, and `help` (may be NULL)
	                  * below it */
};

struct psr_opt {
	const char *name;      /* long name without the dashes; NULL ends the table */
	char letter;           /* short name, or 0 */
	enum psr_opt_type type;
	void *value;           /* where the value goes; --help prints its content before parsing as the default */
	const char *arg;       /* what --help calls the argument ("DEG"); NULL for flags */
	const char *help;      /* one line or more ('\n'); the parser adds the default in brackets */
	double min, max;       /* INT, REAL, SIZE: both 0 means unchecked */
	int (*call)(const char *text, void *userdata, struct psr_error *err);
	int *seen;             /* if not NULL: incremented when the option is given */
	const char *words;     /* for shells, may be NULL: the values, with a blank between them, or one of @models,
	                        * @folders; without it a shell completes files where `arg` speaks of one */
};

struct psr_cli {
	const char *usage;           /* "psr shot --server ADDR --model NAME [options]" */
	const char *summary;         /* a sentence or two about the program */
	const struct psr_opt *opts;
	const char *footer;          /* examples, exit codes; may be NULL */
	int *given;                  /* if not NULL, one for each of opts: counts how often the command line names it */
};

/* Parses argv[1..argc-1]: --name value, --name=value, -l value, flags, "--" ends options. Operands are moved to the
 * front of argv[1..]; *n_operands says how many. Returns PSR_OK, PSR_ERR_ARG with a sentence that names the option, or
 * 1 if --help was given (the help stands on standard output by then), or --completions: that prints, for the scripts
 * in client/completion, a line `--name TAB letter TAB arg TAB words TAB help` for each option. */
int psr_cli_parse(const struct psr_cli *cli, int argc, char **argv, int *n_operands, struct psr_error *err);

/* Sets one option by its name from text, as a configuration line does. */
int psr_cli_set(const struct psr_cli *cli, const char *name, const char *text, struct psr_error *err);

/* Returns whether the command line of a cli with `given` named this option. */
int psr_cli_is_given(const struct psr_cli *cli, const char *name);

/* A file of `name = value` lines, # before comments. Lines above the first `[section]` hold for every program that
 * reads the file. */
struct psr_config {
	const char *path;
	const char *section;         /* the one whose lines hold, too; NULL: none */
	const char *const *sections; /* that the file may have, NULL at the end; NULL: none */
};

/* Sets the options of `cli` (with `given`) that its command line did not. Strings of options point into *text, which
 * the caller frees, also after an error. ARG, with path and line; NOT_FOUND, IO, LIMIT, MEMORY. */
int psr_config_read(char **text, const struct psr_config *config, const struct psr_cli *cli, struct psr_error *err);

/* "x,y,z" -> three finite doubles; PSR_ERR_ARG otherwise. *end, if not NULL, gets the first character not used. */
int psr_parse_vec3(const char *text, double v[3], const char **end, struct psr_error *err);
int psr_parse_color(const char *text, uint8_t rgb[3], const char **end, struct psr_error *err);
int psr_parse_real(const char *text, double *v, const char **end, struct psr_error *err);

/* Returns how many letters to insert, remove or change to turn the first n_a bytes of `a` into `b`; n_a + strlen(b)
 * where one of them has more than 63. */
size_t psr_edit_distance(const char *a, size_t n_a, const char *b);

/* Prints "PROGRAM: text" to standard error and returns the exit status for err->code. */
int psr_cli_fail(const char *program, const struct psr_error *err);

/* ---- between cli.c and cli_help.c ---- */

#define CLI_VALUE_TEXT 128

/* Prints the whole help on standard output. */
void cli_help_print(const struct psr_cli *cli);
void cli_completions_print(const struct psr_cli *cli);

/* Formats a number as people write it: 64m for an INT of 67108864, 0.5 for a REAL. */
void cli_number_format(char text[CLI_VALUE_TEXT], enum psr_opt_type type, double value);

#endif
