/* All messages of the protocol behind one signature, with their fields, for tests and the fuzzer. */
#ifndef PROTO_TABLE_H
#define PROTO_TABLE_H

#include <stddef.h>
#include "proto/proto.h"

union proto_any {
	struct psr_msg_hello hello;
	struct psr_msg_welcome welcome;
	struct psr_msg_goodbye goodbye;
	struct psr_msg_ping ping;
	struct psr_msg_error error;
	struct psr_msg_list_entry list_entry;
	struct psr_msg_list_end list_end;
	struct psr_msg_open open;
	struct psr_msg_progress progress;
	struct psr_msg_opened opened;
	struct psr_msg_close close;
	struct psr_msg_presets presets;
	struct psr_msg_preset preset;
	struct psr_msg_presets_end presets_end;
	struct psr_msg_scene scene;
	struct psr_msg_frame frame;
	struct psr_msg_frame_begin frame_begin;
	struct psr_msg_rect rect;
	struct psr_msg_frame_end frame_end;
	struct psr_msg_superseded superseded;
	struct psr_msg_ack ack;
	struct psr_msg_stats_reply stats_reply;
	struct psr_msg_fetch fetch;
	struct psr_msg_fetch_part fetch_part;
	struct psr_msg_fetch_end fetch_end;
};

/* F_KIND and F_EXTENT are of a struct psr_camera: its kind, counted from 1, and the angle or height that goes with it. */
enum proto_kind { F_END, F_U8, F_U16, F_U32, F_U64, F_F64, F_TEXT, F_HEX, F_LIST, F_DATA, F_KIND, F_EXTENT };

struct proto_field {
	const char *name; /* as in vectors.txt: "camera.eye", or the list's name */
	enum proto_kind kind;
	size_t offset;
	unsigned n;       /* elements of an array; bytes of F_HEX */
	const struct proto_field *sub;
	size_t stride;
};

struct proto_case {
	unsigned type;
	int (*encode)(struct psr_buf *out, uint32_t id, uint16_t view, const void *msg, struct psr_error *err);
	int (*decode)(void *msg, const uint8_t *payload, size_t n, struct psr_error *err); /* NULL: no payload */
	const struct proto_field *field;
};

#define PLAIN_ENCODE(name) \
	static int encode_##name(struct psr_buf *out, uint32_t id, uint16_t view, const void *m, struct psr_error *err) \
	{ \
		(void)id; \
		(void)view; \
		return psr_msg_##name##_encode(out, m, err); \
	}
#define ID_ENCODE(name) \
	static int encode_##name(struct psr_buf *out, uint32_t id, uint16_t view, const void *m, struct psr_error *err) \
	{ \
		(void)view; \
		return psr_msg_##name##_encode(out, id, m, err); \
	}
#define VIEW_ENCODE(name) \
	static int encode_##name(struct psr_buf *out, uint32_t id, uint16_t view, const void *m, struct psr_error *err) \
	{ \
		return psr_msg_##name##_encode(out, id, view, m, err); \
	}
#define DECODE(name) \
	static int decode_##name(void *m, const uint8_t *payload, size_t n, struct psr_error *err) \
	{ \
		return psr_msg_##name##_decode(m, payload, n, err); \
	}
#define EMPTY(name, ...) \
	static int encode_##name(struct psr_buf *out, uint32_t id, uint16_t view, const void *m, struct psr_error *err) \
	{ \
		(void)id; \
		(void)view; \
		(void)m; \
		return psr_msg_##name##_encode(out, __VA_ARGS__, err); \
	}
PLAIN_ENCODE(hello) PLAIN_ENCODE(welcome) PLAIN_ENCODE(goodbye) PLAIN_ENCODE(ping) PLAIN_ENCODE(pong)
ID_ENCODE(list_entry) ID_ENCODE(list_end) ID_ENCODE(open) ID_ENCODE(progress) ID_ENCODE(opened) ID_ENCODE(close)
ID_ENCODE(presets) ID_ENCODE(preset) ID_ENCODE(presets_end) ID_ENCODE(scene) ID_ENCODE(stats_reply)
ID_ENCODE(fetch) ID_ENCODE(fetch_part) ID_ENCODE(fetch_end)
VIEW_ENCODE(error) VIEW_ENCODE(frame) VIEW_ENCODE(frame_begin) VIEW_ENCODE(rect) VIEW_ENCODE(frame_end)
VIEW_ENCODE(superseded) VIEW_ENCODE(ack)
EMPTY(list, id) EMPTY(cancelled, id, view) EMPTY(cancel, id, view) EMPTY(pause, id, view) EMPTY(resume, id, view)
EMPTY(stats, id)
DECODE(hello) DECODE(welcome) DECODE(goodbye) DECODE(ping) DECODE(error) DECODE(list_entry) DECODE(list_end)
DECODE(open) DECODE(progress) DECODE(opened) DECODE(close) DECODE(scene) DECODE(frame) DECODE(frame_begin) DECODE(rect)
DECODE(presets) DECODE(preset) DECODE(presets_end) DECODE(frame_end) DECODE(superseded) DECODE(ack) DECODE(stats_reply)
DECODE(fetch) DECODE(fetch_part) DECODE(fetch_end)

