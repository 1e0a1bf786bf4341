/* Shared by the files of the command line: cli.c parses, cli_help.c prints. */
#ifndef PSR_BASE_CLI_H
#define PSR_BASE_CLI_H

#include <stddef.h>
#include "psr/cli.h"

#define CLI_VALUE_TEXT 128

/* Prints the whole help on standard output. */
void cli_help_print(const struct psr_cli *cli);

/* Formats a number as people write it: 64m for an INT of 67108864, 0.5 for a REAL. */
void cli_number_format(char text[CLI_VALUE_TEXT], enum psr_opt_type type, double value);

#endif
