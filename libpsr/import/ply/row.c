#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "ply.h"

int ply_rows_init(struct ply_rows *rows, const char *path, const struct ply_header *header, const uint8_t *bytes,
                  size_t n_bytes, struct psr_error *err)
{
	memset(rows, 0, sizeof *rows);
	rows->path = path;
	rows->header = header;
	rows->cursor = (struct ply_cursor){ .start = bytes, .at = bytes + header->body, .end = bytes + n_bytes,
		                                .format = header->format };
	rows->cursor.locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	return rows->cursor.locale == (locale_t)0 ? psr_fail(err, PSR_ERR_MEMORY, "%s: no memory", path)
	                                          : PSR_OK;
}

void ply_rows_fini(struct ply_rows *rows)
{
	for (int i = 0; i < PLY_LISTS; i++)
		free(rows->list[i].item);
	if (rows->cursor.locale != (locale_t)0)
		freelocale(rows->cursor.locale);
}

void ply_rows_begin(struct ply_rows *rows, const struct ply_element *element)
{
	rows->element = element;
	rows->at = 0;
	for (int i = 0; i < PLY_LISTS; i++)
		rows->list[i].property = -1;
}

uint64_t ply_count_lines(const struct ply_cursor *c)
{
	uint64_t n = 0;

	for (const uint8_t *p = c->start; p < c->at; p++)
		n += *p == '\n' || (*p == '\r' && p + 1 < c->end && p[1] != '\n');
	return n;
}

int ply_rows_fail(const struct ply_rows *rows, struct psr_error *err, const char *format, ...)
{
	const struct ply_cursor *c = &rows->cursor;
	const struct ply_name *name = &rows->element->name;
	char text[PSR_ERROR_TEXT], place[64];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	if (c->format == PLY_ASCII)
		snprintf(place, sizeof place, "line %llu", (unsigned long long)(c->lines_before + ply_count_lines(c) + 1));
	else
		snprintf(place, sizeof place, "byte %llu", (unsigned long long)(c->bytes_before + (uint64_t)(c->at - c->start)));
	return psr_fail(err, PSR_ERR_FORMAT, "%.300s: %s: %.*s %llu %.100s", rows->path, place,
	                (int)(name->n < 40 ? name->n : 40), name->at, (unsigned long long)(rows->at > 0 ? rows->at - 1 : 0),
	                text);
}

static int fail_value(const struct ply_rows *rows, struct psr_error *err)
{
	return rows->cursor.at == rows->cursor.end || rows->cursor.format != PLY_ASCII
	               ? ply_rows_fail(rows, err, "is cut short by the end of the file")
	               : ply_rows_fail(rows, err, "has a value that is not a number");
}

static struct ply_list *list_of(struct ply_rows *rows, int property)
{
	for (int i = 0; i < PLY_LISTS; i++)
		if (rows->list[i].property == property)
			return &rows->list[i];
	return NULL;
}

static int reserve(struct ply_list *list, uint64_t n)
{
	if (n <= list->capacity)
		return 1;
	if (!import_resize(&list->item, n, sizeof *list->item))
		return 0;
	list->capacity = n;
	return 1;
}

static int read_list(struct ply_rows *rows, const struct ply_property *p, struct ply_list *list, struct psr_error *err)
{
	struct ply_cursor *c = &rows->cursor;
	/* In text an item takes two bytes, except the last one of a file. */
	const uint64_t left = (uint64_t)(c->end - c->at) + 1;
	double count;

	if (!ply_value(c, p->count_type, &count))
		return fail_value(rows, err);
	if (!(count >= 0.0) || count != (double)(uint64_t)(count < 1e18 ? count : 0.0))
		return ply_rows_fail(rows, err, "has a list of %g items", count);
	if (count > (double)(left / (c->format == PLY_ASCII ? 2 : ply_type_size(p->type))))
		return ply_rows_fail(rows, err, "has a list of %.0f items, but the file ends before it does", count);
	if (list == NULL)
		return ply_skip(c, p->type, (uint64_t)count) ? PSR_OK : fail_value(rows, err);
	list->n = (uint64_t)count;
	if (!reserve(list, list->n))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a list of %llu items", rows->path,
		                (unsigned long long)list->n);
	for (uint64_t i = 0; i < list->n; i++)
		if (!ply_value(c, p->type, &list->item[i]))
			return fail_value(rows, err);
	return PSR_OK;
}

/* A row may take several lines, but must end at the end of a line: a missing or extra value shows at once. */
static int end_line(struct ply_rows *rows, struct psr_error *err)
{
	struct ply_cursor *c = &rows->cursor;

	while (c->at < c->end && *c->at != '\n' && *c->at != '\r') {
		if (*c->at != ' ' && *c->at != '\t')
			return ply_rows_fail(rows, err, "does not have the %u properties that the header promises",
			                     rows->element->n_properties);
		c->at++;
	}
	return PSR_OK;
}

int ply_rows_next(struct ply_rows *rows, struct psr_error *err)
{
	const struct ply_property *p = &rows->header->property[rows->element->first_property];
	int rc;

	rows->at++;
	for (unsigned i = 0; i < rows->element->n_properties; i++) {
		if (p[i].count_type == PLY_NO_TYPE) {
			if (!ply_value(&rows->cursor, p[i].type, &rows->scalar[i]))
				return fail_value(rows, err);
			continue;
		}
		rows->scalar[i] = 0.0;
		rc = read_list(rows, &p[i], list_of(rows, (int)i), err);
		if (rc != PSR_OK)
			return rc;
	}
	return rows->cursor.format == PLY_ASCII && rows->element->n_properties > 0 ? end_line(rows, err) : PSR_OK;
}

int ply_rows_skip(struct ply_rows *rows, struct psr_error *err)
{
	int rc = PSR_OK;

	if (rows->element->n_properties == 0)
		return PSR_OK;
	while (rows->at < rows->element->n_rows && rc == PSR_OK)
		rc = ply_rows_next(rows, err);
	return rc;
}

const struct ply_element *ply_find_element(const struct ply_header *header, const char *name)
{
	for (unsigned i = 0; i < header->n_elements; i++)
		if (ply_name_is(&header->element[i].name, name))
			return &header->element[i];
	return NULL;
}

int ply_find_property(const struct ply_header *header, const struct ply_element *element, const char *const *names)
{
	for (; *names != NULL; names++)
		for (unsigned i = 0; i < element->n_properties; i++)
			if (ply_name_is(&header->property[element->first_property + i].name, *names))
				return (int)i;
	return -1;
}
