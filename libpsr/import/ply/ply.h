/* PLY, as its inventor's notes describe it (G. Turk, "The PLY Polygon File Format", 1994) and as programs write it: the
 * header, the values and rows of its elements. Shared by the ply*.c alone. Names refer to the bytes of the file, which
 * outlive all of it. */
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
	unsigned line;                      /* where the header speaks of it */
	unsigned first_property, n_properties;
};

struct ply_header {
	enum ply_format format;
	unsigned n_elements, n_properties;
	struct ply_element element[PLY_MAX_ELEMENTS];
	struct ply_property property[PLY_MAX_PROPERTIES];
	struct ply_name texture;            /* of "comment TextureFile NAME"; n is 0 if there is none */
	size_t body;                        /* where the rows begin */
	unsigned odd_line;                  /* the first one that begins with no word of a header, and is passed over;
	                                     * or 0 */
};

/* Elements and properties of one element have names of their own, and the file is long enough for as many rows as are
 * spoken of if every list is empty. FORMAT with the line, UNSUPPORTED for another version, LIMIT. */
int ply_header_read(struct ply_header *header, const char *path, const uint8_t *bytes, size_t n_bytes,
                    struct psr_error *err);

int ply_name_is(const struct ply_name *name, const char *text);
size_t ply_type_size(enum ply_type type);

/* value.c: where reading stands. */
struct ply_cursor {
	const uint8_t *start, *at, *end;
	enum ply_format format;
	locale_t locale; /* "C" */
};

/* The next value as a double, which any type fits in; 0 if the file ends, or if its text is no number. */
int ply_value(struct ply_cursor *cursor, enum ply_type type, double *x);

/* Passes over n values, without looking at what text says; 0 if the file ends before. */
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
	uint64_t at;                     /* the row that is read next */
	double scalar[PLY_MAX_PROPERTIES]; /* of the row read last, a property of the element; 0 for lists */
	struct ply_list list[PLY_LISTS]; /* what is to be kept of lists */
};

int ply_rows_init(struct ply_rows *rows, const char *path, const struct ply_header *header, const uint8_t *bytes,
                  size_t n_bytes, struct psr_error *err);
void ply_rows_fini(struct ply_rows *rows);

/* From here on rows of this element are read, which begins where the cursor stands. Keeps no list. */
void ply_rows_begin(struct ply_rows *rows, const struct ply_element *element);
int ply_rows_next(struct ply_rows *rows, struct psr_error *err);
int ply_rows_skip(struct ply_rows *rows, struct psr_error *err); /* all that are left */

/* FORMAT, with the place: "PATH: line 12: face 3 ..." (the row read last). */
int ply_rows_fail(const struct ply_rows *rows, struct psr_error *err, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* The element of this name, or NULL. The property of the current element with the first of these names (NULL at the
 * end) that it has, or -1. */
const struct ply_element *ply_find_element(const struct ply_header *header, const char *name);
int ply_find_property(const struct ply_header *header, const struct ply_element *element, const char *const *names);

/* vertex.c: the rows of "vertex". Colors, of vertices and of faces, are linear. */
struct ply_colors {
	int property[4]; /* red, green, blue, alpha; -1 where there is none */
	double scale[4]; /* what makes 255 the largest code, or 0 where a value is linear already */
};

struct ply_vertices {
	uint32_t n;
	double (*position)[3];
	float (*normal)[3], (*uv)[2], (*color)[4]; /* NULL where the file has none */
};

int ply_vertices_read(struct ply_vertices *vertices, struct ply_rows *rows, struct psr_error *err);
void ply_vertices_fini(struct ply_vertices *vertices);
int ply_vertices_are_one_color(const struct ply_vertices *vertices); /* 0 if they have none */

/* 0 if the element has no colors. */
int ply_colors_find(struct ply_colors *colors, const struct ply_header *header, const struct ply_element *element);
void ply_colors_get(float out[4], const struct ply_colors *colors, const struct ply_rows *rows);

/* face.c: the rows of "face" and "tristrips", as triangles of `material`. */
int ply_faces_read(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                   uint32_t material, struct psr_error *err);
int ply_strips_read(struct import_mesh *im, struct ply_rows *rows, const struct ply_vertices *vertices,
                    uint32_t material, struct psr_error *err);

#endif
