#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "answers.h"
#include "base/clock.h"
#include "model/blocks.h"

int answer_opened(struct session *session, uint32_t id, struct catalogue_model *model, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(model->model);
	const struct psr_blocks *blocks = psr_model_blocks(model->model);
	struct psr_msg_opened msg = {
		.handle = handles_next(&session->handles), .representations = 1u << PSR_WIRE_REP_BLOCKS,
		.scale = info->scale, .spacing = info->spacing, .resolution = info->resolution, .n_levels = blocks->n_levels,
		.n_samples = blocks->n_samples, .n_blocks = blocks->n_blocks, .bytes = model->bytes,
	};
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (msg.handle == 0)
		return psr_fail(err, PSR_ERR_LIMIT, "this connection has %" PRIu32 " models open, the most it may; CLOSE some",
		                session->handles.n);
	psr_model_content_id(model->model, msg.content_id);
	memcpy(msg.box_min, info->box_min, sizeof msg.box_min);
	memcpy(msg.box_max, info->box_max, sizeof msg.box_max);
	memcpy(msg.origin, info->origin, sizeof msg.origin);
	if (psr_msg_opened_encode(&buf, id, &msg, err) != PSR_OK) /* such as a box beyond what the wire allows */
		return PSR_ERR_LIMIT;
	handles_add(&session->handles, model);
	conn_send(session->conn, &buf);
	return PSR_OK;
}

void refuse_handle(struct session *session, uint32_t id, uint32_t handle)
{
	char text[PSR_ERROR_TEXT];

	snprintf(text, sizeof text, "no open model has handle %" PRIu32, handle);
	conn_send_error(session->conn, id, 0, PSR_ERR_NOT_FOUND, text);
}

void answer_list(struct session *session, uint32_t id)
{
	const struct catalogue *catalogue = session->all->catalogue;
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
			conn_send(session->conn, &buf);
	}
	buf = (struct psr_buf){ .data = bytes, .capacity = sizeof bytes };
	if (psr_msg_list_end_encode(&buf, id, &end, NULL) == PSR_OK)
		conn_send(session->conn, &buf);
}

void answer_stats(struct session *session, uint32_t id)
{
	const struct sessions *all = session->all;
	const struct frames_stats *frames = frames_stats(all->frames);
	const struct psr_msg_stat stats[] = {
		{ PSR_STAT_UPTIME_US, clock_ns() / 1000 - all->start_us },
		{ PSR_STAT_CONNECTIONS, all->conns->n },
		{ PSR_STAT_CONNECTIONS_TOTAL, all->conns->n_ever },
		{ PSR_STAT_MODELS, all->catalogue->n_models },
		{ PSR_STAT_MODEL_BYTES, all->catalogue->bytes },
		{ PSR_STAT_FRAMES, frames->drawn },
		{ PSR_STAT_FRAMES_FAILED, frames->failed },
		{ PSR_STAT_FRAMES_WAITING, frames_waiting(all->frames) },
		{ PSR_STAT_BYTES_SENT, all->conns->bytes_sent },
		{ PSR_STAT_BYTES_RECEIVED, all->conns->bytes_received },
		{ PSR_STAT_FRAMES_SUPERSEDED, 0 },
		{ PSR_STAT_FRAMES_CANCELLED, frames->cancelled },
		{ PSR_STAT_THREADS, (uint64_t)psr_pool_threads(all->pool) },
		{ PSR_STAT_DROPPED_PEERS, all->conns->n_dropped },
	};
	struct psr_msg_stats_reply reply = { .n_stats = sizeof stats / sizeof stats[0] };
	uint8_t bytes[1024];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	memcpy(reply.stat, stats, sizeof stats);
	if (psr_msg_stats_reply_encode(&buf, id, &reply, NULL) == PSR_OK)
		conn_send(session->conn, &buf);
}

void answer_ping(struct session *session, const struct psr_msg_ping *ping)
{
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_pong_encode(&buf, ping, NULL) == PSR_OK)
		conn_send(session->conn, &buf);
}
