#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "answers.h"
#include "base/clock.h"
#include "server/log.h"

#define MAX_WAITING_PROGRESS 65536

/* ---- the first message ---- */

static void welcome(struct conn *conn, const struct options *options)
{
	double idle_ms = options->idle_timeout * 1000;
	const struct psr_msg_welcome msg = {
		.major = PSR_PROTO_MAJOR,
		.minor = PSR_PROTO_MINOR,
		.capabilities = PSR_CAP_REFINE | PSR_CAP_SHADOWS | PSR_CAP_BUILD | PSR_CAP_PRESETS | PSR_CAP_NORMAL |
		                PSR_CAP_ID | PSR_CAP_WEIGHT | PSR_CAP_WORDS | PSR_CAP_BLOCK | PSR_CAP_RESOLUTION |
		                PSR_CAP_VIEWS | PSR_CAP_BASE | PSR_CAP_SETTINGS | PSR_CAP_DEPTH_U16 | PSR_CAP_PAUSE | PSR_CAP_SHARP |
		                PSR_CAP_TIME_BUDGET | PSR_CAP_ERROR_BOUND | PSR_CAP_RMSE_BOUND |
		                PSR_CAP_BOUND | PSR_CAP_OCTREE | PSR_CAP_DPOINT | PSR_CAP_FETCH | PSR_CAP_LEVELS |
		                PSR_CAP_COLOR_BY | PSR_CAP_FINE | PSR_CAP_SPLATS,
		.max_message = PSR_WIRE_MAX_MESSAGE,
		.max_side = PSR_WIRE_MAX_SIDE,
		.max_pixels = (uint32_t)options->max_pixels,
		.max_instances = PSR_WIRE_MAX_INSTANCES,
		.max_lights = PSR_WIRE_MAX_LIGHTS,
		.max_scenes = PSR_WIRE_MAX_SCENES,
		.max_open = (uint32_t)options->max_open,
		.max_models = (uint32_t)options->max_handles,
		.idle_timeout_ms = options->idle_timeout > 0 && idle_ms < 1 ? 1 : (uint32_t)idle_ms,
		.server = "psrd " PSR_VERSION,
	};
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_welcome_encode(&buf, &msg, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

static int on_hello(struct conn *conn, const struct psr_message *message, struct psr_error *err)
{
	struct sessions *all = conn->all->user->userdata;
	struct psr_msg_hello hello;
	struct session *session;
	int code = psr_msg_hello_decode(&hello, message->payload, message->n, err);

	if (code != PSR_OK)
		return code;
	session = calloc(1, sizeof *session);
	if (session == NULL || handles_init(&session->handles, all->catalogue, (uint32_t)all->options->max_handles) != PSR_OK
	    || flow_init(&session->flow, all->frames, conn) != PSR_OK)
		code = psr_fail(err, PSR_ERR_MEMORY, "the server has no memory for another client");
	else
		code = conn_open(conn, err);
	if (code != PSR_OK) {
		if (session != NULL) {
			frames_forget(all->frames, &session->flow);
			handles_fini(&session->handles);
		}
		free(session);
		return code;
	}
	session->all = all;
	session->conn = conn;
	conn->session = session;
	log_info("connection %llu: %s", (unsigned long long)conn->number, hello.client);
	welcome(conn, all->options);
	return PSR_OK;
}

static void on_end(struct conn *conn)
{
	struct session *session = conn->session;

	if (session == NULL)
		return;
	frames_forget(session->all->frames, &session->flow);
	opener_forget(session->all->opener, session);
	fetches_forget(session);
	for (size_t i = 0; i < PSR_WIRE_MAX_SCENES; i++)
		scene_unref(session->slot[i]);
	handles_fini(&session->handles);
	free(session);
}

/* ---- requests that stay open: their ends ---- */

static void refuse_open(struct session *session, uint32_t id, int code, const char *text)
{
	session->n_open--;
	conn_send_error(session->conn, id, 0, code, text);
}

static void send_superseded(struct session *session, uint32_t id, uint16_t view, uint32_t by)
{
	const struct psr_msg_superseded msg = { .by = by };
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_superseded_encode(&buf, id, view, &msg, NULL) == PSR_OK)
		conn_send_last(session->conn, id, &buf);
}

static void send_cancelled(struct session *session, uint32_t id, uint16_t view)
{
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_cancelled_encode(&buf, id, view, NULL) == PSR_OK)
		conn_send_last(session->conn, id, &buf);
}

void sessions_on_frame_end(struct flow *flow, const struct frames_end *end)
{
	struct session *session = flow->conn->session;

	session->n_open -= end->view == 0;
	if (end->outcome == FRAMES_SUPERSEDED)
		send_superseded(session, end->id, end->view, end->by);
	else if (end->outcome == FRAMES_CANCELLED)
		send_cancelled(session, end->id, end->view);
	else if (end->outcome == FRAMES_FAILED)
		conn_send_error(session->conn, end->id, end->view, end->code, end->text);
}

