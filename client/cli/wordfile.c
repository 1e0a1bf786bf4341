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

int wordfile_read(char **text, const char *path, const struct psr_cli *cli, int (*on_line)(void *, struct psr_error *),
                  void *userdata, struct psr_error *err)
{
	struct psr_error why;
	int code = infile_read_text(text, path, MAX_BYTES, &why), number = 0;
	char *rest = *text;

	if (code != PSR_OK)
		return psr_fail(err, code, "cannot read %s", why.text);

	while (code == PSR_OK && rest != NULL) {
		char *line = strsep(&rest, "\n"), *at = line, *word = NULL;
		int column = 1, n_words = 0, is_open = 0;

		number++;
		while (code == PSR_OK && (word = next_word(&at, &is_open)) != NULL) {
			column = (int)(word - line) + 1;
			code = take_word(cli, word, is_open, &why);
			n_words++;
		}
		if (code == PSR_OK && n_words > 0 && on_line != NULL) {
			column = 1;
			code = on_line(userdata, &why);
		}
		if (code != PSR_OK)
			return psr_fail(err, code, "%.200s, line %d, column %d: %.300s", path, number, column, why.text);
	}
	return code;
}
