#define _GNU_SOURCE /* ppoll */
#include "daemon.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include "base/clock.h"
#include "base/stats.h"
#include "report.h"

#define MOST_LINKS 128
#define MOST_LATENCIES 100000
#define ANSWER_SECONDS 60 /* for OPEN, STATS and the like */
#define FRAME_0_1_BYTES 16 /* of FRAME that version 0.1 does not have; they are its last */

/* ---- messages out ---- */

void link_send(struct link *link, const uint8_t *data, size_t n)
{
	while (n > 0) {
		const ssize_t sent = send(link->fd, data, n, MSG_NOSIGNAL);

		if (sent < 0 && errno == EINTR)
			continue;
		if (sent < 0) {
			link->is_lost = 1;
			return;
		}
		data += sent;
		n -= (size_t)sent;
	}
}

uint32_t link_ask(struct link *link)
{
	uint8_t data[512];
	struct psr_buf buf = { data, 0, sizeof data };
	struct psr_error err;
	const uint32_t id = link->next_id++;

	scene_film_camera(&link->frame.camera, link->film, (int)(link->n_asked++ % SCENE_FRAMES));
	daemon_must(psr_msg_frame_encode(&buf, id, link->view, &link->frame, &err), "FRAME", &err);
	if (link->minor == 1) {
		buf.size -= FRAME_0_1_BYTES;
		data[0] = (uint8_t)buf.size;
	}
	link->open[link->n_open].id = id;
	link->open[link->n_open++].sent_ns = clock_ns();
	link_send(link, data, buf.size);
	return id;
}

void link_cancel(struct link *link, uint32_t id)
{
	uint8_t data[64];
	struct psr_buf buf = { data, 0, sizeof data };
	struct psr_error err;

	daemon_must(psr_msg_cancel_encode(&buf, id, link->view, &err), "CANCEL", &err);
	link_send(link, data, buf.size);
}

static void acknowledge(struct link *link, const struct psr_message *message)
{
	const struct psr_msg_ack ack = { .pass = (uint16_t)link->last_pass };
	uint8_t data[64];
	struct psr_buf buf = { data, 0, sizeof data };
	struct psr_error err;

	daemon_must(psr_msg_ack_encode(&buf, message->id, message->view, &ack, &err), "ACK", &err);
	link_send(link, data, buf.size);
}

/* ---- messages in ---- */

static void note_latency(struct link *link, double ms)
{
	if (link->n_latencies == link->capacity) {
		if (link->capacity >= MOST_LATENCIES)
			return;
		link->capacity = link->capacity == 0 ? 1024 : 2 * link->capacity;
		link->latency_ms = realloc(link->latency_ms, link->capacity * sizeof *link->latency_ms);
		if (link->latency_ms == NULL)
			report_die("memory", "there is not enough");
	}
	link->latency_ms[link->n_latencies++] = ms;
}

/* Returns when the request was sent, 0 if it is not open. */
static uint64_t end_request(struct link *link, uint32_t id)
{
	for (unsigned i = 0; i < link->n_open; i++) {
		const uint64_t sent_ns = link->open[i].sent_ns;

		if (link->open[i].id != id)
			continue;
		link->open[i] = link->open[--link->n_open];
		return sent_ns;
	}
	return 0;
}

/* Other builds' ENDs may be of an older protocol. */
static void note_cores(struct link *link, const struct psr_message *message)
{
	struct psr_msg_frame_end end;

	if (psr_msg_frame_end_decode(&end, message->payload, message->n, NULL) != PSR_OK)
		return;
	for (unsigned i = 0; i < end.n_entries; i++)
		if (end.entry[i].id == PSR_WIRE_REPORT_CORES)
			link->cores_s += (double)end.entry[i].ns * 1e-9;
}

static void on_frame_end(struct link *link, const struct psr_message *message)
{
	const unsigned pass = message->payload[0] | (unsigned)message->payload[1] << 8;

	link->last_ns = clock_ns();
	link->last_id = message->id;
	link->last_pass = pass;
	note_cores(link, message);
	if (message->view > 0)
		acknowledge(link, message);
	if (!message->payload[2])
		return;
	note_latency(link, (double)(link->last_ns - end_request(link, message->id)) * 1e-6);
	link->n_done++;
}

static void on_error(struct link *link, const struct psr_message *message)
{
	struct psr_msg_error error;

	if (psr_msg_error_decode(&error, message->payload, message->n, NULL) == PSR_OK && link->error.code == PSR_OK)
		psr_fail(&link->error, psr_wire_error_to(error.code), "%s", error.text);
	if (message->id == 0)
		link->is_lost = 1;
	link->n_failed += end_request(link, message->id) != 0;
}

