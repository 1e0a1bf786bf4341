#include <string.h>
#include "base/infile.h"
#include "optlist.h"

#define MAX_BYTES (16u << 20)

/* Returns the next word without its quotes and moves *at behind it; NULL at the end of the line. */
static char *next_word(char **at, int *is_open)
{
	char *start, *to;

	*at += strspn(*at, " \t\r");
	if (**at == '\0' || **at == '#')
		return NULL;
	start = to = *at;
	for (*is_open = 0; **at != '\0' && (*is_open || strchr(" \t\r", **at) == NULL); ++*at) {
		if (**at == '"')
			*is_open = !*is_open;
		else
			*to++ = **at;
	}
	if (**at != '\0')
		++*at;
	*to = '\0';
	return start;
}

static int take_word(const struct psr_cli *cli, char *word, int is_open, struct psr_error *err)
{
	char *value = strchr(word, '=');

	if (is_open)
		return psr_fail(err, PSR_ERR_ARG, "a \" is not closed on its line");
	if (value != NULL)
		*value++ = '\0';
	if (value == NULL)
		for (const struct psr_opt *opt = cli->opts; opt->name != NULL; opt++)
			if (opt->type != PSR_OPT_FLAG && opt->type != PSR_OPT_HEADING && strcmp(opt->name, word) == 0)
				return psr_fail(err, PSR_ERR_ARG, "%s needs a value: %s=%s", word, word, opt->arg);
	return psr_cli_set(cli, word, value != NULL ? value : "yes", err);
}

static int parse_line(struct wordfile *file, char *line, struct psr_error *err)
{
	char *at = line, *word;
	int code = PSR_OK, n_words = 0, is_open = 0;

	while (code == PSR_OK && (word = next_word(&at, &is_open)) != NULL) {
		file->column = (int)(word - line) + 1;
		code = take_word(file->cli, word, is_open, err);
		n_words++;
	}
	if (code == PSR_OK && n_words > 0 && file->on_line != NULL) {
		file->column = 1;
		code = file->on_line(file->userdata, err);
	}
	return code;
}

int wordfile_parse(struct wordfile *file, char *text, struct psr_error *err)
{
	struct psr_error why;
	int code = PSR_OK;

	for (int number = 1; code == PSR_OK && text != NULL; number++) {
		file->line = number;
		code = parse_line(file, strsep(&text, "\n"), &why);
	}
	if (code != PSR_OK)
		psr_fail(err, code, "%.200s:%d:%d: %.290s", file->path, file->line, file->column, why.text);
	return code;
}

int wordfile_read(struct wordfile *file, char **text, struct psr_error *err)
{
	struct psr_error why;
	int code = infile_read_text(text, file->path, MAX_BYTES, &why);

	if (code != PSR_OK)
		return psr_fail(err, code, "cannot read %s", why.text);
	return wordfile_parse(file, *text, err);
}