#define AT(type, name, kind) { #name, kind, offsetof(struct psr_msg_##type, name), 1, NULL, 0 }
#define ARRAY(type, name, kind, n) { #name, kind, offsetof(struct psr_msg_##type, name), n, NULL, 0 }
#define LIST(type, name, n, sub, item) \
	{ #name, F_LIST, offsetof(struct psr_msg_##type, name), n, sub, sizeof(struct psr_msg_##item) }
#define END { NULL, F_END, 0, 0, NULL, 0 }

static const struct proto_field fields_hello[] = { AT(hello, major, F_U16), AT(hello, minor, F_U16),
	AT(hello, routing_key, F_U64), AT(hello, capabilities, F_U64), AT(hello, token, F_TEXT),
	AT(hello, client, F_TEXT), END };
static const struct proto_field fields_welcome[] = { AT(welcome, major, F_U16), AT(welcome, minor, F_U16),
	AT(welcome, capabilities, F_U64), AT(welcome, max_message, F_U32), AT(welcome, max_side, F_U32),
	AT(welcome, max_pixels, F_U32), AT(welcome, max_instances, F_U32), AT(welcome, max_lights, F_U32),
	AT(welcome, max_scenes, F_U32), AT(welcome, max_open, F_U32), AT(welcome, max_models, F_U32),
	AT(welcome, idle_timeout_ms, F_U32), AT(welcome, server, F_TEXT), END };
static const struct proto_field fields_goodbye[] = { AT(goodbye, reason, F_U16), AT(goodbye, text, F_TEXT), END };
static const struct proto_field fields_ping[] = { AT(ping, token, F_U64), END };
static const struct proto_field fields_error[] = { AT(error, code, F_U16), AT(error, text, F_TEXT), END };
static const struct proto_field fields_list_entry[] = { AT(list_entry, state, F_U8), AT(list_entry, file_bytes, F_U64),
	ARRAY(list_entry, content_id, F_HEX, 16), AT(list_entry, name, F_TEXT), END };
static const struct proto_field fields_list_end[] = { AT(list_end, n_entries, F_U32), END };
static const struct proto_field fields_open[] = { AT(open, resolution, F_U16), AT(open, levels, F_U8),
	AT(open, name, F_TEXT), END };
static const struct proto_field fields_progress[] = { AT(progress, stage, F_U16), AT(progress, done, F_U64),
	AT(progress, total, F_U64), END };
static const struct proto_field fields_opened[] = { AT(opened, handle, F_U32), AT(opened, representations, F_U8),
	AT(opened, colors, F_U8), AT(opened, octree_levels, F_U8), AT(opened, of_levels, F_U8),
	ARRAY(opened, content_id, F_HEX, 16), ARRAY(opened, box_min, F_F64, 3), ARRAY(opened, box_max, F_F64, 3),
	ARRAY(opened, origin, F_F64, 3), AT(opened, scale, F_F64), AT(opened, spacing, F_F64),
	AT(opened, resolution, F_U32), AT(opened, n_levels, F_U32), AT(opened, n_samples, F_U64),
	AT(opened, n_blocks, F_U64), AT(opened, bytes, F_U64), ARRAY(opened, up, F_F64, 3), END };
static const struct proto_field fields_close[] = { AT(close, handle, F_U32), END };
static const struct proto_field fields_instance[] = { AT(instance, handle, F_U32), AT(instance, representation, F_U8),
	AT(instance, color_by, F_U8),
	ARRAY(instance, rotation, F_F64, 4), ARRAY(instance, translation, F_F64, 3), AT(instance, scale, F_F64), END };
static const struct proto_field fields_light[] = { AT(light, kind, F_U8), AT(light, flags, F_U8),
	ARRAY(light, color, F_U8, 3), AT(light, intensity, F_F64), ARRAY(light, position, F_F64, 3),
	ARRAY(light, direction, F_F64, 3), AT(light, inner, F_F64), AT(light, outer, F_F64), AT(light, reference, F_F64),
	END };
static const struct proto_field fields_scene[] = { AT(scene, slot, F_U16), AT(scene, flags, F_U16),
	AT(scene, ambient, F_F64), ARRAY(scene, background, F_U8, 3), AT(scene, n_instances, F_U16),
	AT(scene, n_lights, F_U16), LIST(scene, instance, PSR_WIRE_MAX_INSTANCES, fields_instance, instance),
	LIST(scene, light, PSR_WIRE_MAX_LIGHTS, fields_light, light), END };
#define CAMERA(type) { "camera.kind", F_KIND, offsetof(struct psr_msg_##type, camera), 1, NULL, 0 }, ARRAY(type, camera.eye, F_F64, 3), \
	ARRAY(type, camera.target, F_F64, 3), ARRAY(type, camera.up, F_F64, 3), \
	{ "camera.extent", F_EXTENT, offsetof(struct psr_msg_##type, camera), 1, NULL, 0 }, \
	AT(type, camera.near_z, F_F64)
#define PICTURE(type) AT(type, width, F_U32), AT(type, height, F_U32), AT(type, planes, F_U32), \
	AT(type, color_codec, F_U8), AT(type, color_quality, F_U8), AT(type, depth_format, F_U8), \
	AT(type, depth_codec, F_U8), AT(type, data_codec, F_U8), AT(type, settings.scale, F_U8), \
	AT(type, settings.smooth, F_U8), AT(type, settings.pass, F_U8), AT(type, settings.splats, F_U8), \
	AT(type, settings.spacing_px, F_F64), AT(type, base, F_U32)
#define LIGHT(type) AT(type, light.kind, F_U8), AT(type, light.flags, F_U8), ARRAY(type, light.color, F_U8, 3), \
	AT(type, light.intensity, F_F64), ARRAY(type, light.position, F_F64, 3), ARRAY(type, light.direction, F_F64, 3), \
	AT(type, light.inner, F_F64), AT(type, light.outer, F_F64), AT(type, light.reference, F_F64)
static const struct proto_field fields_presets[] = { AT(presets, handle, F_U32), END };
static const struct proto_field fields_preset[] = { AT(preset, kind, F_U8), CAMERA(preset), LIGHT(preset),
	AT(preset, name, F_TEXT), END };
static const struct proto_field fields_presets_end[] = { AT(presets_end, n_cameras, F_U32),
	AT(presets_end, n_lights, F_U32), END };
static const struct proto_field fields_frame[] = { AT(frame, slot, F_U16), AT(frame, pass_limit, F_U16),
	PICTURE(frame), AT(frame, budget, F_U8), AT(frame, flags, F_U16), AT(frame, time_budget_us, F_U64),
	AT(frame, error_bound, F_F64), AT(frame, depth_min, F_F64), AT(frame, depth_max, F_F64), CAMERA(frame), END };
static const struct proto_field fields_frame_begin[] = { AT(frame_begin, pass, F_U16),
	AT(frame_begin, base_pass, F_U16), AT(frame_begin, refine, F_U16),
	PICTURE(frame_begin), ARRAY(frame_begin, background, F_U8, 3), AT(frame_begin, depth_min, F_F64),
	AT(frame_begin, depth_max, F_F64), CAMERA(frame_begin), END };
static const struct proto_field fields_rect[] = { AT(rect, plane, F_U8), AT(rect, codec, F_U8), AT(rect, scale, F_U8),
	AT(rect, x, F_U16), AT(rect, y, F_U16), AT(rect, w, F_U16), AT(rect, h, F_U16), AT(rect, total, F_U32),
	AT(rect, offset, F_U32), AT(rect, bytes, F_U32), AT(rect, data, F_DATA), END };
static const struct proto_field fields_entry[] = { AT(report_entry, id, F_U16), AT(report_entry, ns, F_U64),
	AT(report_entry, count, F_U64), END };
#define HASH(i) { "hash." #i, F_U64, offsetof(struct psr_msg_frame_end, hash) + 8 * i, 1, NULL, 0 }
static const struct proto_field fields_frame_end[] = { AT(frame_end, pass, F_U16), AT(frame_end, is_final, F_U8),
	AT(frame_end, status, F_U8), AT(frame_end, error_px, F_F64), AT(frame_end, planes, F_U32),
	AT(frame_end, has_hashes, F_U8), AT(frame_end, depth_min, F_F64), AT(frame_end, depth_max, F_F64), HASH(0), HASH(1),
	HASH(2), HASH(3), HASH(4), HASH(5), HASH(6), AT(frame_end, n_entries, F_U16),
	LIST(frame_end, entry, PSR_WIRE_MAX_REPORT, fields_entry, report_entry), END };
static const struct proto_field fields_superseded[] = { AT(superseded, by, F_U32), END };
static const struct proto_field fields_ack[] = { AT(ack, pass, F_U16), END };
static const struct proto_field fields_stat[] = { AT(stat, id, F_U16), AT(stat, value, F_U64), END };
static const struct proto_field fields_stats_reply[] = { AT(stats_reply, n_stats, F_U16),
	LIST(stats_reply, stat, PSR_WIRE_MAX_STATS, fields_stat, stat), END };
static const struct proto_field fields_fetch[] = { AT(fetch, handle, F_U32), AT(fetch, offset, F_U64),
	AT(fetch, length, F_U64), AT(fetch, file_hash, F_U64), AT(fetch, name, F_TEXT), END };
static const struct proto_field fields_fetch_part[] = { AT(fetch_part, offset, F_U64), AT(fetch_part, bytes, F_U32),
	AT(fetch_part, data, F_DATA), END };
static const struct proto_field fields_fetch_end[] = { AT(fetch_end, file_bytes, F_U64), AT(fetch_end, file_hash, F_U64),
	END };
static const struct proto_field fields_none[] = { END };

#define CASE(TYPE, name) { PSR_MSG_##TYPE, encode_##name, decode_##name, fields_##name }
#define BARE(TYPE, name) { PSR_MSG_##TYPE, encode_##name, NULL, fields_none }
static const struct proto_case proto_cases[] = {
	CASE(HELLO, hello), CASE(WELCOME, welcome), CASE(GOODBYE, goodbye), CASE(PING, ping),
	{ PSR_MSG_PONG, encode_pong, decode_ping, fields_ping }, CASE(ERROR, error), BARE(LIST, list),
	CASE(LIST_ENTRY, list_entry), CASE(LIST_END, list_end), CASE(OPEN, open), CASE(PROGRESS, progress),
	CASE(OPENED, opened), CASE(CLOSE, close), CASE(PRESETS, presets), CASE(PRESET, preset),
	CASE(PRESETS_END, presets_end), CASE(SCENE, scene), CASE(FRAME, frame), CASE(FRAME_BEGIN, frame_begin),
	CASE(RECT, rect), CASE(FRAME_END, frame_end), CASE(SUPERSEDED, superseded), BARE(CANCELLED, cancelled),
	CASE(ACK, ack), BARE(CANCEL, cancel), BARE(PAUSE, pause), BARE(RESUME, resume), BARE(STATS, stats),
	CASE(STATS_REPLY, stats_reply), CASE(FETCH, fetch), CASE(FETCH_PART, fetch_part), CASE(FETCH_END, fetch_end),
};
#define N_PROTO_CASES (sizeof proto_cases / sizeof proto_cases[0])

static inline const struct proto_case *proto_case_of(unsigned type)
{
	for (size_t i = 0; i < N_PROTO_CASES; i++)
		if (proto_cases[i].type == type)
			return &proto_cases[i];
	return NULL;
}

/* Returns where a message has the pointer to its data, and how many bytes these are; NULL if it has none. */
static inline const uint8_t **proto_data(unsigned type, union proto_any *msg, uint32_t *n)
{
	if (type != PSR_MSG_RECT && type != PSR_MSG_FETCH_PART)
		return NULL;
	*n = type == PSR_MSG_RECT ? msg->rect.bytes : msg->fetch_part.bytes;
	return type == PSR_MSG_RECT ? &msg->rect.data : &msg->fetch_part.data;
}

/* Unknown values of these bytes of a payload are decoded as another value. */
static inline int proto_falls_back(unsigned type, size_t at)
{
	return type == PSR_MSG_GOODBYE || type == PSR_MSG_PROGRESS ? at < 2 : type == PSR_MSG_LIST_ENTRY ? at == 0 :
	       type == PSR_MSG_FRAME_END && at == 3;
}

/* Whether a decoded message, encoded into `out`, gives the payload that it came from, but for values that fall back and
 * bytes behind the last field. */
static inline int proto_is_kept(const struct proto_case *kind, struct psr_buf *out, const union proto_any *msg,
                                const uint8_t *payload, size_t n)
{
	const uint8_t *again = out->data + out->size + PSR_HEADER_SIZE;

	if (kind->type == PSR_MSG_PRESET && msg->preset.kind == 0) /* of a later version, and nothing of it is kept */
		return payload[0] > PSR_WIRE_PRESET_LIGHT;
	if (kind->encode(out, 1, 1, msg, NULL) != PSR_OK || out->size > PSR_HEADER_SIZE + n)
		return 0;
	for (size_t i = 0; out->data + out->size > again + i; i++)
		if (again[i] != payload[i] && !proto_falls_back(kind->type, i))
			return 0;
	return 1;
}

#endif
