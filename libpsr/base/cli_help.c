#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli.h"

#define WIDTH 100
#define MAX_COLUMN 38 /* longer option texts get a line of their own */

static void format_real(char text[CLI_VALUE_TEXT], double value)
{
	if (fabs(value) < 1e6 && value == floor(value)) {
		snprintf(text, CLI_VALUE_TEXT, "%.0f", value);
		return;
	}
	for (int digits = 1; digits <= 17; digits++) {
		snprintf(text, CLI_VALUE_TEXT, "%.*g", digits, value);
		if (strtod(text, NULL) == value)
			return;
	}
}

void cli_number_format(char text[CLI_VALUE_TEXT], enum psr_opt_type type, double value)
{
	static const struct {
		double unit;
		const char *suffix;
	} units[] = { { 1073741824.0, "g" }, { 1048576.0, "m" } };

	if (type == PSR_OPT_REAL) {
		format_real(text, value);
		return;
	}
	for (size_t i = 0; i < 2; i++) {
		if (value != 0 && fmod(value, units[i].unit) == 0) {
			snprintf(text, CLI_VALUE_TEXT, "%.0f%s", value / units[i].unit, units[i].suffix);
			return;
		}
	}
	snprintf(text, CLI_VALUE_TEXT, "%.0f", value);
}

/* Formats the option's value; "" for an unset string, a size of 0, or a number that is not finite. */
static void format_default(char text[CLI_VALUE_TEXT], const struct psr_opt *opt)
{
	text[0] = '\0';
	switch (opt->type) {
	case PSR_OPT_FLAG:
	case PSR_OPT_CALL:
	case PSR_OPT_HEADING:
		break;
	case PSR_OPT_INT:
		cli_number_format(text, opt->type, (double)*(const int64_t *)opt->value);
		break;
	case PSR_OPT_REAL:
		if (isfinite(*(const double *)opt->value))
			format_real(text, *(const double *)opt->value);
		break;
	case PSR_OPT_STRING:
		if (*(const char *const *)opt->value != NULL)
			snprintf(text, CLI_VALUE_TEXT, "%s", *(const char *const *)opt->value);
		break;
	case PSR_OPT_VEC3: {
		const double *v = opt->value;
		char part[3][CLI_VALUE_TEXT];

		if (!isfinite(v[0]) || !isfinite(v[1]) || !isfinite(v[2]))
			break;
		for (int i = 0; i < 3; i++)
			format_real(part[i], v[i]);
		snprintf(text, CLI_VALUE_TEXT, "%.30s,%.30s,%.30s", part[0], part[1], part[2]);
		break;
	}
	case PSR_OPT_SIZE: {
		const uint32_t *size = opt->value;

		if (size[0] != 0 || size[1] != 0)
			snprintf(text, CLI_VALUE_TEXT, "%" PRIu32 "x%" PRIu32, size[0], size[1]);
		break;
	}
	case PSR_OPT_COLOR: {
		const uint8_t *rgb = opt->value;

		snprintf(text, CLI_VALUE_TEXT, "#%02x%02x%02x", rgb[0], rgb[1], rgb[2]);
		break;
	}
	}
}

/* Prints words from column `at` on, breaking lines at WIDTH and at '\n' and indenting them by `indent`. */
static void print_wrapped(const char *text, int at, int indent)
{
	int line_is_empty = 1;

	while (*text != '\0') {
		int length = (int)strcspn(text, " \n");

		if (length > 0) {
			if (!line_is_empty && at + 1 + length > WIDTH) {
				printf("\n%*s", indent, "");
				at = indent;
				line_is_empty = 1;
			}
			at += printf("%s%.*s", line_is_empty ? "" : " ", length, text);
			line_is_empty = 0;
		}
		text += length;
		if (*text == '\n') {
			printf("\n%*s", text[1] != '\0' && text[1] != '\n' ? indent : 0, "");
			at = indent;
			line_is_empty = 1;
		}
		text += *text != '\0';
	}
	putchar('\n');
}

static int format_name(char *text, size_t size, const struct psr_opt *opt)
{
	char letter[8] = "    ";

	if (opt->letter != '\0')
		snprintf(letter, sizeof letter, "-%c, ", opt->letter);
	return snprintf(text, size, "  %s--%s%s%s", letter, opt->name, opt->arg != NULL ? " " : "",
	                opt->arg != NULL ? opt->arg : "");
}

static void print_heading(const struct psr_opt *heading)
{
	printf("\n%s:\n", heading->name);
	if (heading->help != NULL) {
		printf("  ");
		print_wrapped(heading->help, 2, 2);
	}
}

static void print_option(const struct psr_opt *opt, int column)
{
	char name[256], value[CLI_VALUE_TEXT], text[2048];
	int length = format_name(name, sizeof name, opt);

	format_default(value, opt);
	snprintf(text, sizeof text, value[0] != '\0' ? "%s [%s]" : "%s%s", opt->help, value);
	if (length + 2 > column)
		printf("%s\n%*s", name, column, "");
	else
		printf("%-*s", column, name);
	print_wrapped(text, column, column);
}

void cli_help_print(const struct psr_cli *cli)
{
	static const struct psr_opt help = { .name = "help", .type = PSR_OPT_FLAG, .help = "Print this and exit." };
	char name[256];
	int column = format_name(name, sizeof name, &help) + 2;

	for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++) {
		int length = opt->type == PSR_OPT_HEADING ? 0 : format_name(name, sizeof name, opt) + 2;

		if (length > column && length <= MAX_COLUMN)
			column = length;
	}
	printf("usage: ");
	print_wrapped(cli->usage, 7, 7);
	putchar('\n');
	print_wrapped(cli->summary, 0, 0);
	if (cli->opts->type != PSR_OPT_HEADING)
		printf("\noptions:\n");
	for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++) {
		if (opt->type == PSR_OPT_HEADING)
			print_heading(opt);
		else
			print_option(opt, column);
	}
	print_option(&help, column);
	if (cli->footer != NULL)
		printf("\n%s\n", cli->footer);
	fflush(stdout);
}

void cli_completions_print(const struct psr_cli *cli)
{
	for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++) {
		const char letter[2] = { opt->letter, '\0' };

		if (opt->type != PSR_OPT_HEADING)
			printf("--%s\t%s\t%s\t%s\t%.*s\n", opt->name, letter, opt->arg != NULL ? opt->arg : "",
			       opt->words != NULL ? opt->words : "", (int)strcspn(opt->help, ".:;\n"), opt->help);
	}
	printf("--help\t\t\t\tPrint this and exit\n");
	fflush(stdout);
}
