/* An image during reading: read_table.c reads what all sections have in common, read.c what is in them. */
#ifndef PSR_MODEL_READ_H
#define PSR_MODEL_READ_H

#include <inttypes.h>
#include "file.h"

struct reader {
	const uint8_t *bytes;
	uint64_t n_bytes, file_size, table_end;
	uint32_t n_sections;
	const char *name; /* of the file, for errors */
	struct psr_error *err;
	int entry[N_KNOWN_SECTIONS]; /* index in the file's table, -1 if absent */
};

#define bad(r, format, ...) psr_fail((r)->err, PSR_ERR_FORMAT, "%s: " format, (r)->name, ##__VA_ARGS__)

struct section {
	char type[5]; /* printable */
	const uint8_t *raw_type;
	uint32_t version, flags;
	uint64_t offset, length, hash;
};

/* Entry `index` of the table, below n_sections. */
struct section read_section(const struct reader *r, uint32_t index);

/* Checks header, places and hashes, and fills r->entry. r has bytes, n_bytes, name and err. FORMAT, VERSION, and
 * UNSUPPORTED where an unknown section is required. */
int read_table(struct reader *r, struct psr_pool *pool);

#endif
