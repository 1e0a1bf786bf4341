#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/blocks.h"
#include "server/net/conn.h"
#include "server/frames/frames.h"
#include "server/models/opener.h"
#include "psr/render.h"
#include "server/server.h"
#include "session.h"
#include "presets.h"
#include "scene.h"

int session_init(struct session *session, uint32_t max_handles)
{
	memset(session, 0, sizeof *session);
	session->handle = calloc(max_handles, sizeof *session->handle);
	return session->handle != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

void session_fini(struct session *session, struct catalogue *catalogue)
{
	for (size_t i = 0; i < PSR_WIRE_MAX_SCENES; i++)
		scene_unref(session->slot[i]);
	for (uint32_t i = 0; i < session->n_handles; i++)
		catalogue_unref(catalogue, session->handle[i].model);
	free(session->handle);
	memset(session, 0, sizeof *session);
}

/* Ids that are open for long are counted; LIST, PRESETS and STATS are answered before the next message is read. */
void session_refuse(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text)
{
	conn->session.n_open--;
	conn_send_error(conn, id, view, code, text);
}

void session_opened(struct conn *conn, uint32_t id, struct catalogue_model *model)
{
	struct session *session = &conn->session;
	const struct psr_model_info *info = psr_model_info(model->model);
	const struct psr_blocks *blocks = psr_model_blocks(model->model);
	struct psr_msg_opened msg = {
		.handle = session->last_handle + 1, .representations = 1u << PSR_WIRE_REP_BLOCKS, .scale = info->scale,
		.spacing = info->spacing, .resolution = info->resolution, .n_levels = blocks->n_levels,
		.n_samples = blocks->n_samples, .n_blocks = blocks->n_blocks, .bytes = model->bytes,
	};
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };
	uint32_t max = (uint32_t)conn->server->options->max_handles;
	struct psr_error error;
	char text[PSR_ERROR_TEXT];
	int code;

	if (session->n_handles >= max || session->last_handle == UINT32_MAX) {
		snprintf(text, sizeof text, "%" PRIu32 " models are open on this connection, there are no more; CLOSE some",
		         max);
		session_refuse(conn, id, 0, PSR_ERR_LIMIT, text);
		return;
	}
	psr_model_content_id(model->model, msg.content_id);
	memcpy(msg.box_min, info->box_min, sizeof msg.box_min);
	memcpy(msg.box_max, info->box_max, sizeof msg.box_max);
	memcpy(msg.origin, info->origin, sizeof msg.origin);
	code = psr_msg_opened_encode(&buf, id, &msg, &error);
	if (code != PSR_OK) { /* such as a box beyond what the wire allows */
		session_refuse(conn, id, 0, PSR_ERR_LIMIT, error.text);
		return;
	}
	session->handle[session->n_handles++] = (struct handle){
		.number = ++session->last_handle, .model = catalogue_ref(&conn->server->catalogue, model),
	};
	session->n_open--;
	conn_send(conn, &buf);
}

void session_refuse_handle(struct conn *conn, uint32_t id, uint32_t number)
{
	char text[PSR_ERROR_TEXT];

	snprintf(text, sizeof text, "there is no open model with handle %" PRIu32, number);
	conn_send_error(conn, id, 0, PSR_ERR_NOT_FOUND, text);
}

