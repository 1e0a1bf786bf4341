/* Random messages survive the way out and back; values at and beyond each limit; texts; codes; room. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "table.h"

static uint8_t bytes[PSR_WIRE_MAX_MESSAGE + 4096];
static union proto_any in, back;
static uint64_t random_state;

static uint64_t random64(void)
{
	uint64_t z = random_state += 0x9e3779b97f4a7c15u;

	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return z ^ z >> 31;
}

static uint32_t below(uint32_t n)
{
	return (uint32_t)(random64() % n);
}

/* Of any magnitude that the protocol knows. */
static double length(void)
{
	double v = ldexp(1 + (double)(random64() >> 12) / 4503599627370496.0, (int)below(190) - 95);

	return below(2) ? v : -v;
}

static double unit(void)
{
	return (double)(random64() >> 11) / 9007199254740992.0;
}

static void lengths(double v[3])
{
	for (int i = 0; i < 3; i++)
		v[i] = length();
}

static void make_text(char *text, unsigned max)
{
	static const char *const parts[] = { "a", "psr ", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\xab\x96", "/", "9" };
	size_t n = 0, room = 1 + below(max);

	*text = 0;
	for (;;) {
		const char *part = parts[below(7)];

		if (n + strlen(part) > room)
			return;
		strcpy(text + n, part);
		n += strlen(part);
	}
}

static void make_scene(struct psr_msg_scene *m)
{
	m->slot = (uint16_t)below(16);
	m->flags = (uint16_t)below(2);
	m->ambient = unit();
	m->n_instances = (uint16_t)below(below(8) ? 5 : 800);
	m->n_lights = (uint16_t)below(33);
	m->background[0] = (uint8_t)below(256);
	for (unsigned i = 0; i < m->n_instances; i++) {
		struct psr_msg_instance *n = &m->instance[i];
		double norm = 0;

		n->handle = 1 + below(1u << 31);
		n->representation = (uint8_t)below(4);
		n->color_by = (uint8_t)below(5);
		for (int k = 0; k < 4; k++) {
			n->rotation[k] = unit() - 0.5 + 1e-3;
			norm += n->rotation[k] * n->rotation[k];
		}
		for (int k = 0; k < 4; k++)
			n->rotation[k] /= sqrt(norm);
		lengths(n->translation);
		n->scale = fabs(length());
	}
	for (unsigned i = 0; i < m->n_lights; i++) {
		struct psr_msg_light *l = &m->light[i];

		l->kind = (uint8_t)(1 + below(3));
		l->flags = (uint8_t)below(2);
		l->color[1] = (uint8_t)below(256);
		l->intensity = 1e6 * unit();
		if (l->kind != PSR_WIRE_LIGHT_DIRECTIONAL) {
			lengths(l->position);
			l->reference = below(2) ? fabs(length()) : 0;
		}
		if (l->kind != PSR_WIRE_LIGHT_POINT)
			lengths(l->direction);
		if (l->kind == PSR_WIRE_LIGHT_SPOT) {
			l->outer = 1e-6 + 3 * unit();
			l->inner = l->outer * unit();
		}
	}
}

static void make_camera(struct psr_camera *m)
{
	m->kind = below(2) ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE;
	lengths(m->eye);
	for (int i = 0; i < 3; i++)
		m->target[i] = m->eye[i] * (i == 0 ? 3 : 1);
	m->up[1] = length();
	m->fov_y = m->kind == PSR_CAMERA_PERSPECTIVE ? 1e-6 + 3 * unit() : 0;
	m->ortho_height = m->kind == PSR_CAMERA_PERSPECTIVE ? 0 : fabs(length());
	m->near_z = below(2) ? fabs(length()) : 0;
}

static void make_depth_range(double range[2], unsigned format, enum psr_camera_kind kind)
{
	if (format < PSR_WIRE_DEPTH_U16)
		return;
	range[0] = kind == PSR_CAMERA_PERSPECTIVE ? fabs(length()) : length();
	range[1] = range[0] + fabs(range[0]) * (1e-9 + unit());
}

static void make_frame(struct psr_msg_frame *m)
{
	double range[2] = { 0, 0 };

	m->slot = (uint16_t)below(16);
	m->pass_limit = (uint16_t)below(65536);
	m->width = 1 + below(16384);
	m->height = 1 + below(4096);
	m->planes = 1 + below(255);
	if (m->planes & 1) {
		m->color_codec = (uint8_t)below(4);
		m->color_quality = m->color_codec == PSR_CODEC_JPEG ? (uint8_t)(1 + below(100)) : 0;
	}
	if (m->planes & 2) {
		m->depth_format = (uint8_t)(1 + below(3));
		m->depth_codec = (uint8_t)(2 * below(2));
	}
	if (m->planes & ~3u)
		m->data_codec = (uint8_t)(2 * below(2));
	m->budget = (uint8_t)below(5);
	if (m->budget == PSR_WIRE_BUDGET_TIME)
		m->time_budget_us = 1 + below(1000000);
	if (m->budget == PSR_WIRE_BUDGET_ERROR || m->budget == PSR_WIRE_BUDGET_RMSE)
		m->error_bound = 1e-3 + unit();
	if (m->budget == PSR_WIRE_BUDGET_SETTINGS) {
		m->settings.scale = (uint8_t)(1u << below(3));
		m->settings.smooth = (uint8_t)below(3);
		m->settings.pass = (uint8_t)below(PSR_WIRE_MAX_PASS + 1);
		m->settings.splats = (uint8_t)below(2);
		m->settings.spacing_px = 1.0 / 64 + 63 * unit();
	}
	if (m->budget == PSR_WIRE_BUDGET_SETTINGS) {
		m->width = 4 * (1 + below(4096));
		m->height = 4 * (1 + below(1024));
	}
	m->flags = (uint16_t)below(4);
	m->base = below(1000);
	make_camera(&m->camera);
	make_depth_range(range, m->depth_format, m->camera.kind);
	m->depth_min = range[0];
	m->depth_max = range[1];
}

static void make_begin(struct psr_msg_frame_begin *m)
{
	struct psr_msg_frame f = { .slot = 0 };

	make_frame(&f);
	m->pass = (uint16_t)below(100);
	m->refine = (uint16_t)below(100);
	m->width = (f.width + 3) / 4 * 4;
	m->height = (f.height + 3) / 4 * 4;
	m->planes = f.planes;
	m->color_codec = f.color_codec;
	m->color_quality = f.color_quality;
	m->depth_format = f.depth_format;
	m->depth_codec = f.depth_codec;
	m->data_codec = f.data_codec;
	m->background[2] = (uint8_t)below(256);
	m->base = f.base;
	m->base_pass = f.base ? (uint16_t)below(9) : 0;
	m->settings.scale = 4;
	m->settings.smooth = 1;
	m->settings.pass = 4;
	m->settings.splats = 1;
	m->settings.spacing_px = 64;
	m->camera = f.camera;
	m->depth_min = f.depth_min;
	m->depth_max = f.depth_max;
}

static void make_rect(struct psr_msg_rect *m)
{
	static uint8_t data[PSR_WIRE_MAX_RECT_DATA];

	m->plane = (uint8_t)below(PSR_N_PLANES);
	m->codec = PSR_CODEC_ZSTD;
	m->scale = (uint8_t)(1u << below(3));
	m->w = (uint16_t)(1 + below(16384));
	m->h = (uint16_t)(1 + below(128));
	m->x = (uint16_t)below(16384u - m->w + 1);
	m->y = (uint16_t)below(16384u - m->h + 1);
	m->total = 1 + below(65536);
	m->offset = below(m->total);
	m->bytes = 1 + below(m->total - m->offset);
	if (m->bytes > sizeof data)
		m->bytes = sizeof data;
	data[m->bytes - 1] = (uint8_t)below(256);
	m->data = data;
}

static void make_end(struct psr_msg_frame_end *m)
{
	m->pass = (uint16_t)below(65536);
	m->is_final = (uint8_t)below(2);
	m->status = (uint8_t)below(3);
	m->error_px = fabs(length());
	m->planes = 1 + below(255);
	m->has_hashes = (uint8_t)below(2);
	if (m->planes & 1u << PSR_PLANE_DEPTH) {
		m->depth_min = fabs(length()) * 1e-2;
		m->depth_max = m->depth_min * (1 + unit());
	}
	for (unsigned i = 0; i < PSR_N_PLANES; i++)
		m->hash[i] = m->has_hashes && m->planes >> i & 1 ? random64() : 0;
	m->n_entries = (uint16_t)below(65);
	for (unsigned i = 0; i < m->n_entries; i++) {
		m->entry[i].id = (uint16_t)(i + 1);
		m->entry[i].ns = i + 1 < 32 || i + 1 > 63 ? random64() >> 11 : 0;
		m->entry[i].count = random64() >> 11;
	}
}

static void make_part(struct psr_msg_fetch_part *m)
{
	static uint8_t data[PSR_WIRE_MAX_PART];

	m->offset = random64() >> 12;
	m->bytes = below(9) == 0 ? PSR_WIRE_MAX_PART : 1 + below(3000);
	data[m->bytes - 1] = (uint8_t)below(256);
	m->data = data;
}

static void make(unsigned type, union proto_any *m)
{
	struct psr_msg_frame frame = { .slot = 0 };

	memset(m, 0, sizeof *m);
	switch (type) {
	case PSR_MSG_HELLO:
		m->hello.minor = PSR_PROTO_MINOR;
		m->hello.routing_key = random64();
		m->hello.capabilities = random64();
		make_text(m->hello.token, 255);
		make_text(m->hello.client, 255);
		break;
	case PSR_MSG_ERROR:
		m->error.code = (uint16_t)(1 + below(65535));
		make_text(m->error.text, 511);
		break;
	case PSR_MSG_OPEN:
		m->open.resolution = (uint16_t)below(PSR_WIRE_MAX_SIDE + 1);
		m->open.levels = (uint8_t)below(PSR_WIRE_MAX_LEVELS + 1);
		m->open.name[0] = 'x';
		make_text(m->open.name + 1, 254);
		break;
	case PSR_MSG_OPENED:
		m->opened.handle = 1 + below(1000);
		m->opened.representations = (uint8_t)(2 * (1 + below(7)));
		m->opened.colors = (uint8_t)(2 * below(16));
		m->opened.of_levels = (uint8_t)below(PSR_WIRE_MAX_LEVELS + 1);
		m->opened.octree_levels = (uint8_t)(m->opened.of_levels > 0 ? 1 + below(m->opened.of_levels) : 0);
		m->opened.content_id[below(16)] = (uint8_t)below(256);
		lengths(m->opened.box_min);
		for (int i = 0; i < 3; i++)
			m->opened.box_max[i] = m->opened.box_min[i] + (i ? 0 : fabs(length()));
		lengths(m->opened.origin);
		m->opened.scale = fabs(length());
		m->opened.spacing = fabs(length());
		m->opened.resolution = 1 + below(100000);
		m->opened.n_levels = 1 + below(20);
		m->opened.n_samples = random64() >> 11;
		m->opened.up[below(3)] = below(2) ? 1 : -1;
		break;
	case PSR_MSG_PRESET:
		m->preset.kind = (uint8_t)(1 + below(2));
		m->preset.name[0] = 'x';
		make_text(m->preset.name + 1, 254);
		if (m->preset.kind == PSR_WIRE_PRESET_CAMERA) {
			make_frame(&frame);
			m->preset.camera = frame.camera;
		} else {
			m->preset.light.kind = PSR_WIRE_LIGHT_POINT;
			m->preset.light.color[below(3)] = (uint8_t)below(256);
			m->preset.light.intensity = 1e6 * unit();
			lengths(m->preset.light.position);
			m->preset.light.reference = fabs(length());
		}
		break;
	case PSR_MSG_SCENE: make_scene(&m->scene); break;
	case PSR_MSG_FRAME: make_frame(&m->frame); break;
	case PSR_MSG_FRAME_BEGIN: make_begin(&m->frame_begin); break;
	case PSR_MSG_RECT: make_rect(&m->rect); break;
	case PSR_MSG_FRAME_END: make_end(&m->frame_end); break;
	case PSR_MSG_FETCH:
		m->fetch = (struct psr_msg_fetch){ .handle = below(2), .offset = random64() >> 11, .length = random64() >> 11,
			                               .file_hash = random64() };
		if (m->fetch.handle == 0) {
			m->fetch.name[0] = 'x';
			make_text(m->fetch.name + 1, 254);
		}
		break;
	case PSR_MSG_FETCH_PART: make_part(&m->fetch_part); break;
	default: fail_msg("no random message of type %u", type);
	}
}

static void random_messages_come_back(void **state)
{
	static const unsigned types[] = { PSR_MSG_HELLO, PSR_MSG_ERROR, PSR_MSG_OPEN, PSR_MSG_OPENED, PSR_MSG_SCENE,
		PSR_MSG_FRAME, PSR_MSG_FRAME_BEGIN, PSR_MSG_RECT, PSR_MSG_FRAME_END, PSR_MSG_PRESET, PSR_MSG_FETCH,
		PSR_MSG_FETCH_PART };

	(void)state;
	random_state = 11;
	for (int round = 0; round < 2000; round++) {
		const struct proto_case *kind = proto_case_of(types[(size_t)round % (sizeof types / sizeof types[0])]);
		struct psr_buf out = { bytes, 0, sizeof bytes };
		struct psr_error err = { 0, "" };
		const uint8_t **data;
		uint32_t n_data;
		uint8_t *exact;

		make(kind->type, &in);
		memset(&back, 0, sizeof back);
		if (kind->encode(&out, 5, 0, &in, &err) != PSR_OK)
			fail_msg("%s: %s", psr_msg_name(kind->type), err.text);
		exact = malloc(out.size - 16);
		assert_non_null(exact);
		memcpy(exact, bytes + 16, out.size - 16);
		if (kind->decode(&back, exact, out.size - 16, &err) != PSR_OK)
			fail_msg("%s", err.text);
		data = proto_data(kind->type, &in, &n_data);
		if (data != NULL) {
			const uint8_t **got = proto_data(kind->type, &back, &n_data);

			assert_memory_equal(*got, *data, n_data);
			*got = *data;
		}
		free(exact);
		assert_memory_equal(&in, &back, sizeof in);
	}
}

/* Each rule of FRAME and SCENE from both ends: a field is set to a value, and the message passes or not. */
static int encode_frame_with(size_t offset, double value, struct psr_error *err)
{
	struct psr_msg_frame m = { .width = 640, .height = 480, .planes = 1,
		.camera = { { 0, 0, 5 }, { 0, 0, 0 }, { 0, 1, 0 }, PSR_CAMERA_PERSPECTIVE, 1, 0, 0.1 } };
	struct psr_buf out = { bytes, 0, sizeof bytes };

	memcpy((uint8_t *)&m + offset, &value, sizeof value);
	return psr_msg_frame_encode(&out, 1, 0, &m, err);
}

static void doubles_of_a_camera_are_bounded(void **state)
{
#define CAM(field) offsetof(struct psr_msg_frame, camera.field)
	const struct { size_t offset; double good, bad; } rows[] = {
		{ CAM(eye), 1e30, 1.0000001e30 }, { CAM(eye[0]), -1e30, -INFINITY }, { CAM(eye[2]), 1e-30, 0 },
		{ CAM(target), 0, NAN }, { CAM(target[2]), 4.999, 5 }, { CAM(up[1]), 1e-30, 9e-31 },
		{ CAM(up[1]), -1e30, -NAN }, { CAM(fov_y), 1e-6, 9.99e-7 }, { CAM(fov_y), 3.14159, 3.1416 },
		{ CAM(near_z), 0, -1e-300 }, { CAM(near_z), 1e30, INFINITY },
	};

	(void)state;
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		struct psr_error err = { 0, "" };

		if (encode_frame_with(rows[i].offset, rows[i].good, &err) != PSR_OK)
			fail_msg("row %zu: %s", i, err.text);
		assert_int_equal(encode_frame_with(rows[i].offset, rows[i].bad, &err), PSR_ERR_ARG);
		assert_non_null(strstr(err.text, "camera"));
	}
}

