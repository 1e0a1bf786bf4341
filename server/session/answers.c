#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "answers.h"
#include "base/clock.h"
#include "server/log.h"

#define LIST_PART 128 /* entries, up to 305 bytes each */

int answer_opened(struct session *session, uint32_t id, struct catalogue_model *model, struct psr_error *err)
{
	const struct card *card = &model->card;
	const struct psr_model_info *info = &card->info;
	struct psr_msg_opened msg = {
		.handle = handles_next(&session->handles), .representations = (uint8_t)card->representations,
		.colors = (uint8_t)card->colors,
		.octree_levels = (uint8_t)card->prefix.levels, .of_levels = (uint8_t)card->prefix.of_levels,
		.scale = info->scale, .spacing = info->spacing, .resolution = info->resolution, .n_levels = card->n_levels,
		.n_samples = card->n_samples, .n_blocks = card_groups(card, PSR_AUTOMATIC), .bytes = model->bytes,
	};
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (msg.handle == 0)
		return psr_fail(err, PSR_ERR_LIMIT, "this connection has %" PRIu32 " models open, the most it may; CLOSE some",
		                session->handles.n);
	memcpy(msg.content_id, card->content_id, sizeof msg.content_id);
	memcpy(msg.box_min, info->box_min, sizeof msg.box_min);
	memcpy(msg.box_max, info->box_max, sizeof msg.box_max);
	memcpy(msg.origin, info->origin, sizeof msg.origin);
	memcpy(msg.up, info->up, sizeof msg.up);
	if (psr_msg_opened_encode(&buf, id, &msg, err) != PSR_OK) /* for instance a box beyond the wire's range */
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

static void send_entry(struct session *session, const struct catalogue_entry *entry)
{
	struct psr_msg_list_entry msg = { .file_bytes = entry->file.bytes };
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	msg.state = catalogue_is_loaded(entry) ? PSR_ENTRY_LOADED : entry->has_failed ? PSR_ENTRY_FAILED
	            : entry->file.is_source ? PSR_ENTRY_SOURCE : PSR_ENTRY_READY;
	memcpy(msg.content_id, entry->content_id, sizeof msg.content_id);
	memcpy(msg.name, entry->file.name, sizeof msg.name);
	if (psr_msg_list_entry_encode(&buf, lists_id(&session->lists), &msg, NULL) != PSR_OK)
		return;
	conn_send(session->conn, &buf);
	session->lists.n_sent++;
}

/* Goes on by name: the catalogue may have changed since the last part. */
static size_t find_next(const struct catalogue *catalogue, const char *after)
{
	size_t low = 0, high = catalogue->n;

	while (low < high) {
		size_t middle = low + (high - low) / 2;

		if (strcmp(catalogue->entry[middle].file.name, after) <= 0)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

int answer_list_part(struct session *session)
{
	const struct catalogue *catalogue = session->all->catalogue;
	struct lists *lists = &session->lists;
	size_t at = find_next(catalogue, lists->after), end = at + LIST_PART < catalogue->n ? at + LIST_PART : catalogue->n;
	struct psr_msg_list_end msg;
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (lists->n == 0)
		return 0;
	for (; at < end; at++) {
		send_entry(session, &catalogue->entry[at]);
		memcpy(lists->after, catalogue->entry[at].file.name, sizeof lists->after);
	}
	if (end < catalogue->n)
		return 1;
	msg.n_entries = lists->n_sent;
	session->n_open--;
	if (psr_msg_list_end_encode(&buf, lists_end(lists), &msg, NULL) == PSR_OK)
		conn_send(session->conn, &buf);
	return lists->n > 0;
}

void answer_stats(struct session *session, uint32_t id)
{
	const struct sessions *all = session->all;
	const struct frames_stats *frames = frames_stats(all->frames);
	const struct builder_stats builds = builder_stats(all->builder);
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
		{ PSR_STAT_FRAMES_SUPERSEDED, frames->superseded },
		{ PSR_STAT_FRAMES_CANCELLED, frames->cancelled },
		{ PSR_STAT_THREADS, (uint64_t)psr_pool_threads(all->pool) },
		{ PSR_STAT_DROPPED_PEERS, all->conns->n_dropped },
		{ PSR_STAT_MEMORY_BYTES, all->catalogue->bytes + all->catalogue->reserved + frames_bytes(all->frames) +
		                         all->conns->bytes_queued + all->conns->bytes_input },
		{ PSR_STAT_MEMORY_LIMIT, (uint64_t)all->options->max_memory },
		{ PSR_STAT_CONNECTIONS_NEW, all->conns->n - all->conns->n_clients },
		{ PSR_STAT_CONNECTIONS_BUSY, all->conns->n_busy },
		{ PSR_STAT_LOG_DROPPED, log_lost() },
		{ PSR_STAT_FRAMES_TIMED_OUT, frames->late },
		{ PSR_STAT_FRAMES_LACKING, frames_lacking(all->frames) },
		{ PSR_STAT_FRAMES_ON_BASE, frames->on_base },
		{ PSR_STAT_BUILDS, builds.n_running },
		{ PSR_STAT_BUILDS_WAITING, builds.n_waiting },
		{ PSR_STAT_BUILDS_DONE, builds.n_done },
		{ PSR_STAT_BUILDS_FAILED, builds.n_failed },
		{ PSR_STAT_MODELS_LEFT, all->catalogue->n_left },
		{ PSR_STAT_MODELS_RETURNED, all->catalogue->n_returned },
		{ PSR_STAT_DRAW_US, frames->used_ns / 1000 },
		{ PSR_STAT_PEERS_SLOW, all->conns->n_slow },
		{ PSR_STAT_PEERS_SILENT, all->conns->n_idle },
		{ PSR_STAT_ANSWERED_P50_US, histogram_percentile(&frames->answered, 0.5) / 1000 },
		{ PSR_STAT_ANSWERED_P90_US, histogram_percentile(&frames->answered, 0.9) / 1000 },
		{ PSR_STAT_ANSWERED_P99_US, histogram_percentile(&frames->answered, 0.99) / 1000 },
		{ PSR_STAT_ANSWERED_MAX_US, frames->answered.max / 1000 },
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
