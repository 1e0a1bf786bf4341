/* PLY (G. Turk, "The PLY Polygon File Format", 1994), with the extensions that programs write: header, values and rows
 * of elements. Names point into the bytes of the file, which outlive these structs. */
#ifndef PSR_IMPORT_PLY_PLY_H
#define PSR_IMPORT_PLY_PLY_H

#include "import/import.h"

#define PLY_MAX_ELEMENTS 64
#define PLY_MAX_PROPERTIES 1024 /* of all elements */

enum ply_format { PLY_NO_FORMAT, PLY_ASCII, PLY_LITTLE, PLY_BIG };

enum ply_type {
	PLY_NO_TYPE, PLY_INT8, PLY_UINT8, PLY_INT16, PLY_UINT16, PLY_INT32, PLY_UINT32, PLY_FLOAT, PLY_DOUBLE
};

struct ply_name {
	const char *at; /* within the file; no NUL at the end */
	size_t n;
};

struct ply_property {
	struct ply_name name;
	enum ply_type type;       /* of the value, or of a list's items */
	enum ply_type count_type; /* an integer's; PLY_NO_TYPE: not a list */
};

struct ply_element {
	struct ply_name name;
	uint64_t n_rows;
	unsigned line;                      /* of the header */
	unsigned first_property, n_properties;
};

struct ply_header {
	enum ply_format format;
	unsigned n_elements, n_properties;
	struct ply_element element[PLY_MAX_ELEMENTS];
	struct ply_property property[PLY_MAX_PROPERTIES];
	struct ply_name texture;            /* of "comment TextureFile NAME"; n is 0 if there is none */
	size_t body;                        /* where the rows begin */
	unsigned n_lines;
	unsigned odd_line;                  /* the first line with an unknown first word, or 0; skipped */
};

/* Reads the header from the first n_bytes of a file of n_file. Ensures that names of elements, and of an element's
 * properties, are unique, and that the file has room for all rows if every list is empty. FORMAT with the line,
 * UNSUPPORTED for another version, LIMIT. */
int ply_header_read(struct ply_header *header, const char *path, const uint8_t *bytes, size_t n_bytes, uint64_t n_file,
                    struct psr_error *err);

int ply_name_is(const struct ply_name *name, const char *text);
size_t ply_type_size(enum ply_type type);

/* value.c: values. */
struct ply_cursor {
	const uint8_t *start, *at, *end;
	uint64_t bytes_before, lines_before; /* of the file, before `start` */
	enum ply_format format;
	locale_t locale; /* "C" */
};

/* Reads the next value as a double, which holds any type; returns 0 at the end of the file or for text that is not a
 * number. */
int ply_value(struct ply_cursor *cursor, enum ply_type type, double *x);

/* Skips n values, text unread; returns 0 if the file ends before. */
int ply_skip(struct ply_cursor *cursor, enum ply_type type, uint64_t n);

/* row.c: rows. */
enum { PLY_LIST_INDEX, PLY_LIST_UV, PLY_LISTS };

struct ply_list {
	int property; /* within the element; -1: none */
	double *item;
	uint64_t n, capacity;
};

struct ply_rows {
	const char *path; /* for error texts */
	const struct ply_header *header;
	const struct ply_element *element;
	struct ply_cursor cursor;
	uint64_t at;                     /* the next row */
	double scalar[PLY_MAX_PROPERTIES]; /* the last row's properties; 0 for lists */
	struct ply_list list[PLY_LISTS]; /* the lists to keep */
};

int ply_rows_init(struct ply_rows *rows, const char *path, const struct ply_header *header, const uint8_t *bytes,
                  size_t n_bytes, struct psr_error *err);
void ply_rows_fini(struct ply_rows *rows);

/* Begins an element, whose rows begin at the cursor. Keeps no list yet. */
void ply_rows_begin(struct ply_rows *rows, const struct ply_element *element);
int ply_rows_next(struct ply_rows *rows, struct psr_error *err);
int ply_rows_skip(struct ply_rows *rows, struct psr_error *err); /* the remaining rows */

/* Returns the line ends from `start` to `at`. */
uint64_t ply_count_lines(const struct ply_cursor *cursor);

/* FORMAT, with the place of the last row: "PATH: line 12: face 3 ...". */
int ply_rows_fail(const struct ply_rows *rows, struct psr_error *err, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Find an element by name, or NULL; and a property of it by the first matching name (NULL ends the list), or -1. */
const struct ply_element *ply_find_element(const struct ply_header *header, const char *name);
int ply_find_property(const struct ply_header *header, const struct ply_element *element, const char *const *names);

/* vertex.c: the rows of "vertex". Colors, of vertices and of faces, are linear. */
struct ply_colors {
	int property[4]; /* red, green, blue, alpha; -1: none */
	double scale[4]; /* maps the largest code to 255; 0: values are linear already */
};

struct ply_vertices {
	uint32_t n;
	double (*position)[3];
	float (*normal)[3], (*uv)[2], (*color)[4]; /* NULL if the file has none */
};

int ply_vertices_read(struct ply_vertices *vertices, struct ply_rows *rows, struct psr_error *err);
void ply_vertices_fini(struct ply_vertices *vertices);
int ply_vertices_are_one_color(const struct ply_vertices *vertices); /* 0 without colors */

/* Returns 0 if the element has no colors. */
int ply_colors_find(struct ply_colors *colors, const struct ply_header *header, const struct ply_element *element);
void ply_colors_get(float out[4], const struct ply_colors *colors, const struct ply_rows *rows);

/* face.c: reads the rows of "face" and "tristrips" as triangles of `material`. */
int ply_faces_read(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                   uint32_t material, struct psr_error *err);
int ply_strips_read(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                    uint32_t material, struct psr_error *err);

#endif
