/* proto/planes.txt, in both directions where there are two. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <zstd.h>
#include "base/hash.h"
#include "proto/proto.h"

static const char *planes_path = "proto/planes.txt";

struct vector {
	char kind[16], name[64];
	double number[4];
	uint8_t from[2048], to[2048];
	size_t n_from, n_to;
};

static struct vector vectors[64];
static size_t n_vectors;

static size_t read_hex(uint8_t *out, size_t capacity, const char *text)
{
	size_t n = 0;
	unsigned byte;

	for (; sscanf(text, "%2x", &byte) == 1; text += 2) {
		assert_true(n < capacity);
		out[n++] = (uint8_t)byte;
	}
	assert_int_equal(*text, '\n');
	return n;
}

static int load_vectors(void **state)
{
	FILE *file = fopen(planes_path, "r");
	struct vector *v = NULL;
	int is_to = 0;
	char line[256];

	(void)state;
	if (file == NULL)
		fail_msg("cannot open %s: run this from the top of the repository, or name the file", planes_path);
	while (fgets(line, sizeof line, file)) {
		if (line[0] == '#' || line[0] == '\n')
			continue;
		if (line[0] == ' ') {
			assert_non_null(v);
			if (is_to)
				v->n_to += read_hex(v->to + v->n_to, sizeof v->to - v->n_to, line + 2);
			else
				v->n_from += read_hex(v->from + v->n_from, sizeof v->from - v->n_from, line + 2);
		} else if (!strcmp(line, "from\n") || !strcmp(line, "to\n")) {
			is_to = line[0] == 't';
		} else {
			assert_true(n_vectors < sizeof vectors / sizeof vectors[0]);
			v = &vectors[n_vectors++];
			assert_true(sscanf(line, "%15s %63s %lf %lf %lf %lf", v->kind, v->name, &v->number[0], &v->number[1],
			                   &v->number[2], &v->number[3]) >= 5);
		}
	}
	fclose(file);
	return 0;
}

/* The next one of a kind, or NULL. */
static const struct vector *next(size_t *at, const char *kind)
{
	while (*at < n_vectors)
		if (!strcmp(vectors[(*at)++].kind, kind))
			return &vectors[*at - 1];
	return NULL;
}

static void unfilter(uint8_t *out, const uint8_t *in, const struct vector *v)
{
	psr_unfilter_rows(out, in, (uint32_t)v->number[0], (uint32_t)v->number[1], (unsigned)v->number[2],
	                  (unsigned)v->number[3]);
}

static void rows_are_filtered_as_the_vectors_say(void **state)
{
	const struct vector *v;
	uint8_t out[2048];
	int n = 0;

	(void)state;
	for (size_t at = 0; (v = next(&at, "filter")) != NULL; n++) {
		assert_int_equal(v->n_from, v->n_to);
		psr_filter_rows(out, v->from, (uint32_t)v->number[0], (uint32_t)v->number[1], (unsigned)v->number[2],
		                (unsigned)v->number[3]);
		if (memcmp(out, v->to, v->n_to) != 0)
			fail_msg("%s: filtered to other bytes", v->name);
		unfilter(out, v->to, v);
		assert_memory_equal(out, v->from, v->n_from);
	}
	assert_true(n >= 12);
}

static void zstd_frames_hold_filtered_rows(void **state)
{
	const struct vector *v;
	uint8_t rows[2048], out[2048];
	int n = 0;

	(void)state;
	for (size_t at = 0; (v = next(&at, "zstd")) != NULL; n++) {
		assert_true(ZSTD_getFrameContentSize(v->to, v->n_to) == v->n_from);
		assert_int_equal(ZSTD_decompress(rows, sizeof rows, v->to, v->n_to), v->n_from);
		unfilter(out, rows, v);
		assert_memory_equal(out, v->from, v->n_from);
	}
	assert_int_equal(n, 3);
}

static struct psr_depth_range range_of(const struct vector *v)
{
	return (struct psr_depth_range){ .min = v->number[1], .max = v->number[2], .is_linear = v->number[0] == 2 };
}

static void depths_have_the_codes_of_the_vectors(void **state)
{
	const struct vector *v;
	uint16_t q[64];
	float z[64];
	int n = 0;

	(void)state;
	for (size_t at = 0; (v = next(&at, "depth")) != NULL; n++) {
		const struct psr_depth_range range = range_of(v);

		memcpy(z, v->from, v->n_from);
		psr_depth_quantise(q, z, v->n_from / 4, &range);
		assert_int_equal(v->n_to, v->n_from / 2);
		for (size_t i = 0; i < v->n_to / 2; i++)
			if (q[i] != (v->to[2 * i] | v->to[2 * i + 1] << 8))
				fail_msg("%s: depth %zu, %g, has the code %u", v->name, i, (double)z[i], q[i]);
	}
	assert_int_equal(n, 3);
}

static void codes_have_the_depths_of_the_vectors(void **state)
{
	const struct vector *v;
	uint16_t q[64];
	float z[64];
	int n = 0;

	(void)state;
	for (size_t at = 0; (v = next(&at, "back")) != NULL; n++) {
		const struct psr_depth_range range = range_of(v);

		memcpy(q, v->from, v->n_from);
		psr_depth_restore(z, q, v->n_from / 2, &range);
		if (v->n_to != 2 * v->n_from || memcmp(z, v->to, v->n_to) != 0)
			fail_msg("%s: codes have other depths", v->name);
	}
	assert_int_equal(n, 3);
}

static void planes_have_the_hashes_of_the_vectors(void **state)
{
	const struct vector *v;
	int n = 0;

	(void)state;
	for (size_t at = 0; (v = next(&at, "hash")) != NULL; n++) {
		const size_t row = (size_t)(v->number[0] * v->number[2]);
		const uint64_t hash = hash_plane(v->from, row, (uint32_t)v->number[1]);

		assert_int_equal(v->n_from, row * (size_t)v->number[1]);
		assert_int_equal(v->n_to, 8);
		for (int i = 0; i < 8; i++)
			if ((uint8_t)(hash >> 8 * i) != v->to[i])
				fail_msg("%s: the hash is %016llx", v->name, (unsigned long long)hash);
	}
	assert_int_equal(n, 6);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rows_are_filtered_as_the_vectors_say),
		cmocka_unit_test(zstd_frames_hold_filtered_rows),
		cmocka_unit_test(depths_have_the_codes_of_the_vectors),
		cmocka_unit_test(codes_have_the_depths_of_the_vectors),
		cmocka_unit_test(planes_have_the_hashes_of_the_vectors),
	};

	if (argc > 1)
		planes_path = argv[1];
	return cmocka_run_group_tests(tests, load_vectors, NULL);
}
