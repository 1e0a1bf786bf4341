/* proto/vectors.txt, in both directions, and what every message must refuse whatever it says. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "table.h"

static const char *vectors_path = "proto/vectors.txt";

struct vector {
	char name[64];
	int is_refused, is_later;
	enum psr_side side;
	int code;
	const struct proto_case *kind;
	uint32_t id;
	uint16_t view;
	union proto_any msg;
	uint8_t data[256]; /* where msg.rect.data points */
	uint8_t bytes[4096];
	size_t n;
};

static struct vector vectors[256];
static size_t n_vectors;

static unsigned hex_digit(char c)
{
	const char *digits = "0123456789abcdef", *p = strchr(digits, c);

	assert_true(c && p);
	return (unsigned)(p - digits);
}

static size_t read_hex(uint8_t *out, size_t capacity, const char *text)
{
	size_t n = 0;

	for (; text[0] && text[1]; text += 2) {
		assert_true(n < capacity);
		out[n++] = (uint8_t)(hex_digit(text[0]) << 4 | hex_digit(text[1]));
	}
	assert_true(*text == 0);
	return n;
}

static void set_value(struct vector *v, const struct proto_field *f, uint8_t *at, const char *text)
{
	char *end = (char *)(uintptr_t)text;

	if (f->kind == F_TEXT) {
		strcpy((char *)at, text);
		return;
	}
	if (f->kind == F_HEX) {
		assert_int_equal(read_hex(at, f->n, text), f->n);
		return;
	}
	if (f->kind == F_DATA) {
		read_hex(v->data, sizeof v->data, text);
		memcpy(at, &(const uint8_t *){ v->data }, sizeof(const uint8_t *));
		return;
	}
	if (f->kind == F_KIND || f->kind == F_EXTENT) {
		struct psr_camera *camera = (struct psr_camera *)(void *)at;
		const double value = strtod(text, NULL);

		if (f->kind == F_KIND)
			camera->kind = (enum psr_camera_kind)(value - 1);
		else if (camera->kind == PSR_CAMERA_PERSPECTIVE)
			camera->fov_y = value;
		else
			camera->ortho_height = value;
		return;
	}
	for (unsigned i = 0; i < f->n; i++, text = end) {
		uint64_t u;

		if (f->kind == F_F64) {
			((double *)(void *)at)[i] = strtod(text, &end);
			assert_ptr_not_equal(end, text);
			continue;
		}
		u = strtoull(text, &end, 10);
		assert_ptr_not_equal(end, text);
		switch (f->kind) {
		case F_U8: at[i] = (uint8_t)u; break;
		case F_U16: ((uint16_t *)(void *)at)[i] = (uint16_t)u; break;
		case F_U32: ((uint32_t *)(void *)at)[i] = (uint32_t)u; break;
		case F_U64: ((uint64_t *)(void *)at)[i] = u; break;
		default: fail_msg("a field of kind %d", f->kind);
		}
	}
	assert_int_equal(*end, 0);
}

static void set_field(struct vector *v, const struct proto_field *f, uint8_t *base, const char *path, const char *text)
{
	for (; f->kind != F_END; f++) {
		size_t n = strlen(f->name);
		char *rest;

		if (!strcmp(f->name, path)) {
			set_value(v, f, base + f->offset, text);
			return;
		}
		if (f->kind == F_LIST && !strncmp(f->name, path, n) && path[n] == '.') {
			unsigned long i = strtoul(path + n + 1, &rest, 10);

			assert_true(*rest == '.' && i < f->n);
			set_field(v, f->sub, base + f->offset + i * f->stride, rest + 1, text);
			return;
		}
	}
	fail_msg("%s: no field %s", v->name, path);
}

static int code_of(const char *name)
{
	return !strcmp(name, "FORMAT") ? PSR_ERR_FORMAT : !strcmp(name, "VERSION") ? PSR_ERR_VERSION :
	       !strcmp(name, "PROTOCOL") ? PSR_ERR_PROTOCOL : !strcmp(name, "ARG") ? PSR_ERR_ARG :
	       !strcmp(name, "LIMIT") ? PSR_ERR_LIMIT : 0;
}