static void send_list(struct conn *conn, uint32_t id)
{
	const struct catalogue *catalogue = &conn->server->catalogue;
	const struct psr_msg_list_end end = { .n_entries = (uint32_t)catalogue->n };
	uint8_t bytes[512];
	struct psr_buf buf;

	for (size_t i = 0; i < catalogue->n; i++) {
		const struct catalogue_entry *entry = &catalogue->entry[i];
		struct psr_msg_list_entry msg = { .file_bytes = entry->file.bytes };

		msg.state = entry->model != NULL ? PSR_ENTRY_LOADED : entry->has_failed ? PSR_ENTRY_FAILED
		            : entry->file.is_source ? PSR_ENTRY_SOURCE : PSR_ENTRY_READY;
		memcpy(msg.content_id, entry->content_id, sizeof msg.content_id);
		memcpy(msg.name, entry->file.name, sizeof msg.name);
		buf = (struct psr_buf){ .data = bytes, .capacity = sizeof bytes };
		if (psr_msg_list_entry_encode(&buf, id, &msg, NULL) == PSR_OK)
			conn_send(conn, &buf);
	}
	buf = (struct psr_buf){ .data = bytes, .capacity = sizeof bytes };
	if (psr_msg_list_end_encode(&buf, id, &end, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

static void send_stats(struct conn *conn, uint32_t id)
{
	struct psr_msg_stats_reply reply;
	uint8_t bytes[1024];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	server_fill_stats(conn->server, &reply);
	if (psr_msg_stats_reply_encode(&buf, id, &reply, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

static void send_pong(struct conn *conn, const struct psr_msg_ping *ping)
{
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_pong_encode(&buf, ping, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

static void close_handle(struct conn *conn, uint32_t id, uint32_t number)
{
	struct session *session = &conn->session;

	for (uint32_t i = 0; i < session->n_handles; i++) {
		if (session->handle[i].number == number) {
			catalogue_unref(&conn->server->catalogue, session->handle[i].model);
			session->handle[i] = session->handle[--session->n_handles];
			return;
		}
	}
	session_refuse_handle(conn, id, number);
}

static void cancel(struct conn *conn, uint32_t id, uint16_t view)
{
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (frames_cancel(conn->server->frames, conn, id))
		conn->server->stats.frames_cancelled++;
	else if (!opener_cancel(conn->server->opener, conn, id))
		return;
	conn->session.n_open--;
	if (psr_msg_cancelled_encode(&buf, id, view, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

static int check_frame(const struct psr_msg_frame *frame, uint16_t view, const struct server *server,
                       struct psr_error *err)
{
	uint64_t n_pixels = (uint64_t)frame->width * frame->height;

	if (view != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server has no views: FRAME takes view 0, not %u", view);
	if (n_pixels > (uint64_t)server->options->max_pixels)
		return psr_fail(err, PSR_ERR_LIMIT,
		                "a frame of %" PRIu32 "x%" PRIu32 " has %" PRIu64 " pixels; this server draws "
		                "%" PRId64 " at most (--max-pixels)",
		                frame->width, frame->height, n_pixels, server->options->max_pixels);
	if (frame->color_codec == PSR_CODEC_PNG)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server does not send PNG; ask for raw, JPEG or zstd");
	if (frame->planes & 1u << PSR_PLANE_DEPTH && frame->depth_format != PSR_WIRE_DEPTH_F32)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server sends depth as f32 only (format 1), not as format %u",
		                frame->depth_format);
	if (frame->pass_limit > 0 && frame->planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "this server refines colour and depth; other planes take pass_limit 0, not %u",
		                frame->pass_limit);
	if (frame->pass_limit > PSR_MAX_PASS)
		return psr_fail(err, PSR_ERR_LIMIT, "this server refines a picture in %d passes at most, not in %u", PSR_MAX_PASS,
		                frame->pass_limit);
	if (frame->budget == PSR_WIRE_BUDGET_TIME || frame->budget == PSR_WIRE_BUDGET_ERROR)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server keeps no %s; ask with budget 0",
		                frame->budget == PSR_WIRE_BUDGET_TIME ? "time budgets" : "error bounds");
	if (frame->budget == PSR_WIRE_BUDGET_SETTINGS && frame->settings.scale != 1)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server draws with scale 1 only, not %u", frame->settings.scale);
	if (frame->base != 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server sends no changes to a base: base takes 0, not %" PRIu32,
		                frame->base);
	return PSR_OK;
}

static void ask_frame(struct conn *conn, const struct psr_message *message, const struct psr_msg_frame *frame)
{
	struct scene *scene = conn->session.slot[frame->slot];
	struct psr_error error;
	int code = check_frame(frame, message->view, conn->server, &error);

	if (code == PSR_OK && scene == NULL)
		code = psr_fail(&error, PSR_ERR_NOT_FOUND, "slot %u holds no scene: send SCENE first", frame->slot);
	if (code != PSR_OK) {
		conn->server->stats.frames_failed++;
		session_refuse(conn, message->id, message->view, code, error.text);
		return;
	}
	frames_ask(conn->server->frames, conn, message->id, frame, scene);
}

static int is_request(unsigned type)
{
	return type == PSR_MSG_LIST || type == PSR_MSG_OPEN || type == PSR_MSG_CLOSE || type == PSR_MSG_SCENE
	       || type == PSR_MSG_FRAME || type == PSR_MSG_STATS || type == PSR_MSG_PRESETS;
}

/* Bad values cost the request; what breaks the protocol is the caller's to answer. */
static int refuse_or_break(struct conn *conn, const struct psr_message *message, int code,
                           const struct psr_error *error, struct psr_error *err)
{
	if (code == PSR_ERR_PROTOCOL || !is_request(message->type))
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s", error->text);
	if (message->type == PSR_MSG_FRAME)
		conn->server->stats.frames_failed++;
	conn_send_error(conn, message->id, message->view, code, error->text);
	return PSR_OK;
}

/* LIST, OPEN, PRESETS, FRAME, STATS: ids that stay open until they are answered. */
static int take_open_id(struct conn *conn, const struct psr_message *message, struct psr_error *err)
{
	union {
		struct psr_msg_open open;
		struct psr_msg_presets presets;
		struct psr_msg_frame frame;
	} msg;
	struct session *session = &conn->session;
	struct psr_error error;
	char text[PSR_ERROR_TEXT];
	int code = PSR_OK;

	if (message->type == PSR_MSG_OPEN)
		code = psr_msg_open_decode(&msg.open, message->payload, message->n, &error);
	else if (message->type == PSR_MSG_PRESETS)
		code = psr_msg_presets_decode(&msg.presets, message->payload, message->n, &error);
	else if (message->type == PSR_MSG_FRAME)
		code = psr_msg_frame_decode(&msg.frame, message->payload, message->n, &error);
	if (code != PSR_OK)
		return refuse_or_break(conn, message, code, &error, err);
	if (session->n_open >= (uint32_t)conn->server->options->max_open) {
		snprintf(text, sizeof text, "%" PRIu32 " requests of this connection are unanswered; wait for one to end",
		         session->n_open);
		conn_send_error(conn, message->id, message->view, PSR_ERR_BUSY, text);
		return PSR_OK;
	}
	session->n_open++;
	if (message->type == PSR_MSG_OPEN) {
		opener_open(conn->server->opener, conn, message->id, &msg.open);
	} else if (message->type == PSR_MSG_FRAME) {
		ask_frame(conn, message, &msg.frame);
	} else {
		session->n_open--;
		if (message->type == PSR_MSG_LIST)
			send_list(conn, message->id);
		else if (message->type == PSR_MSG_PRESETS)
			session_send_presets(conn, message->id, msg.presets.handle);
		else
			send_stats(conn, message->id);
	}
	return PSR_OK;
}

static int take_scene(struct conn *conn, const struct psr_message *message, struct psr_error *err)
{
	struct psr_msg_scene *msg = &conn->server->scene;
	struct session *session = &conn->session;
	struct psr_error error;
	struct scene *scene = NULL;
	unsigned slot = message->n >= 2 ? message->payload[0] | (unsigned)message->payload[1] << 8 : PSR_WIRE_MAX_SCENES;
	int code = psr_msg_scene_decode(msg, message->payload, message->n, &error);

	if (code == PSR_OK)
		code = scene_create(&scene, session, &conn->server->catalogue, msg, &error);
	if (slot < PSR_WIRE_MAX_SCENES) { /* a SCENE that fails leaves its slot empty */
		scene_unref(session->slot[slot]);
		session->slot[slot] = scene;
	}
	return code == PSR_OK ? PSR_OK : refuse_or_break(conn, message, code, &error, err);
}

int session_take(struct conn *conn, const struct psr_message *message, struct psr_error *err)
{
	struct psr_error error;
	union {
		struct psr_msg_ping ping;
		struct psr_msg_close close;
		struct psr_msg_goodbye goodbye;
		struct psr_msg_ack ack;
	} msg;
	int code;

	if (is_request(message->type)) {
		if (message->id <= conn->session.last_id)
			return psr_fail(err, PSR_ERR_PROTOCOL,
			                "%s has id %" PRIu32 ", but ids rise and %" PRIu32 " was there before",
			                psr_msg_name(message->type), message->id, conn->session.last_id);
		conn->session.last_id = message->id;
	}
	switch (message->type) {
	case PSR_MSG_LIST:
	case PSR_MSG_OPEN:
	case PSR_MSG_PRESETS:
	case PSR_MSG_FRAME:
	case PSR_MSG_STATS:
		return take_open_id(conn, message, err);
	case PSR_MSG_SCENE:
		return take_scene(conn, message, err);
	case PSR_MSG_CLOSE:
		code = psr_msg_close_decode(&msg.close, message->payload, message->n, &error);
		if (code != PSR_OK)
			return refuse_or_break(conn, message, code, &error, err);
		close_handle(conn, message->id, msg.close.handle);
		return PSR_OK;
	case PSR_MSG_CANCEL:
		cancel(conn, message->id, message->view);
		return PSR_OK;
	case PSR_MSG_PING:
		code = psr_msg_ping_decode(&msg.ping, message->payload, message->n, err);
		if (code == PSR_OK)
			send_pong(conn, &msg.ping);
		return code;
	case PSR_MSG_PONG:
		return psr_msg_ping_decode(&msg.ping, message->payload, message->n, err);
	case PSR_MSG_ACK: /* of no frame: none is ever sent in a view > 0 */
		return psr_msg_ack_decode(&msg.ack, message->payload, message->n, err);
	case PSR_MSG_GOODBYE:
		code = psr_msg_goodbye_decode(&msg.goodbye, message->payload, message->n, err);
		if (code == PSR_OK)
			conn_drain(conn);
		return code;
	case PSR_MSG_PAUSE:
	case PSR_MSG_RESUME:
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server offers neither PAUSE nor RESUME (capability bit 18)");
	default:
		return psr_fail(err, PSR_ERR_PROTOCOL, "a client does not send %s",
		                psr_msg_name(message->type) != NULL ? psr_msg_name(message->type) : "this type");
	}
}
