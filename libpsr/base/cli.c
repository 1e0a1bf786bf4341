#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "cli.h"

static int is_checked(const struct psr_opt *opt)
{
	return opt->min != 0 || opt->max != 0;
}

static int fail_range(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	char least[CLI_VALUE_TEXT], most[CLI_VALUE_TEXT];

	cli_number_format(least, opt->type, opt->min);
	cli_number_format(most, opt->type, opt->max);
	return psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is out of range; it takes %s to %s", opt->name, text, least, most);
}

/* Reads decimal digits into *v; returns 0 if there are none or the value does not fit. */
static int read_digits(const char **text, uint64_t *v)
{
	const char *at = *text;

	*v = 0;
	for (; isdigit((unsigned char)*at); at++)
		if (__builtin_mul_overflow(*v, 10, v) || __builtin_add_overflow(*v, (uint64_t)(*at - '0'), v))
			return 0;
	if (at == *text)
		return 0;
	*text = at;
	return 1;
}

static int set_int(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	const char *at = text + (*text == '-' || *text == '+');
	uint64_t magnitude;
	int64_t value;
	int shift = 0;

	if (!read_digits(&at, &magnitude))
		return psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is not a whole number such as 8 or 64m", opt->name, text);
	if (*at != '\0' && strchr("kKmMgG", *at) != NULL) {
		shift = (*at | 32) == 'k' ? 10 : (*at | 32) == 'm' ? 20 : 30;
		at++;
	}
	if (*at != '\0')
		return psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is not a whole number such as 8 or 64m", opt->name, text);
	if (magnitude > (uint64_t)INT64_MAX >> shift)
		return psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is too large", opt->name, text);
	value = (int64_t)(magnitude << shift);
	if (*text == '-')
		value = -value;
	if (is_checked(opt) && ((double)value < opt->min || (double)value > opt->max))
		return fail_range(opt, text, err);
	*(int64_t *)opt->value = value;
	return PSR_OK;
}

static int set_real(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	double value;

	if (psr_parse_real(text, &value, NULL, NULL) != PSR_OK)
		return psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is not a finite decimal number such as 1.5", opt->name, text);
	if (is_checked(opt) && (value < opt->min || value > opt->max))
		return fail_range(opt, text, err);
	*(double *)opt->value = value;
	return PSR_OK;
}

static int set_size(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	const char *at = text;
	uint64_t size[2];
	uint32_t *out = opt->value;

	if (!read_digits(&at, &size[0]) || (*at != 'x' && *at != 'X') || (at++, !read_digits(&at, &size[1])) || *at != '\0')
		return psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is not a size such as 1280x720", opt->name, text);
	for (int i = 0; i < 2; i++)
		if (size[i] > UINT32_MAX
		    || (is_checked(opt) && ((double)size[i] < opt->min || (double)size[i] > opt->max)))
			return is_checked(opt) ? fail_range(opt, text, err)
			                       : psr_fail(err, PSR_ERR_ARG, "--%s: '%.80s' is too large", opt->name, text);
	out[0] = (uint32_t)size[0];
	out[1] = (uint32_t)size[1];
	return PSR_OK;
}

static int set_flag(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	static const char *const words[2][4] = { { "no", "off", "false", "0" }, { "yes", "on", "true", "1" } };

	for (int value = 0; value < 2; value++) {
		for (int i = 0; i < 4; i++) {
			if (strcmp(text, words[value][i]) == 0) {
				*(int *)opt->value = value;
				return PSR_OK;
			}
		}
	}
	return psr_fail(err, PSR_ERR_ARG, "%s: '%.80s' is neither yes nor no", opt->name, text);
}

static int set_value(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	struct psr_error inner;
	int code = PSR_OK;

	switch (opt->type) {
	case PSR_OPT_FLAG:
		return set_flag(opt, text, err);
	case PSR_OPT_INT:
		return set_int(opt, text, err);
	case PSR_OPT_REAL:
		return set_real(opt, text, err);
	case PSR_OPT_SIZE:
		return set_size(opt, text, err);
	case PSR_OPT_STRING:
		*(const char **)opt->value = text;
		return PSR_OK;
	case PSR_OPT_VEC3:
		code = psr_parse_vec3(text, opt->value, NULL, &inner);
		break;
	case PSR_OPT_COLOR:
		code = psr_parse_color(text, opt->value, NULL, &inner);
		break;
	case PSR_OPT_CALL:
		snprintf(inner.text, sizeof inner.text, "'%.80s' is not valid", text);
		code = opt->call(text, opt->value, &inner);
		break;
	case PSR_OPT_HEADING: /* find_long and find_letter never return one */
		break;
	}
	return code == PSR_OK ? PSR_OK : psr_fail(err, code, "--%s: %.480s", opt->name, inner.text);
}

