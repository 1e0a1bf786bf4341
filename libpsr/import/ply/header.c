#include <stdio.h>
#include <string.h>
#include "ply.h"

#define MAX_WORDS 8
#define SHOWN 60 /* characters of a name in an error text */

struct text {
	const char *path;
	const uint8_t *at, *end;
	unsigned line;
	int crlf_is_one; /* the first line ends in CR LF or LF; after a lone CR, LF may begin a binary body */
};

struct line {
	unsigned n_words;
	struct ply_name word[MAX_WORDS];
	struct ply_name rest[MAX_WORDS]; /* from word i to the end of the line */
};

#define fail(t, err, code, format, ...) \
	psr_fail(err, code, "%s: line %u: " format, (t)->path, (t)->line, ##__VA_ARGS__)

int ply_name_is(const struct ply_name *name, const char *text)
{
	return strlen(text) == name->n && memcmp(name->at, text, name->n) == 0;
}

size_t ply_type_size(enum ply_type type)
{
	static const size_t size[] = { 0, 1, 1, 2, 2, 4, 4, 4, 8 };

	return size[type];
}

static int shown(const struct ply_name *name)
{
	return (int)(name->n < SHOWN ? name->n : SHOWN);
}

static int is_blank(uint8_t c)
{
	return c == ' ' || c == '\t';
}

/* Returns 0 at the end of the file; the last line of a header has a line end. */
static int next_line(struct text *t, struct line *line)
{
	const uint8_t *p = t->at, *end;

	while (p < t->end && *p != '\n' && *p != '\r')
		p++;
	if (p == t->end)
		return 0;
	end = p;
	if (t->line == 0)
		t->crlf_is_one = *p == '\n' || (p + 1 < t->end && p[1] == '\n');
	p += *p == '\r' && t->crlf_is_one && p + 1 < t->end && p[1] == '\n' ? 2 : 1;
	line->n_words = 0;
	for (const uint8_t *q = t->at; q < end;) {
		const uint8_t *word;

		while (q < end && is_blank(*q))
			q++;
		for (word = q; q < end && !is_blank(*q);)
			q++;
		if (q > word && line->n_words < MAX_WORDS) {
			line->word[line->n_words] = (struct ply_name){ (const char *)word, (size_t)(q - word) };
			line->rest[line->n_words++] = (struct ply_name){ (const char *)word, (size_t)(end - word) };
		}
	}
	t->at = p;
	t->line++;
	return 1;
}

static int parse_count(const struct ply_name *word, uint64_t *x)
{
	*x = 0;
	for (size_t i = 0; i < word->n; i++) {
		if (word->at[i] < '0' || word->at[i] > '9')
			return 0;
		*x = *x > UINT64_MAX / 10 - 1 ? *x : *x * 10 + (uint64_t)(word->at[i] - '0');
	}
	return word->n > 0;
}

static enum ply_type parse_type(const struct ply_name *word)
{
	static const struct {
		const char *name;
		enum ply_type type;
	} types[] = {
		{ "char", PLY_INT8 },    { "int8", PLY_INT8 },     { "uchar", PLY_UINT8 },   { "uint8", PLY_UINT8 },
		{ "short", PLY_INT16 },  { "int16", PLY_INT16 },   { "ushort", PLY_UINT16 }, { "uint16", PLY_UINT16 },
		{ "int", PLY_INT32 },    { "int32", PLY_INT32 },   { "uint", PLY_UINT32 },   { "uint32", PLY_UINT32 },
		{ "float", PLY_FLOAT },  { "float32", PLY_FLOAT }, { "double", PLY_DOUBLE }, { "float64", PLY_DOUBLE },
	};

	for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
		if (ply_name_is(word, types[i].name))
			return types[i].type;
	return PLY_NO_TYPE;
}

static int read_format(struct ply_header *h, const struct text *t, const struct line *l, struct psr_error *err)
{
	if (h->format != PLY_NO_FORMAT)
		return fail(t, err, PSR_ERR_FORMAT, "a second format");
	if (l->n_words == 3 && !ply_name_is(&l->word[2], "1.0"))
		return fail(t, err, PSR_ERR_UNSUPPORTED, "PLY version %.*s is not supported; 1.0 is",
		            shown(&l->word[2]), l->word[2].at);
	if (l->n_words == 3 && ply_name_is(&l->word[1], "ascii"))
		h->format = PLY_ASCII;
	else if (l->n_words == 3 && ply_name_is(&l->word[1], "binary_little_endian"))
		h->format = PLY_LITTLE;
	else if (l->n_words == 3 && ply_name_is(&l->word[1], "binary_big_endian"))
		h->format = PLY_BIG;
	else
		return fail(t, err, PSR_ERR_FORMAT,
		            "the format is not ascii, binary_little_endian or binary_big_endian 1.0");
	return PSR_OK;
}

static int read_element(struct ply_header *h, const struct text *t, const struct line *l, struct psr_error *err)
{
	struct ply_element *e = &h->element[h->n_elements];

	if (h->n_elements == PLY_MAX_ELEMENTS)
		return fail(t, err, PSR_ERR_LIMIT, "more than %d elements", PLY_MAX_ELEMENTS);
	if (l->n_words != 3 || !parse_count(&l->word[2], &e->n_rows))
		return fail(t, err, PSR_ERR_FORMAT, "expected \"element NAME COUNT\"");
	for (unsigned i = 0; i < h->n_elements; i++)
		if (h->element[i].name.n == l->word[1].n && memcmp(h->element[i].name.at, l->word[1].at, l->word[1].n) == 0)
			return fail(t, err, PSR_ERR_FORMAT, "a second element \"%.*s\"", shown(&l->word[1]), l->word[1].at);
	e->name = l->word[1];
	e->line = t->line;
	e->first_property = h->n_properties;
	e->n_properties = 0;
	h->n_elements++;
	return PSR_OK;
}

static int read_property(struct ply_header *h, const struct text *t, const struct line *l, struct psr_error *err)
{
	const int is_list = l->n_words > 1 && ply_name_is(&l->word[1], "list");
	const unsigned n_words = is_list ? 5 : 3;
	struct ply_property *p = &h->property[h->n_properties];
	struct ply_element *e;

	if (h->n_elements == 0)
		return fail(t, err, PSR_ERR_FORMAT, "a property before any element");
	if (h->n_properties == PLY_MAX_PROPERTIES)
		return fail(t, err, PSR_ERR_LIMIT, "more than %d properties", PLY_MAX_PROPERTIES);
	if (l->n_words != n_words)
		return fail(t, err, PSR_ERR_FORMAT, "expected \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
	for (unsigned i = is_list ? 2 : 1; i + 1 < n_words; i++)
		if (parse_type(&l->word[i]) == PLY_NO_TYPE)
			return fail(t, err, PSR_ERR_FORMAT, "\"%.*s\" is not a type of PLY (char, uchar, ..., double)",
			            shown(&l->word[i]), l->word[i].at);
	p->count_type = is_list ? parse_type(&l->word[2]) : PLY_NO_TYPE;
	p->type = parse_type(&l->word[n_words - 2]);
	p->name = l->word[n_words - 1];
	if (p->count_type >= PLY_FLOAT)
		return fail(t, err, PSR_ERR_FORMAT, "the length of a list is not an integer");
	e = &h->element[h->n_elements - 1];
	for (unsigned i = e->first_property; i < h->n_properties; i++)
		if (h->property[i].name.n == p->name.n && memcmp(h->property[i].name.at, p->name.at, p->name.n) == 0)
			return fail(t, err, PSR_ERR_FORMAT, "a second property \"%.*s\" of \"%.*s\"",
			            shown(&p->name), p->name.at, shown(&e->name), e->name.at);
	h->n_properties++;
	e->n_properties++;
	return PSR_OK;
}

/* Returns the least bytes of a row; in text, a value takes a digit and a blank. */
static uint64_t least_row(const struct ply_header *h, const struct ply_element *e)
{
	uint64_t n = 0;

	for (unsigned i = e->first_property; i < e->first_property + e->n_properties; i++) {
		const struct ply_property *p = &h->property[i];

		n += h->format == PLY_ASCII ? 2 : ply_type_size(p->count_type != PLY_NO_TYPE ? p->count_type : p->type);
	}
	return n;
}

/* Divides, so that no product overflows. Adds a byte for text that ends without a newline. */
static int check_counts(const struct ply_header *h, const char *path, uint64_t n_bytes, struct psr_error *err)
{
	uint64_t left = n_bytes - h->body + (h->format == PLY_ASCII);

	for (unsigned i = 0; i < h->n_elements; i++) {
		const struct ply_element *e = &h->element[i];
		uint64_t least = least_row(h, e);

		if (least == 0)
			continue;
		if (e->n_rows > left / least)
			return psr_fail(
				err, PSR_ERR_FORMAT,
				"%s: line %u: the header promises %llu elements \"%.*s\", but the file has only %llu bytes "
				"for them; is it cut short?",
				path, e->line, (unsigned long long)e->n_rows, shown(&e->name), e->name.at,
				(unsigned long long)(n_bytes - h->body));
		left -= e->n_rows * least;
	}
	return PSR_OK;
}

static int read_line(struct ply_header *h, const struct text *t, const struct line *l, struct psr_error *err)
{
	if (l->n_words == 0 || ply_name_is(&l->word[0], "obj_info"))
		return PSR_OK;
	if (ply_name_is(&l->word[0], "comment")) {
		if (l->n_words >= 3 && h->texture.n == 0 && ply_name_is(&l->word[1], "TextureFile"))
			h->texture = l->rest[2];
		return PSR_OK;
	}
	if (ply_name_is(&l->word[0], "format"))
		return read_format(h, t, l, err);
	if (ply_name_is(&l->word[0], "element"))
		return read_element(h, t, l, err);
	if (ply_name_is(&l->word[0], "property"))
		return read_property(h, t, l, err);
	/* A comment without its keyword, as Blender once wrote. A misspelt keyword becomes apparent later, when something
	 * is missing. */
	if (h->odd_line == 0)
		h->odd_line = t->line;
	return PSR_OK;
}

int ply_header_read(struct ply_header *h, const char *path, const uint8_t *bytes, size_t n_bytes, uint64_t n_file,
                    struct psr_error *err)
{
	struct text t = { path, bytes, bytes + n_bytes, 0, 0 };
	struct line l;
	int rc;

	memset(h, 0, sizeof *h);
	if (!next_line(&t, &l) || l.n_words != 1 || !ply_name_is(&l.word[0], "ply"))
		return psr_fail(err, PSR_ERR_FORMAT, "%s: does not begin with a line \"ply\"", path);
	while (next_line(&t, &l)) {
		if (l.n_words != 1 || !ply_name_is(&l.word[0], "end_header")) {
			rc = read_line(h, &t, &l, err);
			if (rc != PSR_OK)
				return rc;
			continue;
		}
		if (h->format == PLY_NO_FORMAT)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: line %u: the header ends without a format", path, t.line);
		h->body = (size_t)(t.at - bytes);
		h->n_lines = t.line;
		return check_counts(h, path, n_file, err);
	}
	return psr_fail(err, PSR_ERR_FORMAT, "%s: the PLY header has no end_header%s; is the file cut short?", path,
	                n_bytes < n_file ? " in the first megabyte" : "");
}