static int encode_size(uint32_t width, uint32_t height)
{
	struct psr_msg_frame m = { .width = width, .height = height, .planes = 1,
		.camera = { { 0, 0, 5 }, { 0, 0, 0 }, { 0, 1, 0 }, PSR_CAMERA_PERSPECTIVE, 1, 0, 0.1 } };
	struct psr_buf out = { bytes, 0, sizeof bytes };

	return psr_msg_frame_encode(&out, 1, 0, &m, NULL);
}

static void sizes_are_bounded(void **state)
{
	(void)state;
	assert_int_equal(encode_size(1, 1), PSR_OK);
	assert_int_equal(encode_size(16384, 4096), PSR_OK);
	assert_int_equal(encode_size(8192, 8192), PSR_OK);
	assert_int_equal(encode_size(1, 16384), PSR_OK);
	assert_int_equal(encode_size(0, 1), PSR_ERR_ARG);
	assert_int_equal(encode_size(1, 0), PSR_ERR_ARG);
	assert_int_equal(encode_size(16385, 1), PSR_ERR_LIMIT);
	assert_int_equal(encode_size(16384, 4097), PSR_ERR_LIMIT);
	assert_int_equal(encode_size(100000, 100000), PSR_ERR_LIMIT);
	assert_int_equal(encode_size(UINT32_MAX, UINT32_MAX), PSR_ERR_LIMIT);
}