static void read_head(struct vector *v, const char *line)
{
	char a[32], b[32];
	unsigned id, view;

	v->is_later = !strncmp(line, "later ", 6);
	if (sscanf(line, "message %63s %31s %u %u", v->name, a, &id, &view) == 4 ||
	    sscanf(line, "later %63s %31s %u %u", v->name, a, &id, &view) == 4) {
		for (size_t i = 0; i < N_PROTO_CASES; i++)
			if (!strcmp(psr_msg_name(proto_cases[i].type), a))
				v->kind = &proto_cases[i];
		assert_non_null(v->kind);
		v->id = id;
		v->view = (uint16_t)view;
		return;
	}
	assert_int_equal(sscanf(line, "refused %63s %31s %31s", v->name, a, b), 3);
	v->is_refused = 1;
	v->code = code_of(a);
	assert_int_not_equal(v->code, 0);
	v->side = !strcmp(b, "client") ? PSR_CLIENT : PSR_SERVER;
}

static int load_vectors(void **state)
{
	char line[2048];
	struct vector *v = NULL;
	FILE *file = fopen(vectors_path, "r");

	(void)state;
	if (!file)
		fail_msg("cannot open %s: run this from the top of the repository, or name the file", vectors_path);
	while (fgets(line, sizeof line, file)) {
		size_t n = strcspn(line, "\n");

		assert_int_equal(line[n], '\n');
		line[n] = 0;
		if (line[0] == '#' || line[0] == 0 || !strcmp(line, "hex"))
			continue;
		if (!strncmp(line, "message ", 8) || !strncmp(line, "refused ", 8) || !strncmp(line, "later ", 6)) {
			assert_true(n_vectors < sizeof vectors / sizeof vectors[0]);
			v = &vectors[n_vectors++];
			read_head(v, line);
		} else if (line[0] == ' ') {
			v->n += read_hex(v->bytes + v->n, sizeof v->bytes - v->n, line + 2);
		} else {
			char *equals = strstr(line, " = ");

			assert_non_null(equals);
			*equals = 0;
			set_field(v, v->kind->field, (uint8_t *)&v->msg, line, equals + 3);
		}
	}
	fclose(file);
	return 0;
}

/* Decodes from an allocation of exactly n bytes, so that a sanitizer sees every step beyond. */
static int decode_exactly(const struct proto_case *kind, union proto_any *msg, const uint8_t *payload, size_t n,
                          uint8_t **copy)
{
	struct psr_error err;
	int result;

	*copy = malloc(n);
	assert_true(n == 0 || *copy);
	if (n)
		memcpy(*copy, payload, n);
	result = kind->decode(msg, *copy, n, &err);
	if (result != PSR_OK)
		assert_true(err.code == result && err.text[0]);
	return result;
}

static void every_type_has_a_vector(void **state)
{
	(void)state;
	for (size_t i = 0; i < N_PROTO_CASES; i++) {
		int found = 0;

		for (size_t k = 0; k < n_vectors; k++)
			found += vectors[k].kind == &proto_cases[i];
		if (!found)
			fail_msg("%s has no vector", psr_msg_name(proto_cases[i].type));
	}
}

static void fields_encode_to_the_vector(void **state)
{
	static uint8_t bytes[4096];

	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct vector *v = &vectors[i];
		struct psr_buf out = { bytes, 0, v->n };
		struct psr_error err = { 0, "" };

		if (v->is_refused || v->is_later)
			continue;
		if (v->kind->encode(&out, v->id, v->view, &v->msg, &err) != PSR_OK || out.size != v->n ||
		    memcmp(bytes, v->bytes, v->n))
			fail_msg("%s: encoded to %zu of %zu bytes, or to others; %s", v->name, out.size, v->n, err.text);
		out = (struct psr_buf){ bytes, 0, v->n - 1 };
		assert_int_equal(v->kind->encode(&out, v->id, v->view, &v->msg, &err), PSR_ERR_MEMORY);
		assert_int_equal(out.size, 0);
	}
}

