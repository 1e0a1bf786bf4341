#define _GNU_SOURCE
#include <ctype.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include "parts.h"

#define MAX_JSON (64u << 20) /* a longer glTF text holds its buffers itself */
#define MAX_HEAD (64u << 10) /* read of a PLY or OBJ, which name files at their beginning */
#define MAX_MTL (1u << 20)
#define MAX_SEEN 4096

struct search {
	struct parts *parts;
	char folder[PATH_MAX];
	struct {
		dev_t device;
		ino_t inode;
	} seen[MAX_SEEN];
	uint32_t n_seen;
};

/* Reads up to n bytes from `offset` on, and adds a NUL; NULL on failure. */
static char *read_text(const char *path, uint64_t offset, size_t n, size_t *n_read)
{
	FILE *file = fopen(path, "rbe");
	char *text = NULL;
	struct stat status;

	if (file != NULL && fstat(fileno(file), &status) == 0 && S_ISREG(status.st_mode) &&
	    offset <= (uint64_t)status.st_size && fseeko(file, (off_t)offset, SEEK_SET) == 0) {
		if (n > (uint64_t)status.st_size - offset)
			n = (size_t)((uint64_t)status.st_size - offset);
		text = malloc(n + 1);
		if (text != NULL) {
			*n_read = fread(text, 1, n, file);
			text[*n_read] = '\0';
		}
	}
	if (file != NULL)
		fclose(file);
	return text;
}

/* Returns whether the file exists; adds its size the first time. */
static int add_file(struct search *s, const char *name)
{
	char path[PATH_MAX];
	struct stat status;

	if (name[0] == '\0' || name[0] == '/' || strstr(name, "..") != NULL ||
	    snprintf(path, sizeof path, "%s/%s", s->folder, name) >= (int)sizeof path || stat(path, &status) != 0 ||
	    !S_ISREG(status.st_mode))
		return 0;
	for (uint32_t i = 0; i < s->n_seen; i++)
		if (s->seen[i].device == status.st_dev && s->seen[i].inode == status.st_ino)
			return 1;
	if (s->n_seen == MAX_SEEN)
		return 1;
	s->seen[s->n_seen].device = status.st_dev;
	s->seen[s->n_seen++].inode = status.st_ino;
	s->parts->bytes += (uint64_t)status.st_size;
	return 1;
}

static int digit(char c)
{
	return c >= '0' && c <= '9' ? c - '0' : tolower((unsigned char)c) - 'a' + 10;
}

/* Decodes the escapes of a URI in place. */
static void add_uri(struct search *s, char *uri)
{
	char *to = uri;

	for (const char *at = uri; *at != '\0'; at++) {
		if (at[0] == '%' && isxdigit((unsigned char)at[1]) && isxdigit((unsigned char)at[2])) {
			*to++ = (char)(digit(at[1]) * 16 + digit(at[2]));
			at += 2;
		} else if (at[0] == '\\' && at[1] == '/') {
			*to++ = *++at;
		} else {
			*to++ = *at;
		}
	}
	*to = '\0';
	add_file(s, uri);
}

/* Finds every "uri": "..." except data URIs. */
static void search_json(struct search *s, char *text)
{
	for (char *at = strstr(text, "\"uri\""), *end; at != NULL; at = strstr(at, "\"uri\"")) {
		at += strlen("\"uri\"");
		at += strspn(at, " \t\r\n");
		if (*at != ':')
			continue;
		at += 1 + strspn(at + 1, " \t\r\n");
		end = *at == '"' ? strchr(at + 1, '"') : NULL;
		if (end == NULL)
			continue;
		if (strncasecmp(at + 1, "data:", 5) != 0) {
			*end = '\0';
			s->parts->n_named++;
			add_uri(s, at + 1);
		}
		at = end + 1;
	}
}

static uint32_t u32_at(const char *bytes)
{
	uint32_t x = 0;

	for (int i = 0; i < 4; i++)
		x |= (uint32_t)(unsigned char)bytes[i] << 8 * i;
	return x;
}

