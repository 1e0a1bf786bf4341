#define _GNU_SOURCE
#include "iges.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CARD 80    /* bytes of a line */
#define SECTION 72 /* of them, that come before the section's letter */
#define CONTENT 64 /* and those that are parameters of an entity; the number of its entry follows */
#define FIRST 6    /* parameters whose values are kept, with the type */
#define MANY 1000000000

/* Types whose parameter `first` counts parts, each a parameter at least, and with n = 2 the next one rows of them. */
static const struct list {
	uint64_t type;
	int first, n;
} lists[] = {
	{ 102, 1, 1 }, { 106, 2, 1 }, { 112, 4, 1 }, { 114, 3, 2 }, { 126, 1, 1 }, { 128, 1, 2 }, { 141, 4, 1 },
	{ 143, 3, 1 }, { 144, 3, 1 }, { 402, 1, 1 }, { 502, 1, 1 }, { 504, 1, 1 }, { 508, 1, 1 }, { 510, 2, 1 },
	{ 514, 1, 1 },
};

int import_iges_is(const uint8_t *bytes, size_t n_bytes)
{
	return n_bytes > CARD && bytes[SECTION] == 'S' && memcmp(bytes + SECTION + 1, "      1", 7) == 0;
}

struct entity {
	uint8_t number[SECTION - CONTENT]; /* as the file has it */
	uint64_t value[FIRST];             /* 0: no whole number, or less; at most MANY */
	uint32_t n;                        /* parameters, after the type, so far; more, if texts have delimiters */
	int is_whole[FIRST], is_over;
};

struct delimiters {
	uint8_t parameter, record;
};

/* Of the first line of section G. */
static struct delimiters find_delimiters(const uint8_t *content)
{
	struct delimiters by = { ',', ';' };
	size_t at = 0;

	if (memcmp(content, "1H", 2) == 0) {
		by.parameter = content[2];
		at = 3;
	}
	if (content[at] == by.parameter && memcmp(content + at + 1, "1H", 2) == 0)
		by.record = content[at + 3];
	return by;
}

static void add_line(struct entity *e, const uint8_t *content, struct delimiters by)
{
	for (size_t i = 0; i < CONTENT && !e->is_over; i++) {
		const uint8_t c = content[i];

		if (c == by.record) {
			e->is_over = 1;
		} else if (c == by.parameter) {
			if (++e->n < FIRST) {
				e->value[e->n] = 0;
				e->is_whole[e->n] = 1;
			}
		} else if (e->n < FIRST && c != ' ') {
			e->is_whole[e->n] &= c >= '0' && c <= '9';
			e->value[e->n] = e->value[e->n] * 10 + c % 16;
			if (e->value[e->n] > MANY)
				e->value[e->n] = MANY;
		}
	}
}

static int check_entity(const struct import_mesh *im, const struct entity *e, struct psr_error *err)
{
	for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
		const struct list *l = &lists[i];
		uint64_t parts = 1;
		int blank = 0;

		if (l->type != e->value[0] || !e->is_whole[0])
			continue;
		for (int k = l->first; k < l->first + l->n; k++)
			parts *= e->is_whole[k] && (uint32_t)k <= e->n ? e->value[k] : 0;
		while (blank + 1 < (int)sizeof e->number && (e->number[blank] == ' ' || e->number[blank] == '0'))
			blank++;
		if (parts > e->n)
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: entity D%.*s of the IGES file, of type %d, tells %llu parts by its parameter %d, and has "
			                "%u parameters; export it again", im->path, (int)sizeof e->number - blank,
			                e->number + blank, (int)l->type, (unsigned long long)parts, l->first, e->n);
	}
	return PSR_OK;
}

/* Lines of sections S, G, D and P are numbered, and the last one, T, has their numbers. */
int import_iges_check(const struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	static const char letter[] = "SGDPT";
	unsigned long long counted[5] = { 0 }, told[4];
	char last[CARD + 1] = "";
	struct delimiters by = { ',', ';' };
	struct entity entity = { .n = 0 };
	size_t at = 0;

	while (at + SECTION < n_bytes) {
		const uint8_t *end = memchr(bytes + at, '\n', n_bytes - at);
		const size_t next = end != NULL ? (size_t)(end - bytes) + 1 : n_bytes;
		const int letter_here = next - at > SECTION ? bytes[at + SECTION] : 0;
		const char *section = letter_here != 0 ? strchr(letter, letter_here) : NULL;

		if (section == NULL)
			break;
		if (*section == 'G' && counted[1] == 0)
			by = find_delimiters(bytes + at);
		if (*section == 'T' || memcmp(entity.number, bytes + at + CONTENT, sizeof entity.number) != 0) {
			const int rc = check_entity(im, &entity, err);

			if (rc != PSR_OK)
				return rc;
			entity = (struct entity){ .is_whole = { 1 } };
			memcpy(entity.number, bytes + at + CONTENT, sizeof entity.number);
		}
		if (*section == 'P')
			add_line(&entity, bytes + at, by);
		counted[section - letter]++;
		if (*section == 'T')
			snprintf(last, sizeof last, "%.*s", SECTION, (const char *)bytes + at);
		at = next;
	}
	if (counted[0] == 0)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: not an IGES file in lines of %d bytes: column %d of the first has no S", im->path, CARD,
		                SECTION + 1);
	if (counted[4] == 0)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: the IGES file ends in the middle: its last line, of section T, is missing after %zu bytes;"
		                " export it again", im->path, n_bytes);
	if (sscanf(last, "S%7llu G%7llu D%7llu P%7llu", &told[0], &told[1], &told[2], &told[3]) != 4)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the last line of the IGES file does not tell its sections' lines",
		                im->path);
	for (int i = 0; i < 4; i++)
		if (told[i] != counted[i])
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: section %c of the IGES file has %llu lines, and its last line tells %llu", im->path,
			                letter[i], counted[i], told[i]);
	return PSR_OK;
}
