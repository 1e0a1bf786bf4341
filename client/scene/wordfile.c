#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "client/optlist.h"

#define MAX_BYTES (16u << 20)

static int read_all(char **text, const char *path, struct psr_error *err)
{
	FILE *file = fopen(path, "rb");
	size_t n = 0, capacity = 0;
	int reason = 0;

	if (file == NULL)
		return psr_fail(err, errno == ENOENT || errno == ENOTDIR ? PSR_ERR_NOT_FOUND : PSR_ERR_IO,
		                "cannot read %.300s: %s", path, strerror(errno));
	do {
		char *grown;

		if (capacity == MAX_BYTES) {
			fclose(file);
			return psr_fail(err, PSR_ERR_LIMIT, "%.300s has more than %u MB", path, MAX_BYTES >> 20);
		}
		capacity = capacity == 0 ? 4096 : 2 * capacity;
		grown = realloc(*text, capacity + 1);
		if (grown == NULL) {
			fclose(file);
			return psr_fail(err, PSR_ERR_MEMORY, "no memory to read %.300s", path);
		}
		*text = grown;
		errno = 0;
		n += fread(*text + n, 1, capacity - n, file);
	} while (n == capacity);
	if (ferror(file))
		reason = errno != 0 ? errno : EIO;
	fclose(file);
	if (reason != 0)
		return psr_fail(err, PSR_ERR_IO, "cannot read %.300s: %s", path, strerror(reason));
	(*text)[n] = '\0';
	if (strlen(*text) != n)
		return psr_fail(err, PSR_ERR_ARG, "%.300s is no text: it has a byte 0", path);
	return PSR_OK;
}

/* The next word, its quotes taken out, ended by a NUL; *at behind it. NULL: the line has no more. */
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
	int code = read_all(text, path, err), number = 0;
	char *rest = *text;

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