static void search_gltf(struct search *s, const char *source, int is_binary)
{
	size_t n = 0, length = MAX_JSON;
	char *text;

	if (is_binary) {
		text = read_text(source, 0, 20, &n);
		length = n == 20 ? u32_at(text + 12) : 0;
		free(text);
		if (n < 20)
			return; /* not a GLB */
	}
	text = length <= MAX_JSON ? read_text(source, is_binary ? 20 : 0, length, &n) : NULL;
	if (text != NULL && n < MAX_JSON)
		search_json(s, text);
	else
		s->parts->n_named = UINT32_MAX;
	free(text);
}

/* Returns the trimmed rest of the next line of *text that starts with `word`; NULL: there is none. */
static char *next_line_with(char **text, const char *word)
{
	while (**text != '\0') {
		char *line = *text, *end = line + strcspn(line, "\r\n");

		*text = *end != '\0' ? end + 1 : end;
		*end = '\0';
		line += strspn(line, " \t");
		if (strncasecmp(line, word, strlen(word)) != 0)
			continue;
		line += strlen(word);
		line += strspn(line, " \t");
		for (end = line + strlen(line); end > line && isblank((unsigned char)end[-1]); end--)
			end[-1] = '\0';
		return line;
	}
	return NULL;
}

static void search_ply(struct search *s, const char *source)
{
	size_t n;
	char *text = read_text(source, 0, MAX_HEAD, &n), *at = text, *end, *name;

	if (text == NULL)
		return;
	end = strstr(text, "end_header");
	if (end == NULL && n == MAX_HEAD)
		s->parts->n_named = UINT32_MAX;
	else if (end != NULL)
		*end = '\0';
	while (s->parts->n_named != UINT32_MAX && (name = next_line_with(&at, "comment TextureFile")) != NULL) {
		s->parts->n_named++;
		add_file(s, name);
	}
	free(text);
}

/* Options come before a texture's name, which ends the line. */
static void search_mtl(struct search *s, const char *name)
{
	static const char *const words[] = { "map_", "bump", "disp", "norm", "refl" };
	char path[PATH_MAX];
	size_t n;

	if (snprintf(path, sizeof path, "%s/%s", s->folder, name) >= (int)sizeof path)
		return;
	for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
		char *text = read_text(path, 0, MAX_MTL, &n), *at = text, *line;

		while (text != NULL && (line = next_line_with(&at, words[i])) != NULL) {
			for (char *c = line; *c != '\0'; c++)
				*c = *c == '\\' ? '/' : *c;
			line += i == 0 ? strcspn(line, " \t") : 0; /* skips the rest of map_Kd */
			line += strspn(line, " \t");
			if (!add_file(s, line) && strrchr(line, ' ') != NULL)
				add_file(s, strrchr(line, ' ') + 1);
		}
		free(text);
	}
}

static void search_obj(struct search *s, const char *source)
{
	size_t n;
	char *text = read_text(source, 0, MAX_HEAD, &n), *at = text, *name;

	while (text != NULL && (name = next_line_with(&at, "mtllib ")) != NULL) {
		s->parts->n_named++;
		if (add_file(s, name))
			search_mtl(s, name);
	}
	free(text);
}

void parts_find(struct parts *parts, const char *source)
{
	const char *dot = strrchr(source, '.'), *slash = strrchr(source, '/');
	const int n_folder = slash != NULL ? (int)(slash - source) : 1;
	struct search *s = malloc(sizeof *s);

	*parts = (struct parts){ 0, 0 };
	if (dot == NULL)
		dot = "";
	if (s == NULL || snprintf(s->folder, sizeof s->folder, "%.*s", n_folder, slash != NULL ? source : ".") >=
	                     (int)sizeof s->folder) {
		parts->n_named = UINT32_MAX;
		free(s);
		return;
	}
	s->parts = parts;
	s->n_seen = 0;
	if (strcasecmp(dot, ".gltf") == 0 || strcasecmp(dot, ".glb") == 0)
		search_gltf(s, source, strcasecmp(dot, ".glb") == 0);
	else if (strcasecmp(dot, ".ply") == 0)
		search_ply(s, source);
	else if (strcasecmp(dot, ".obj") == 0)
		search_obj(s, source);
	free(s);
}