static int encode_light(struct psr_msg_light light)
{
	static struct psr_msg_scene scene;
	struct psr_buf out = { bytes, 0, sizeof bytes };

	scene.n_lights = 1;
	scene.light[0] = light;
	return psr_msg_scene_encode(&out, 1, &scene, NULL);
}

static void lights_have_only_what_their_kind_uses(void **state)
{
	const struct psr_msg_light directional = { .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .direction = { 0, -1, 0 } };
	const struct psr_msg_light point = { .kind = PSR_WIRE_LIGHT_POINT, .position = { 1, 2, 3 }, .reference = 1 };
	const struct psr_msg_light spot = { .kind = PSR_WIRE_LIGHT_SPOT, .direction = { 0, -1, 0 }, .inner = 1,
		.outer = 1 };
	struct psr_msg_light l;

	(void)state;
	assert_int_equal(encode_light(directional), PSR_OK);
	assert_int_equal(encode_light(point), PSR_OK);
	assert_int_equal(encode_light(spot), PSR_OK);
#define WITH(base, change) (l = base, l.change, encode_light(l))
	assert_int_equal(WITH(directional, position[2] = 1), PSR_ERR_ARG);
	assert_int_equal(WITH(directional, reference = 1), PSR_ERR_ARG);
	assert_int_equal(WITH(directional, outer = 1), PSR_ERR_ARG);
	assert_int_equal(WITH(directional, direction[1] = 0), PSR_ERR_ARG);
	assert_int_equal(WITH(point, direction[0] = 1), PSR_ERR_ARG);
	assert_int_equal(WITH(point, inner = 1), PSR_ERR_ARG);
	assert_int_equal(WITH(point, reference = -1), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, inner = 1.001), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, outer = 3.15), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, direction[1] = NAN), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, intensity = -1), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, intensity = 1.1e6), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, flags = 2), PSR_ERR_ARG);
	assert_int_equal(WITH(spot, kind = 4), PSR_ERR_ARG);
}