static void on_progress(void *client, uint32_t id, const struct psr_msg_progress *progress)
{
	struct session *session = client;
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (session->conn->out.size > MAX_WAITING_PROGRESS || psr_msg_progress_encode(&buf, id, progress, NULL) != PSR_OK)
		return; /* a reader that takes nothing gets no progress, which would only pile up */
	conn_send(session->conn, &buf);
	conn_flush(session->conn);
}

static void on_opened(void *client, uint32_t id, struct catalogue_model *model)
{
	struct session *session = client;
	struct psr_error error;
	int code = answer_opened(session, id, model, &error);

	if (code != PSR_OK)
		refuse_open(session, id, code, error.text);
	else
		session->n_open--;
	conn_flush(session->conn);
}

static void on_refused(void *client, uint32_t id, int code, const char *text)
{
	struct session *session = client;

	refuse_open(session, id, code, text);
	conn_flush(session->conn);
}

const struct opener_user sessions_opener_user = { on_progress, on_opened, on_refused };

void sessions_refuse(struct session *session, int code, const char *text)
{
	uint32_t id;

	while ((id = lists_end(&session->lists)) != 0)
		refuse_open(session, id, code, text);
	fetches_refuse(session, code, text);
}

/* ---- messages ---- */

static int cancel(struct session *session, uint32_t id, uint16_t view, struct psr_error *err)
{
	const int code = frames_cancel(session->all->frames, &session->flow, id, view);

	if (code == PSR_ERR_PROTOCOL)
		return psr_fail(err, code, "CANCEL names view %u, and request %" PRIu32 " belongs to another", view, id);
	if (code == 0 && opener_cancel(session->all->opener, session, id)) {
		session->n_open--;
		send_cancelled(session, id, 0);
	} else if (code == 0 && fetches_cancel(session, id)) {
		send_cancelled(session, id, 0);
	}
	return PSR_OK;
}

static int is_request(unsigned type)
{
	return type == PSR_MSG_LIST || type == PSR_MSG_OPEN || type == PSR_MSG_CLOSE || type == PSR_MSG_SCENE
	       || type == PSR_MSG_FRAME || type == PSR_MSG_STATS || type == PSR_MSG_PRESETS || type == PSR_MSG_PAUSE
	       || type == PSR_MSG_RESUME || type == PSR_MSG_FETCH;
}

/* A bad value ends only the request; a message that breaks the protocol is an error, and ends the connection. */
static int refuse_or_break(struct session *session, const struct psr_message *message, int code,
                           const struct psr_error *error, struct psr_error *err)
{
	if (code == PSR_ERR_PROTOCOL || !is_request(message->type))
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s", error->text);
	if (message->type == PSR_MSG_FRAME)
		frames_stats(session->all->frames)->failed++;
	conn_send_error(session->conn, message->id, message->view, code, error->text);
	return PSR_OK;
}

/* LIST, OPEN, PRESETS, FRAME, STATS, FETCH: their ids stay open until they are answered. */
static int take_open_id(struct session *session, const struct psr_message *message, struct psr_error *err)
{
	union {
		struct psr_msg_open open;
		struct psr_msg_presets presets;
		struct psr_msg_frame frame;
		struct psr_msg_fetch fetch;
	} msg;
	struct psr_error error;
	char text[PSR_ERROR_TEXT];
	int code = PSR_OK;

	if (message->type == PSR_MSG_OPEN)
		code = psr_msg_open_decode(&msg.open, message->payload, message->n, &error);
	else if (message->type == PSR_MSG_PRESETS)
		code = psr_msg_presets_decode(&msg.presets, message->payload, message->n, &error);
	else if (message->type == PSR_MSG_FRAME)
		code = psr_msg_frame_decode(&msg.frame, message->payload, message->n, &error);
	else if (message->type == PSR_MSG_FETCH)
		code = psr_msg_fetch_decode(&msg.fetch, message->payload, message->n, &error);
	if (code != PSR_OK)
		return refuse_or_break(session, message, code, &error, err);
	if (message->view == 0 && session->n_open >= (uint32_t)session->all->options->max_open) {
		snprintf(text, sizeof text, "%" PRIu32 " requests of this connection are unanswered; wait for one to end",
		         session->n_open);
		conn_send_error(session->conn, message->id, message->view, PSR_ERR_BUSY, text);
		return PSR_OK;
	}
	session->n_open += message->view == 0;
	if (message->type == PSR_MSG_OPEN) {
		opener_open(session->all->opener, session, message->id, &msg.open);
	} else if (message->type == PSR_MSG_FETCH) {
		fetches_ask(session, message->id, &msg.fetch);
	} else if (message->type == PSR_MSG_FRAME) {
		frames_ask(session->all->frames, &session->flow, message, &msg.frame, session->slot[msg.frame.slot]);
	} else if (message->type == PSR_MSG_LIST) {
		lists_ask(&session->lists, message->id);
		conn_go_on(session->conn);
	} else {
		session->n_open--;
		if (message->type == PSR_MSG_PRESETS)
			answer_presets(session, message->id, msg.presets.handle);
		else
			answer_stats(session, message->id);
	}
	return PSR_OK;
}

