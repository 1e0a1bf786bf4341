/* Names of numbered files, and contact sheets. */
#ifndef PSR_CLIENT_OUTPUT_OUTPUT_H
#define PSR_CLIENT_OUTPUT_OUTPUT_H

#include <limits.h>
#include "client/lib/picture.h"
#include "psr/client.h"

#define OUTPUT_STDOUT "-"

/* Returns whether a name numbers its files by %d or %03d. ARG: it has another % than these and %%, or two numbers. */
int output_is_numbered(int *is_numbered, const char *name, struct psr_error *err);

/* Makes the name of file `number`. LIMIT: it is too long. */
int output_name(char path[PATH_MAX], const char *name, uint32_t number, struct psr_error *err);

/* Reads "4x3" of --sheet. ARG. */
struct sheet {
	uint32_t columns, rows; /* 0: no sheet */
	struct psr_frame picture;
};
int sheet_check(const struct sheet *sheet, uint32_t n_pictures, uint32_t width, uint32_t height, struct psr_error *err);

/* Puts picture k (from 0) into its place; the first one makes the sheet, with this background. MEMORY. */
int sheet_add(struct sheet *sheet, uint32_t k, const struct psr_frame *picture, const uint8_t background[3],
              struct psr_error *err);
void sheet_fini(struct sheet *sheet);

#endif
