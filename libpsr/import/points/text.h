/* Points as lines of numbers: XYZ and other tables, PTS, PTX.
 *
 * Blanks, commas and semicolons are between numbers; a line whose commas can only be decimal ones is refused. Lines
 * that begin with # or // and empty ones are passed over, but the last such line before the points may name the columns, as
 * may a line that begins with a letter: x y z, r g b or red green blue, i or intensity, nx ny nz, in capitals, too;
 * other columns are passed over. Without names
 *
 *   3 columns are x y z;  4: and intensity;  6: and red green blue, or a normal if all of the first thousand are of
 *   unit length;  7: x y z intensity red green blue;  9: x y z red green blue nx ny nz;  10: x y z intensity red green
 *   blue nx ny nz;  others: x y z first, the rest is passed over.
 *
 * Colours are codes of 0..255, or of 0..1 if none is larger, or of 0..65535 if any is above 255.
 *
 * PTS has a line with the number of points first, before each scan. PTX has ten lines before each scan: columns, rows,
 * the scanner's place and axes in four lines, a matrix in four; a point at 0 0 0 is a ray that met nothing. */
#ifndef PSR_IMPORT_POINTS_TEXT_H
#define PSR_IMPORT_POINTS_TEXT_H

#include <locale.h>
#include "feed.h"
#include "gray.h"
#include "octree/build/build.h"

enum text_kind { TEXT_XYZ, TEXT_PTS, TEXT_PTX };

/* part: points of a reading, more or less, in runs of lines that are evenly spread over the file; 0: all. PTS and PTX
 * are read whole. */
int text_points_open(struct octree_source *out, const char *path, enum text_kind kind, uint64_t part,
                     struct psr_error *err);
void text_points_close(struct octree_source *source);

/* Returns whether a file begins like a table of points: its first line of points has three numbers. n_bytes of it. */
int text_looks_like_points(const uint8_t *bytes, size_t n_bytes);

/* ---- within the reader ---- */

#define TEXT_MOST_COLUMNS 64

enum text_role {
	TEXT_X, TEXT_Y, TEXT_Z, TEXT_INTENSITY, TEXT_RED, TEXT_GREEN, TEXT_BLUE, TEXT_NX, TEXT_NY, TEXT_NZ, TEXT_ROLES
};

struct text_row {
	unsigned n; /* numbers; those above TEXT_MOST_COLUMNS are not read */
	double value[TEXT_MOST_COLUMNS];
};

struct text_points {
	struct feed feed;
	enum text_kind kind;
	locale_t locale;
	uint64_t line, n_read;              /* the last line's number, points read since the beginning */
	uint64_t first, first_line;         /* of the first line of points, or of a scan: its byte, lines before it */
	uint64_t step, run;                 /* of so many runs of bytes, one is read, 1: all; the run that is read */
	uint64_t left, promised, promised_line; /* PTS, PTX: points of this scan */
	double matrix[3][4];                /* PTX: rows give x, y, z */
	unsigned n_columns, n_needed;       /* of the first row; numbers that every row has at least */
	int column[TEXT_ROLES];             /* -1: none */
	int has_names, may_be_normals;      /* of six columns without names */
	double color_scale, largest;        /* of colours: to codes; the largest one */
	struct gray gray;
};

/* text_columns.c: reads up to the first line of points, names its columns, and stays before it. FORMAT. */
int text_find_columns(struct text_points *t, struct psr_error *err);

/* Reads all points for the scales of their colours, if they have any. */
int text_find_colors(struct text_points *t, struct psr_error *err);

/* text_line.c: splits a line. Returns PSR_OK, or FORMAT with the first word that is not a number. */
int text_split(struct text_row *row, const struct text_points *t, const uint8_t *line, size_t n, struct psr_error *err);
/* The next line that is neither empty nor a comment; *line is NULL behind the last one. */
int text_next_line(struct text_points *t, const uint8_t **line, size_t *n, struct psr_error *err);
int text_is_comment(const uint8_t *line, size_t n); /* or empty */
/* Takes the next word of a line; returns its length, 0 at the end. */
size_t text_word(const uint8_t **word, const uint8_t **at, const uint8_t *end);
int text_fail(const struct text_points *t, struct psr_error *err, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* text_points.c: goes to the first point; reads the next one's row, with x, y and z in common coordinates. *is_there is 0
 * behind the last one. */
void text_rewind(struct text_points *t);
int text_next(struct text_points *t, struct text_row *row, int *is_there, struct psr_error *err);

#endif