static void the_vector_decodes_to_its_fields(void **state)
{
	static union proto_any msg;

	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct vector *v = &vectors[i];
		const uint8_t **data;
		uint32_t n_data;
		uint8_t *copy;

		if (v->is_refused || !v->kind->decode)
			continue;
		memset(&msg, 0, sizeof msg);
		assert_int_equal(decode_exactly(v->kind, &msg, v->bytes + 16, v->n - 16, &copy), PSR_OK);
		data = proto_data(v->kind->type, &msg, &n_data);
		if (data != NULL) {
			assert_memory_equal(*data, v->data, n_data);
			*data = v->data;
		}
		if (memcmp(&msg, &v->msg, sizeof msg))
			fail_msg("%s: decoded to other fields", v->name);
		free(copy);
	}
}

static int refuse(const struct vector *v, struct psr_error *err)
{
	static uint8_t storage[PSR_WIRE_MAX_MESSAGE];
	static union proto_any msg;
	struct psr_framer framer;
	struct psr_message m;
	size_t n;
	int result;

	psr_framer_init(&framer, v->side, storage, sizeof storage);
	assert_true(v->n <= sizeof storage);
	memcpy(psr_framer_space(&framer, &n), v->bytes, v->n);
	psr_framer_filled(&framer, v->n);
	while ((result = psr_framer_next(&framer, &m, err)) > 0) {
		const struct proto_case *kind = proto_case_of(m.type);

		result = kind->decode ? kind->decode(&msg, m.payload, m.n, err) : PSR_OK;
		if (result != PSR_OK)
			return result;
		if (m.type == PSR_MSG_HELLO)
			psr_framer_accept(&framer, storage, sizeof storage);
	}
	return result;
}

static void bad_streams_are_refused_for_the_right_reason(void **state)
{
	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct psr_error err = { 0, "" };

		if (!vectors[i].is_refused)
			continue;
		if (refuse(&vectors[i], &err) != vectors[i].code)
			fail_msg("%s: refused with %d (%s) instead of %d", vectors[i].name, err.code, err.text, vectors[i].code);
		assert_true(strlen(err.text) > 10);
	}
}

static void every_truncation_is_refused(void **state)
{
	static union proto_any msg;

	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct vector *v = &vectors[i];

		if (v->is_refused || v->is_later || !v->kind->decode)
			continue;
		for (size_t n = 0; n < v->n - 16; n++) {
			uint8_t *copy;

			if (decode_exactly(v->kind, &msg, v->bytes + 16, n, &copy) != PSR_ERR_PROTOCOL)
				fail_msg("%s: %zu of %zu bytes of payload are taken", v->name, n, v->n - 16);
			free(copy);
		}
	}
}

static void bytes_behind_the_end_are_skipped(void **state)
{
	static union proto_any msg;
	static uint8_t longer[4096];

	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct vector *v = &vectors[i];

		if (v->is_refused || !v->kind->decode)
			continue;
		memset(longer, 0xee, sizeof longer);
		memcpy(longer, v->bytes + 16, v->n - 16);
		for (size_t n = 1; n <= PSR_WIRE_GROWTH; n += PSR_WIRE_GROWTH - 1) {
			const uint8_t **data;
			uint32_t n_data;
			uint8_t *copy;

			memset(&msg, 0, sizeof msg);
			assert_int_equal(decode_exactly(v->kind, &msg, longer, v->n - 16 + n, &copy), PSR_OK);
			data = proto_data(v->kind->type, &msg, &n_data);
			if (data != NULL)
				*data = v->data;
			assert_memory_equal(&msg, &v->msg, sizeof msg);
			free(copy);
		}
	}
}

/* Decodes a payload. What is taken is refused or kept: it has the encoding that it came from, but for what fell back
 * and what stood behind the end. So a set reserved bit cannot pass unseen. */
static void refuse_or_keep(const struct vector *v, size_t at)
{
	static union proto_any msg;
	static uint8_t bytes[4096];
	struct psr_buf out = { bytes, 0, sizeof bytes };
	uint8_t *copy;

	if (decode_exactly(v->kind, &msg, v->bytes + 16, v->n - 16, &copy) == PSR_OK &&
	    !proto_is_kept(v->kind, &out, &msg, copy, v->n - 16))
		fail_msg("%s: a change at byte %zu of the payload is lost", v->name, at);
	free(copy);
}