static void a_scene_fills_its_message_and_no_more(void **state)
{
	static struct psr_msg_scene scene;
	struct psr_buf out = { bytes, 0, sizeof bytes };

	(void)state;
	for (int i = 0; i < PSR_WIRE_MAX_INSTANCES; i++)
		scene.instance[i] = (struct psr_msg_instance){ .handle = 1, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	scene.n_instances = 909; /* floor((65520 - 24) / 72) */
	assert_int_equal(psr_msg_scene_encode(&out, 1, &scene, NULL), PSR_OK);
	assert_int_equal(out.size, 16 + 24 + 909 * 72);
	scene.n_instances = 910;
	assert_int_equal(psr_msg_scene_encode(&out, 1, &scene, NULL), PSR_ERR_LIMIT);
	scene.n_instances = PSR_WIRE_MAX_INSTANCES + 1;
	assert_int_equal(psr_msg_scene_encode(&out, 1, &scene, NULL), PSR_ERR_LIMIT);
	assert_int_equal(out.size, 16 + 24 + 909 * 72);
}

static void an_error_can_always_be_sent(void **state)
{
	struct psr_msg_error m = { .code = 4 };
	struct psr_buf out = { bytes, 0, sizeof bytes };

	(void)state;
	strcpy(m.text, "no model 'a\x1b[2J\xff\xc3\xa9\xe2\x82'\n");
	assert_int_equal(psr_msg_error_encode(&out, 3, 0, &m, NULL), PSR_OK);
	assert_int_equal(psr_msg_error_decode(&back.error, bytes + 16, out.size - 16, NULL), PSR_OK);
	assert_string_equal(back.error.text, "no model 'a?[2J?\xc3\xa9?" "?'?");

	memset(m.text, 'x', sizeof m.text); /* not even terminated */
	memcpy(m.text + sizeof m.text - 2, "\xc3\xa9", 2);
	out.size = 0;
	assert_int_equal(psr_msg_error_encode(&out, 3, 0, &m, NULL), PSR_OK);
	assert_int_equal(psr_msg_error_decode(&back.error, bytes + 16, out.size - 16, NULL), PSR_OK);
	assert_int_equal(strlen(back.error.text), 511);
	assert_int_equal(back.error.text[510], '?');
}

static void texts_are_clean_utf8(void **state)
{
	static const char *const bad[] = { "\x01", "\x1f", "\x7f", "\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xc2",
		"\xc2\x41", "\xc2\x80", "\xc2\x9b", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xed\xbf\xbf", "\xef\xbf",
		"\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80", "\xff", "ok\n" };
	static const char *const good[] = { " ", "~", "\xc2\xa0", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf",
		"\xee\x80\x80", "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf" };
	struct psr_msg_open m = { .name = "" };

	(void)state;
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct psr_buf out = { bytes, 0, sizeof bytes };
		uint8_t payload[16] = { 0, 0, 0, 0, (uint8_t)strlen(bad[i]) };

		snprintf(m.name, sizeof m.name, "%s", bad[i]);
		assert_int_equal(psr_msg_open_encode(&out, 1, &m, NULL), PSR_ERR_ARG);
		memcpy(payload + 6, bad[i], strlen(bad[i]));
		assert_int_equal(psr_msg_open_decode(&m, payload, 6 + strlen(bad[i]), NULL), PSR_ERR_PROTOCOL);
	}
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
		struct psr_buf out = { bytes, 0, sizeof bytes };

		snprintf(m.name, sizeof m.name, "%s", good[i]);
		assert_int_equal(psr_msg_open_encode(&out, 1, &m, NULL), PSR_OK);
	}
	memset(m.name, 'x', sizeof m.name);
	assert_int_equal(psr_msg_open_encode(&(struct psr_buf){ bytes, 0, sizeof bytes }, 1, &m, NULL), PSR_ERR_ARG);
}