static int take_scene(struct session *session, const struct psr_message *message, struct psr_error *err)
{
	struct psr_msg_scene *msg = &session->all->scene;
	struct psr_error error;
	struct scene *scene = NULL;
	unsigned slot = message->n >= 2 ? message->payload[0] | (unsigned)message->payload[1] << 8 : PSR_WIRE_MAX_SCENES;
	int code = psr_msg_scene_decode(msg, message->payload, message->n, &error);

	if (code == PSR_OK)
		code = scene_create(&scene, &session->handles, msg, &error);
	if (slot < PSR_WIRE_MAX_SCENES) { /* a SCENE that fails leaves its slot empty */
		scene_unref(session->slot[slot]);
		session->slot[slot] = scene;
	}
	return code == PSR_OK ? PSR_OK : refuse_or_break(session, message, code, &error, err);
}

static void pause(struct session *session, const struct psr_message *message)
{
	char text[PSR_ERROR_TEXT];

	if (message->view < SCHEDULE_VIEWS) {
		frames_pause(session->all->frames, &session->flow, message->view, message->type == PSR_MSG_PAUSE);
		return;
	}
	snprintf(text, sizeof text, "this server has views 0 to %d, not %u", SCHEDULE_VIEWS - 1, message->view);
	conn_send_error(session->conn, message->id, message->view, PSR_ERR_LIMIT, text);
}

static int on_message(struct conn *conn, const struct psr_message *message, struct psr_error *err)
{
	struct session *session = conn->session;
	struct psr_error error;
	union {
		struct psr_msg_ping ping;
		struct psr_msg_close close;
		struct psr_msg_goodbye goodbye;
		struct psr_msg_ack ack;
	} msg;
	int code;

	if (is_request(message->type)) {
		if (message->id <= session->last_id)
			return psr_fail(err, PSR_ERR_PROTOCOL,
			                "%s has id %" PRIu32 ", but ids rise and %" PRIu32 " was there before",
			                psr_msg_name(message->type), message->id, session->last_id);
		session->last_id = message->id;
	}
	switch (message->type) {
	case PSR_MSG_LIST:
	case PSR_MSG_OPEN:
	case PSR_MSG_PRESETS:
	case PSR_MSG_FRAME:
	case PSR_MSG_STATS:
	case PSR_MSG_FETCH:
		return take_open_id(session, message, err);
	case PSR_MSG_SCENE:
		return take_scene(session, message, err);
	case PSR_MSG_CLOSE:
		code = psr_msg_close_decode(&msg.close, message->payload, message->n, &error);
		if (code != PSR_OK)
			return refuse_or_break(session, message, code, &error, err);
		if (!handles_close(&session->handles, msg.close.handle))
			refuse_handle(session, message->id, msg.close.handle);
		return PSR_OK;
	case PSR_MSG_CANCEL:
		return cancel(session, message->id, message->view, err);
	case PSR_MSG_PING:
		code = psr_msg_ping_decode(&msg.ping, message->payload, message->n, err);
		if (code == PSR_OK)
			answer_ping(session, &msg.ping);
		return code;
	case PSR_MSG_PONG:
		return psr_msg_ping_decode(&msg.ping, message->payload, message->n, err);
	case PSR_MSG_ACK:
		code = psr_msg_ack_decode(&msg.ack, message->payload, message->n, err);
		if (code == PSR_OK && message->view < SCHEDULE_VIEWS)
			frames_acknowledge(session->all->frames, &session->flow, message->view, message->id, msg.ack.pass);
		return code;
	case PSR_MSG_GOODBYE:
		code = psr_msg_goodbye_decode(&msg.goodbye, message->payload, message->n, err);
		if (code == PSR_OK)
			conn_drain(conn);
		return code;
	case PSR_MSG_PAUSE:
	case PSR_MSG_RESUME:
		pause(session, message);
		return PSR_OK;
	default:
		return psr_fail(err, PSR_ERR_PROTOCOL, "a client does not send %s",
		                psr_msg_name(message->type) != NULL ? psr_msg_name(message->type) : "this type");
	}
}

static int is_busy(const struct conn *conn)
{
	const struct session *session = conn->session;

	return session != NULL && session->n_open > 0;
}

static int on_part(struct conn *conn)
{
	return answer_list_part(conn->session);
}

static void on_room(void *userdata)
{
	struct sessions *all = userdata;

	frames_pump(all->frames);
	fetches_pump(all);
}

static void on_sent(const struct outq_chunk *chunk, void *userdata)
{
	struct sessions *all = userdata;

	histogram_add(&frames_stats(all->frames)->answered, clock_ns() - chunk->asked_ns);
}

void sessions_conn_user(struct conn_user *user, struct sessions *sessions)
{
	*user = (struct conn_user){ .on_hello = on_hello, .on_message = on_message, .is_busy = is_busy,
		                        .on_part = on_part, .on_room = on_room, .on_sent = on_sent, .on_end = on_end,
		                        .userdata = sessions };
}