static void each_flipped_bit_is_refused_or_kept(void **state)
{
	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct vector *v = &vectors[i];

		if (v->is_refused || !v->kind->decode)
			continue;
		for (size_t bit = 0; bit < 8 * (v->n - 16); bit++) {
			v->bytes[16 + bit / 8] ^= (uint8_t)(1u << bit % 8);
			refuse_or_keep(v, bit / 8);
			v->bytes[16 + bit / 8] ^= (uint8_t)(1u << bit % 8);
		}
	}
}

/* Counts, lengths and offsets among them: an integer of any size at any place says something else. */
static void every_integer_may_lie(void **state)
{
	static const uint64_t lies[] = { 0, 1, 2, 0x7f, 0xff, 0x100, 0x200, 0x3e8, 0x7fff, 0xfff0, 0xffff, 0x10000,
		0x7fffffff, 0x80000000, 0xfffffff0, 0xffffffff, UINT64_C(0x7ff0000000000000), UINT64_MAX };

	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		struct vector *v = &vectors[i];

		if (v->is_refused || !v->kind->decode)
			continue;
		for (size_t size = 1; size <= 8; size *= 2)
			for (size_t at = 0; at + size <= v->n - 16; at++)
				for (size_t k = 0; k < sizeof lies / sizeof lies[0]; k++) {
					uint8_t true_bytes[8];

					memcpy(true_bytes, v->bytes + 16 + at, size);
					for (size_t b = 0; b < size; b++)
						v->bytes[16 + at + b] = (uint8_t)(lies[k] >> 8 * b);
					refuse_or_keep(v, at);
					memcpy(v->bytes + 16 + at, true_bytes, size);
				}
	}
}

/* The header may claim any length: the framer waits for more, refuses it, or hands out what was claimed. */
static void every_length_of_a_message_may_lie(void **state)
{
	static uint8_t storage[PSR_WIRE_MAX_MESSAGE];
	static union proto_any msg;

	(void)state;
	for (size_t i = 0; i < n_vectors; i++) {
		const struct vector *v = &vectors[i];
		const int from_server = !v->is_refused && (v->kind->type == PSR_MSG_RECT || v->kind->type == PSR_MSG_FRAME_END ||
		                                           v->kind->type == PSR_MSG_FETCH_PART);

		if (v->is_refused || (!from_server && v->kind->type != PSR_MSG_HELLO && v->kind->type != PSR_MSG_FRAME &&
		                      v->kind->type != PSR_MSG_SCENE && v->kind->type != PSR_MSG_OPEN))
			continue;
		for (uint32_t length = 0; length < 2 * v->n + 600; length++) {
			struct psr_framer framer;
			struct psr_message m;
			size_t n;
			int result;

			psr_framer_init(&framer, from_server ? PSR_SERVER : PSR_CLIENT, storage, sizeof storage);
			framer.expects_hello = v->kind->type == PSR_MSG_HELLO;
			memcpy(psr_framer_space(&framer, &n), v->bytes, v->n);
			for (int b = 0; b < 4; b++)
				storage[b] = (uint8_t)(length >> 8 * b);
			psr_framer_filled(&framer, v->n);
			result = psr_framer_next(&framer, &m, NULL);
			assert_true(result == 1 ? length <= v->n && m.n == length - 16 : result == 0 ? length > v->n : result < 0);
			if (result == 1 && length < v->n)
				assert_true(v->is_later || v->kind->decode(&msg, m.payload, m.n, NULL) != PSR_OK);
		}
	}
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_type_has_a_vector),
		cmocka_unit_test(fields_encode_to_the_vector),
		cmocka_unit_test(the_vector_decodes_to_its_fields),
		cmocka_unit_test(bad_streams_are_refused_for_the_right_reason),
		cmocka_unit_test(every_truncation_is_refused),
		cmocka_unit_test(bytes_behind_the_end_are_skipped),
		cmocka_unit_test(each_flipped_bit_is_refused_or_kept),
		cmocka_unit_test(every_integer_may_lie),
		cmocka_unit_test(every_length_of_a_message_may_lie),
	};

	if (argc > 1)
		vectors_path = argv[1];
	return cmocka_run_group_tests(tests, load_vectors, NULL);
}