static void messages_append_until_there_is_no_room(void **state)
{
	struct psr_buf out = { bytes, 0, 100 };

	(void)state;
	for (int i = 0; i < 6; i++) {
		assert_int_equal(psr_msg_list_encode(&out, (uint32_t)i + 1, NULL), PSR_OK);
		assert_int_equal(out.size, 16 * (i + 1));
	}
	assert_int_equal(psr_msg_list_encode(&out, 7, NULL), PSR_ERR_MEMORY);
	assert_int_equal(out.size, 96);
}

static void codes_keep_their_meaning(void **state)
{
	(void)state;
	for (int code = PSR_ERR_ARG; code >= PSR_ERR_INTERNAL; code--) {
		assert_int_equal(psr_wire_error_from(code), -code);
		assert_int_equal(psr_wire_error_to(psr_wire_error_from(code)), code);
	}
	assert_int_equal(psr_wire_error_from(PSR_OK), PSR_WIRE_INTERNAL);
	assert_int_equal(psr_wire_error_from(-1000), PSR_WIRE_INTERNAL);
	assert_int_equal(psr_wire_error_to(0), PSR_ERR_INTERNAL);
	assert_int_equal(psr_wire_error_to(14), PSR_ERR_CONNECTION);
	assert_int_equal(psr_wire_error_to(60000), PSR_ERR_INTERNAL);
}