static int give(const struct psr_opt *opt, const char *text, struct psr_error *err)
{
	int code = set_value(opt, text, err);

	if (code == PSR_OK && opt->seen != NULL)
		++*opt->seen;
	return code;
}

static const struct psr_opt *find_long(const struct psr_cli *cli, const char *name, size_t length)
{
	for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++)
		if (opt->type != PSR_OPT_HEADING && strlen(opt->name) == length && memcmp(opt->name, name, length) == 0)
			return opt;
	return NULL;
}

static const struct psr_opt *find_letter(const struct psr_cli *cli, char letter)
{
	for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++)
		if (opt->letter == letter)
			return opt;
	return NULL;
}

static int fail_unknown(const struct psr_cli *cli, const char *dashes, const char *name, size_t length,
                        struct psr_error *err)
{
	const struct psr_opt *near = NULL;
	size_t least = 3;
	int shown = (int)(length < 80 ? length : 80);

	for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++) {
		size_t distance = psr_edit_distance(name, length, opt->name);

		if (opt->type != PSR_OPT_HEADING && distance < least && distance < strlen(opt->name)) {
			least = distance;
			near = opt;
		}
	}
	if (near != NULL)
		return psr_fail(err, PSR_ERR_ARG, "unknown option %s%.*s; did you mean %s%s?", dashes, shown, name, dashes,
		                near->name);
	return psr_fail(err, PSR_ERR_ARG, "unknown option %s%.*s; --help lists the options", dashes, shown, name);
}

/* Takes the option at argv[*i] and its value, if it has one; leaves *i at the last argument used. */
static int parse_option(const struct psr_cli *cli, int argc, char **argv, int *i, struct psr_error *err)
{
	const char *arg = argv[*i], *value = NULL;
	const struct psr_opt *opt;

	if (arg[1] == '-') {
		size_t length = strcspn(arg + 2, "=");

		opt = find_long(cli, arg + 2, length);
		if (opt == NULL)
			return fail_unknown(cli, "--", arg + 2, length, err);
		if (arg[2 + length] == '=')
			value = arg + 2 + length + 1;
	} else {
		opt = arg[2] == '\0' ? find_letter(cli, arg[1]) : NULL;
		if (opt == NULL)
			return psr_fail(err, PSR_ERR_ARG, "unknown option %.80s; --help lists the options", arg);
	}
	if (cli->given != NULL)
		cli->given[opt - cli->opts]++;
	if (opt->type == PSR_OPT_FLAG) {
		if (value != NULL)
			return psr_fail(err, PSR_ERR_ARG, "--%s takes no value", opt->name);
		return give(opt, "yes", err);
	}
	if (value == NULL) {
		if (*i + 1 >= argc)
			return psr_fail(err, PSR_ERR_ARG, "--%s needs a value: --%s %s", opt->name, opt->name,
			                opt->arg != NULL ? opt->arg : "VALUE");
		value = argv[++*i];
	}
	return give(opt, value, err);
}

int psr_cli_parse(const struct psr_cli *cli, int argc, char **argv, int *n_operands, struct psr_error *err)
{
	int n = 0, options_end = 0;

	if (argc == 2 && strcmp(argv[1], "--completions") == 0) {
		cli_completions_print(cli);
		return 1;
	}
	/* --help comes before any parsing, so that it shows the defaults. */
	for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
		if (strcmp(argv[i], "--help") == 0) {
			cli_help_print(cli);
			return 1;
		}
	}
	for (int i = 1; i < argc; i++) {
		int code;

		if (!options_end && strcmp(argv[i], "--") == 0) {
			options_end = 1;
		} else if (!options_end && argv[i][0] == '-' && argv[i][1] != '\0') {
			code = parse_option(cli, argc, argv, &i, err);
			if (code != PSR_OK)
				return code;
		} else if (n_operands == NULL) {
			return psr_fail(err, PSR_ERR_ARG, "unexpected argument '%.80s'; --help shows the usage", argv[i]);
		} else {
			argv[1 + n++] = argv[i];
		}
	}
	if (n_operands != NULL)
		*n_operands = n;
	return PSR_OK;
}

int psr_cli_set(const struct psr_cli *cli, const char *name, const char *text, struct psr_error *err)
{
	const struct psr_opt *opt = find_long(cli, name, strlen(name));

	if (opt == NULL)
		return fail_unknown(cli, "", name, strlen(name), err);
	return give(opt, text, err);
}

int psr_cli_is_given(const struct psr_cli *cli, const char *name)
{
	const struct psr_opt *opt = find_long(cli, name, strlen(name));

	return opt != NULL && cli->given[opt - cli->opts] > 0;
}

int psr_cli_fail(const char *program, const struct psr_error *err)
{
	fprintf(stderr, "%s: %s\n", program, err->text);
	return psr_exit_status(err->code);
}
