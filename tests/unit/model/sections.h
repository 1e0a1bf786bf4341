/* Sections of a file in memory, to change them. After cmocka.h. */
#ifndef TESTS_UNIT_MODEL_SECTIONS_H
#define TESTS_UNIT_MODEL_SECTIONS_H

#include <stdlib.h>
#include <string.h>
#include "model/file.h"

/* Returns the entry of a section in the directory; fails the test if there is none. */
static inline uint8_t *entry_of(uint8_t *bytes, const char *type)
{
	for (uint32_t i = 0; i < file_get(bytes + HEADER_N_SECTIONS, 4); i++)
		if (memcmp(bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i, type, 4) == 0)
			return bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;
	fail_msg("no section %s", type);
	return NULL;
}

/* Returns the model's file, of n bytes; the caller frees it. */
static inline uint8_t *copy_of(const struct psr_model *model, size_t *n)
{
	const uint8_t *image = model_image(model, n);
	uint8_t *copy = malloc(*n);

	memcpy(copy, image, *n);
	return copy;
}

/* From an allocation of exactly that size, so that the address sanitizer sees every step beyond it. */
static inline int parse_exact(struct psr_model **model, const uint8_t *bytes, size_t n, struct psr_error *err)
{
	uint8_t *exact = malloc(n > 0 ? n : 1);
	int code;

	memcpy(exact, bytes, n);
	*model = NULL;
	code = psr_model_parse(model, exact, n, err);
	assert_true((code == PSR_OK) == (*model != NULL));
	free(exact);
	return code;
}

#endif