static void another_version_is_told_apart_first(void **state)
{
	struct psr_msg_hello m = { .major = 3, .minor = 7 };
	struct psr_buf out = { bytes, 0, sizeof bytes };
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_msg_hello_encode(&out, &m, NULL), PSR_OK);
	memset(bytes + 36, 0xee, 28); /* what that version has there is not ours to judge */
	assert_int_equal(psr_msg_hello_decode(&back.hello, bytes + 16, out.size - 16, &err), PSR_ERR_VERSION);
	assert_int_equal(back.hello.major, 3);
	assert_int_equal(back.hello.minor, 7);
	assert_non_null(strstr(err.text, "3.7"));
	assert_true(!strncmp(err.text, "psr 0.2: ", 9)); /* programs read it */
	assert_int_equal(psr_msg_hello_decode(&back.hello, bytes + 16, 47, &err), PSR_ERR_PROTOCOL);
}

static void routing_key_is_xxh64(void **state)
{
	(void)state;
	assert_true(psr_routing_key("teapot") == 0x64cdb9130ee4f636u);
	assert_true(psr_routing_key("") == 0 && psr_routing_key(NULL) == 0);
}

static void planes_have_the_bytes_of_the_table(void **state)
{
	(void)state;
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_COLOR, 0), 3);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_DEPTH, PSR_WIRE_DEPTH_F32), 4);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_DEPTH, PSR_WIRE_DEPTH_U16_HALF), 2);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_NORMAL, 0), 6);
	assert_int_equal(psr_plane_component_bytes(PSR_PLANE_NORMAL, 0), 2);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_ID, 0), 4);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_WEIGHT, 0), 1);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_WORDS, 0), 8);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_BLOCK, 0), 3);
	assert_int_equal(psr_plane_component_bytes(PSR_PLANE_BLOCK, 0), 1);
	assert_int_equal(psr_plane_pixel_bytes(PSR_PLANE_BOUND, 0), 2);
	assert_int_equal(psr_plane_component_bytes(PSR_PLANE_BOUND, 0), 2);
}

