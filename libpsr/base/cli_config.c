#define _GNU_SOURCE
#include <ctype.h>
#include <string.h>
#include "cli.h"
#include "infile.h"

#define MAX_BYTES 65536

static char *trim(char *text)
{
	char *end;

	while (isspace((unsigned char)*text))
		text++;
	end = text + strlen(text);
	while (end > text && isspace((unsigned char)end[-1]))
		end--;
	*end = '\0';
	return text;
}

/* `line` begins with a bracket. *applies: whether the lines below it hold. */
static int begin_section(int *applies, const struct psr_config *config, char *line, struct psr_error *err)
{
	char *end = strchr(line, ']');

	if (end == NULL || end[1] != '\0')
		return psr_fail(err, PSR_ERR_ARG, "'%.80s' is not `[section]`", line);
	*end = '\0';
	line = trim(line + 1);
	*applies = config->section != NULL && strcmp(line, config->section) == 0;
	for (size_t i = 0; config->sections != NULL && config->sections[i] != NULL; i++)
		if (strcmp(line, config->sections[i]) == 0)
			return PSR_OK;
	return psr_fail(err, PSR_ERR_ARG, "there is no section [%.40s]", line);
}

static int set_line(const struct psr_cli *cli, char *line, struct psr_error *err)
{
	char *value = strchr(line, '=');

	if (value == NULL)
		return psr_fail(err, PSR_ERR_ARG, "'%.80s' is not `name = value`", line);
	*value++ = '\0';
	line = trim(line);
	if (strcmp(line, "config") == 0 || strcmp(line, "version") == 0)
		return psr_fail(err, PSR_ERR_ARG, "`%s` belongs on the command line", line);
	return psr_cli_is_given(cli, line) ? PSR_OK : psr_cli_set(cli, line, trim(value), err);
}

int psr_config_read(char **text, const struct psr_config *config, const struct psr_cli *cli, struct psr_error *err)
{
	struct psr_error why;
	int code = infile_read_text(text, config->path, MAX_BYTES, &why), applies = 1;
	char *next = *text, *line;

	if (code != PSR_OK)
		return psr_fail(err, code, "%s", why.text);
	for (int number = 1; (line = strsep(&next, "\n")) != NULL; number++) {
		line = trim(line);
		if (line[0] == '[')
			code = begin_section(&applies, config, line, &why);
		else if (line[0] != '\0' && line[0] != '#' && applies)
			code = set_line(cli, line, &why);
		if (code != PSR_OK)
			return psr_fail(err, code, "%.200s, line %d: %.280s", config->path, number, why.text);
	}
	return PSR_OK;
}
