#include <ctype.h>
#include <string.h>
#include "hide.h"

/* A path begins at the text's beginning or after a blank, a quote or a bracket. */
static int is_before_path(char c)
{
	return isspace((unsigned char)c) || strchr("'\"`([<=:,", c) != NULL;
}

static size_t match_folder(const char *at, const char *folder)
{
	size_t n = strlen(folder);

	while (n > 0 && folder[n - 1] == '/')
		n--;
	return n > 0 && strncmp(at, folder, n) == 0 && at[n] == '/' ? n + strspn(at + n, "/") : 0;
}

/* Returns how many bytes of an absolute path name its folders: up to its last slash before a blank or the end. */
static size_t match_absolute(const char *at)
{
	size_t n = 0;

	if (at[0] != '/' || at[1] == '/' || isspace((unsigned char)at[1]) || at[1] == '\0')
		return 0;
	for (size_t i = 0; at[i] != '\0' && !isspace((unsigned char)at[i]); i++)
		if (at[i] == '/')
			n = i + 1;
	return n;
}

void hide_paths(char *text, const char *const *folder, size_t n_folders)
{
	char *to = text;

	for (const char *at = text; *at != '\0';) {
		size_t n = 0;

		if (at == text || is_before_path(at[-1])) {
			for (size_t i = 0; n == 0 && i < n_folders; i++)
				n = match_folder(at, folder[i]);
			if (n == 0)
				n = match_absolute(at);
		}
		at += n;
		if (*at != '\0')
			*to++ = *at++;
	}
	*to = '\0';
}