static void planes_have_names_capabilities_and_backgrounds(void **state)
{
	static const struct {
		const char *name;
		uint64_t capability;
		uint8_t background[8];
	} table[PSR_N_PLANES] = {
		{ "color", 0, { 0 } },
		{ "depth", 0, { 0, 0, 0x80, 0x7f } },
		{ "normal", 1 << 8, { 0 } },
		{ "id", 1 << 9, { 0xff, 0xff, 0xff, 0xff } },
		{ "weight", 1 << 10, { 0xff } },
		{ "words", 1 << 11, { 0xff, 0xff, 0xff, 0xff, 0, 0, 0x80, 0x7f } },
		{ "block", 1 << 20, { 0xff, 0xff, 0xff } },
		{ "bound", 1 << 24, { 0 } },
	};

	(void)state;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		assert_string_equal(psr_plane_name(plane), table[plane].name);
		assert_true(psr_plane_capability(plane) == table[plane].capability);
		assert_memory_equal(psr_plane_background(plane), table[plane].background, 8);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(random_messages_come_back),
		cmocka_unit_test(doubles_of_a_camera_are_bounded),
		cmocka_unit_test(sizes_are_bounded),
		cmocka_unit_test(lights_have_only_what_their_kind_uses),
		cmocka_unit_test(a_scene_fills_its_message_and_no_more),
		cmocka_unit_test(an_error_can_always_be_sent),
		cmocka_unit_test(texts_are_clean_utf8),
		cmocka_unit_test(messages_append_until_there_is_no_room),
		cmocka_unit_test(codes_keep_their_meaning),
		cmocka_unit_test(another_version_is_told_apart_first),
		cmocka_unit_test(routing_key_is_xxh64),
		cmocka_unit_test(planes_have_the_bytes_of_the_table),
		cmocka_unit_test(planes_have_names_capabilities_and_backgrounds),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