static uint32_t u32_at(const uint8_t *p)
{
	return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* A handle is the first field of OPENED in all versions. */
static void on_message(struct link *link, const struct psr_message *message)
{
	switch (message->type) {
	case PSR_MSG_FRAME_END:
		on_frame_end(link, message);
		break;
	case PSR_MSG_SUPERSEDED:
	case PSR_MSG_CANCELLED:
		end_request(link, message->id);
		break;
	case PSR_MSG_ERROR:
		on_error(link, message);
		break;
	case PSR_MSG_OPENED:
		link->handle = u32_at(message->payload);
		break;
	case PSR_MSG_STATS_REPLY:
		if (psr_msg_stats_reply_decode(&link->stats, message->payload, message->n, NULL) != PSR_OK)
			report_die("STATS_REPLY", "is not understood");
		break;
	default:
		return;
	}
	link->n_replies++;
}

/* Whole messages from the front of the storage. Not the framer of proto, which refuses what older servers send. */
static void take_messages(struct link *link)
{
	size_t at = 0;

	while (link->n_stored - at >= PSR_HEADER_SIZE) {
		const uint8_t *p = link->storage + at;
		const uint32_t length = u32_at(p), type_flags = u32_at(p + 4);
		const struct psr_message message = { .type = (uint16_t)type_flags, .id = u32_at(p + 8),
			                                 .view = (uint16_t)u32_at(p + 12), .payload = p + PSR_HEADER_SIZE,
			                                 .n = length - PSR_HEADER_SIZE };

		if (length < PSR_HEADER_SIZE || length > PSR_WIRE_MAX_MESSAGE)
			report_die("psrd", "sends what is no message");
		if (length > link->n_stored - at)
			break;
		on_message(link, &message);
		at += length;
	}
	link->n_stored -= at;
	memmove(link->storage, link->storage + at, link->n_stored);
}

/* Takes what has come. */
static void take(struct link *link)
{
	const ssize_t n = recv(link->fd, link->storage + link->n_stored, LINK_STORAGE_BYTES - link->n_stored, MSG_DONTWAIT);

	if (n < 0 && (errno == EAGAIN || errno == EINTR))
		return;
	if (n <= 0) {
		link->is_lost = 1;
		return;
	}
	link->n_stored += (size_t)n;
	take_messages(link);
}

/* ---- many at once ---- */

/* Sends what is due; returns when the next request is due. */
static uint64_t ask_due(struct link *link, uint64_t now_ns)
{
	while (!link->is_lost && link->n_open < link->n_wanted) {
		if (link->due_ns > now_ns)
			return link->due_ns;
		if (link->period_ns > 0)
			link->due_ns = now_ns - link->due_ns < link->period_ns ? link->due_ns + link->period_ns
			                                                       : now_ns + link->period_ns;
		link_ask(link);
	}
	return UINT64_MAX;
}

static int wait_for(struct pollfd *polls, unsigned n, uint64_t until_ns)
{
	const uint64_t now_ns = clock_ns(), left_ns = until_ns > now_ns ? until_ns - now_ns : 0;

	return ppoll(polls, n, &(struct timespec){ (time_t)(left_ns / 1000000000u), (long)(left_ns % 1000000000u) }, NULL);
}

static int want_anything(const struct link *links, unsigned n)
{
	for (unsigned i = 0; i < n; i++)
		if (!links[i].is_lost && (links[i].n_open > 0 || links[i].n_wanted > 0))
			return 1;
	return 0;
}

void links_run(struct link *links, unsigned n, double seconds)
{
	const uint64_t end_ns = clock_ns() + (uint64_t)(seconds * 1e9);
	struct pollfd polls[MOST_LINKS];
	uint64_t now_ns;

	if (n > MOST_LINKS)
		report_die("links", "are too many");
	while ((now_ns = clock_ns()) < end_ns && want_anything(links, n)) {
		uint64_t due_ns = end_ns;

		for (unsigned i = 0; i < n; i++) {
			const uint64_t link_due_ns = ask_due(&links[i], now_ns);

			polls[i] = (struct pollfd){ links[i].is_lost ? -1 : links[i].fd, POLLIN, 0 };
			due_ns = link_due_ns < due_ns ? link_due_ns : due_ns;
		}
		if (wait_for(polls, n, due_ns) > 0)
			for (unsigned i = 0; i < n; i++)
				if (polls[i].revents != 0)
					take(&links[i]);
	}
}

void links_finish(struct link *links, unsigned n, double most_seconds)
{
	for (unsigned i = 0; i < n; i++)
		links[i].n_wanted = 0;
	links_run(links, n, most_seconds);
}

void links_forget(struct link *links, unsigned n)
{
	for (unsigned i = 0; i < n; i++) {
		links[i].n_done = links[i].n_failed = 0;
		links[i].n_latencies = 0;
		links[i].cores_s = 0;
	}
}

/* ---- one ---- */

void link_wait(struct link *link, const char *what)
{
	const uint64_t end_ns = clock_ns() + ANSWER_SECONDS * UINT64_C(1000000000);
	const unsigned n_before = link->n_replies;
	struct pollfd polled = { link->fd, POLLIN, 0 };

	while (link->n_replies == n_before && !link->is_lost) {
		if (wait_for(&polled, 1, end_ns) <= 0)
			report_die(what, "is not answered");
		take(link);
	}
}

uint64_t link_stat(struct link *link, unsigned id)
{
	uint8_t data[64];
	struct psr_buf buf = { data, 0, sizeof data };
	struct psr_error err;

	daemon_must(psr_msg_stats_encode(&buf, link->next_id++, &err), "STATS", &err);
	link_send(link, data, buf.size);
	link_wait(link, "STATS");
	for (unsigned i = 0; i < link->stats.n_stats; i++)
		if (link->stats.stat[i].id == id)
			return link->stats.stat[i].value;
	return 0;
}

double link_percentile(struct link *link, double part)
{
	stats_sort(link->latency_ms, link->n_latencies);
	return stats_percentile(link->latency_ms, link->n_latencies, part);
}
