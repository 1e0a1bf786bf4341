/* PCD, the files of the Point Cloud Library (pointclouds.org, "The PCD file format", 0.7): header and values. Names
 * point into the bytes of the file. */
#ifndef PSR_IMPORT_CLOUD_PCD_H
#define PSR_IMPORT_CLOUD_PCD_H

#include "cloud.h"

#define PCD_MAX_FIELDS 256

enum pcd_data { PCD_ASCII, PCD_BINARY, PCD_COMPRESSED };

struct pcd_field {
	const uint8_t *name;
	size_t name_length;
	char type;            /* 'F', 'I' or 'U' */
	unsigned size, count; /* bytes of a value: 1, 2, 4 or 8, a float's 4 or 8; values a point, 1 at least */
	uint64_t column;      /* values of a point before the field */
	uint64_t offset;      /* bytes of a point before the field */
};

struct pcd {
	const char *path;
	const uint8_t *bytes;             /* n_there of the file's n_bytes: the header at least */
	uint64_t n_there, n_bytes, most;  /* most: a limit of points */
	uint64_t body, n_points;          /* body: where the points begin */
	uint64_t columns, record;         /* values and bytes of a point */
	unsigned n_fields, data_line;     /* data_line: of the header, which is its last one */
	enum pcd_data data;
	int has_viewpoint;                /* another one than the origin */
	struct pcd_field field[PCD_MAX_FIELDS];
};

/* Reads the header; path, bytes, n_there, n_bytes and most are set. Ensures that there is a point, and room for all points in the file
 * unless they are compressed. FORMAT with the line, LIMIT, MEMORY. */
int pcd_header_read(struct pcd *pcd, struct psr_error *err);

/* Finds a field by its name, in small letters. NULL if there is none. */
const struct pcd_field *pcd_find(const struct pcd *pcd, const char *name);

#endif
