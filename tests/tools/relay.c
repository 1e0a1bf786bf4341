/* relay --to ADDR: a bad network between a client and psrd, on one machine. Prints READY ADDR as psrd does, and what it
 * saw when SIGTERM or SIGINT ends it. `relay --help` lists the faults. */
#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "base/cli.h"
#include "base/clock.h"
#include "base/random.h"
#include "client/lib/internal.h"
#include "stamps.h"

#define CHUNK 16384
#define CONNECT_MS 2000
#define MS UINT64_C(1000000)
#define NEVER UINT64_MAX

enum way { UP, DOWN };   /* from the client; to the client */
enum fault { RESET, CLOSE, CUT };

static struct options {
	const char *listen, *to, *stamps;
	double delay_ms, jitter_ms, rate[2], stall_ms, every_ms; /* rate: Mbit/s; 0: as fast as it goes */
	int64_t split, queue, fault[3][2], n_faulty, seed; /* fault: after so many bytes; -1: never */
} options = { .listen = "127.0.0.1:0", .every_ms = 1000, .queue = 1 << 20,
	          .fault = { { -1, -1 }, { -1, -1 }, { -1, -1 } }, .n_faulty = INT64_MAX, .seed = 1 };

static struct { uint64_t connections, bytes[2], faults[3]; } counts;

struct chunk {
	struct chunk *next;
	uint64_t due_ns;
	size_t sent, size;
	uint8_t data[CHUNK];
};

struct flow {            /* one way of a connection: what comes from fd goes to the other flow's */
	struct link *link;
	int fd, events, has_eof, is_shut, is_cut, is_blocked;
	struct chunk *first, *last;
	uint64_t queued, passed, due_ns, free_ns; /* free_ns: the link is, for the next bytes */
};

struct link {            /* a connection */
	struct link *next;
	struct flow flow[2];
	int is_faulty, is_dead;
	uint64_t random;
	struct stamps stamps;
};

static int epoll_fd;
static struct link *links;
static uint64_t now_ns, start_ns;
static FILE *stamps_file;

static void die(const char *what)
{
	fprintf(stderr, "relay: %s: %s\n", what, strerror(errno));
	exit(3);
}

static struct flow *other(struct flow *flow)
{
	return flow == &flow->link->flow[UP] ? &flow->link->flow[DOWN] : &flow->link->flow[UP];
}

static enum way way_of(const struct flow *flow)
{
	return flow == &flow->link->flow[UP] ? UP : DOWN;
}

/* ---- the ends of a connection ---- */

static void bury(struct link *link, int with_reset)
{
	const struct linger linger = { .l_onoff = 1, .l_linger = 0 };

	for (int way = 0; way < 2; way++) {
		struct flow *flow = &link->flow[way];

		if (with_reset)
			setsockopt(flow->fd, SOL_SOCKET, SO_LINGER, &linger, sizeof linger);
		close(flow->fd);
		while (flow->first != NULL) {
			struct chunk *next = flow->first->next;

			free(flow->first);
			flow->first = next;
		}
	}
	link->is_dead = 1;
}

/* Bytes that may pass before the next fault of this way; one that is due happens, and none may pass. */
static uint64_t until_fault(struct flow *flow)
{
	uint64_t left = NEVER;

	for (int kind = RESET; kind <= CUT && flow->link->is_faulty; kind++) {
		const int64_t at = options.fault[kind][way_of(flow)];

		if (at >= 0 && flow->passed < (uint64_t)at) {
			left = (uint64_t)at - flow->passed < left ? (uint64_t)at - flow->passed : left;
		} else if (at >= 0) {
			counts.faults[kind]++;
			flow->is_cut = kind == CUT;
			if (kind != CUT)
				bury(flow->link, kind == RESET);
			return 0;
		}
	}
	return left;
}

/* ---- bytes ---- */

static void want(struct flow *flow)
{
	const int can_read = !flow->has_eof && !flow->is_cut && flow->queued < (uint64_t)options.queue;
	const int events = (can_read ? EPOLLIN : 0) | (other(flow)->is_blocked ? EPOLLOUT : 0);
	struct epoll_event event = { .events = (uint32_t)events, .data.ptr = flow };

	/* Errors and ends are reported whatever is asked for: a descriptor of which nothing is wanted is not watched. */
	if (events == flow->events)
		return;
	if (epoll_ctl(epoll_fd, flow->events == 0 ? EPOLL_CTL_ADD : events == 0 ? EPOLL_CTL_DEL : EPOLL_CTL_MOD, flow->fd,
	              &event) != 0)
		die("epoll_ctl");
	flow->events = events;
}

static void take(struct flow *flow)
{
	struct chunk *chunk = malloc(sizeof *chunk);
	const double delay_ms = options.delay_ms + random_in(&flow->link->random, 0, options.jitter_ms + 1e-9);
	const uint64_t due_ns = now_ns + (uint64_t)(delay_ms * 1e6);
	ssize_t n;

	if (chunk == NULL)
		die("memory");
	n = read(flow->fd, chunk->data, CHUNK);
	if (n <= 0) {
		const int is_over = n == 0 || (errno != EAGAIN && errno != EINTR);

		free(chunk);
		if (n < 0 && is_over) { /* one side was reset: so is the other */
			bury(flow->link, 1);
			return;
		}
		flow->has_eof |= is_over;
		return;
	}
	if (stamps_file != NULL && way_of(flow) == UP)
		stamps_take(&flow->link->stamps, UP, chunk->data, (size_t)n, clock_ns(), stamps_file);
	flow->due_ns = due_ns > flow->due_ns ? due_ns : flow->due_ns; /* in order */
	chunk->next = NULL;
	chunk->due_ns = flow->due_ns;
	chunk->sent = 0;
	chunk->size = (size_t)n;
	*(flow->first != NULL ? &flow->last->next : &flow->first) = chunk;
	flow->last = chunk;
	flow->queued += (uint64_t)n;
}

/* The first part of each period is the stall. Its end, in this period; 0: there are none. */
static uint64_t stalled_until(void)
{
	const uint64_t every = (uint64_t)(options.every_ms * 1e6);

	return options.stall_ms > 0 ? now_ns - (now_ns - start_ns) % every + (uint64_t)(options.stall_ms * 1e6) : 0;
}

/* When the first bytes could pass: waking up late costs the link nothing. */
static uint64_t begun_ns(const struct flow *flow)
{
	const uint64_t due_ns = flow->first->due_ns, stall_ns = stalled_until();
	const uint64_t at = due_ns > flow->free_ns ? due_ns : flow->free_ns;

	return at > stall_ns ? at : stall_ns;
}

/* When this flow can pass bytes next; NEVER: not before an event. */
static uint64_t ready_at(const struct flow *flow)
{
	return flow->first == NULL || flow->is_cut || flow->is_blocked ? NEVER : begun_ns(flow);
}

/* One write. */
static void pass(struct flow *flow)
{
	const double rate = options.rate[way_of(flow)] * 1e6 / 8;
	const uint64_t limit = until_fault(flow);
	struct chunk *chunk = flow->first;
	size_t n;
	ssize_t sent;

	if (limit == 0)
		return;
	n = chunk->size - chunk->sent;
	n = n < limit ? n : (size_t)limit;
	if (rate > 0 && (double)n > rate * 1e-3)
		n = rate * 1e-3 >= 1 ? (size_t)(rate * 1e-3) : 1;
	if (options.split > 0) {
		const size_t most = 1 + random_below(&flow->link->random, (uint32_t)options.split);

		n = n < most ? n : most;
	}
	sent = send(other(flow)->fd, chunk->data + chunk->sent, n, MSG_NOSIGNAL);
	if (sent < 0 && errno != EAGAIN && errno != EINTR && other(flow)->is_cut)
		sent = (ssize_t)n; /* nobody is there, and nobody says so */
	if (sent < 0 && errno != EAGAIN && errno != EINTR) {
		bury(flow->link, 1);
		return;
	}
	flow->is_blocked = sent < 0;
	if (sent < 0)
		return;
	if (stamps_file != NULL && way_of(flow) == DOWN)
		stamps_take(&flow->link->stamps, DOWN, chunk->data + chunk->sent, (size_t)sent, clock_ns(), stamps_file);
	counts.bytes[way_of(flow)] += (uint64_t)sent;
	flow->passed += (uint64_t)sent;
	flow->queued -= (uint64_t)sent;
	if (rate > 0)
		flow->free_ns = begun_ns(flow) + (uint64_t)((double)sent / rate * 1e9);
	chunk->sent += (size_t)sent;
	if (chunk->sent == chunk->size) {
		flow->first = chunk->next;
		free(chunk);
	}
	until_fault(flow);
}

static void pump(struct link *link)
{
	for (int way = 0; way < 2 && !link->is_dead; way++) {
		struct flow *flow = &link->flow[way];

		if (ready_at(flow) <= now_ns)
			pass(flow);
		if (!link->is_dead && flow->has_eof && flow->first == NULL && !flow->is_cut && !flow->is_shut) {
			shutdown(other(flow)->fd, SHUT_WR);
			flow->is_shut = 1;
		}
	}
	if (!link->is_dead && link->flow[UP].is_shut && link->flow[DOWN].is_shut)
		bury(link, 0);
	for (int way = 0; way < 2 && !link->is_dead; way++)
		want(&link->flow[way]);
}

static void on_event(struct flow *flow, uint32_t events)
{
	if (flow->link->is_dead)
		return;
	if (events & EPOLLOUT && other(flow)->is_blocked) {
		other(flow)->is_blocked = 0;
		other(flow)->free_ns = now_ns;
	}
	if (events & (EPOLLIN | EPOLLHUP | EPOLLERR) && (flow->events & EPOLLIN))
		take(flow);
	else if (events & (EPOLLHUP | EPOLLERR) && !flow->is_cut) /* it takes nothing any more */
		bury(flow->link, 1);
}

/* ---- connections ---- */

static void admit(int listener)
{
	struct link *link = calloc(1, sizeof *link);
	const int one = 1;
	struct psr_error err;

	if (link == NULL)
		die("memory");
	link->flow[UP].fd = accept4(listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
	if (link->flow[UP].fd < 0) {
		free(link);
		return;
	}
	if (client_socket_connect(&link->flow[DOWN].fd, options.to, client_deadline_ns(CONNECT_MS), &err) != PSR_OK) {
		fprintf(stderr, "relay: %s\n", err.text);
		close(link->flow[UP].fd);
		free(link);
		return;
	}
	setsockopt(link->flow[UP].fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
	link->flow[UP].link = link->flow[DOWN].link = link;
	link->is_faulty = (int64_t)counts.connections < options.n_faulty;
	link->random = (uint64_t)options.seed + ++counts.connections;
	link->next = links;
	links = link;
}

/* Prints READY and the address. */
static int open_listener(struct psr_error *err)
{
	struct sockaddr_in in = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
	struct sockaddr_un un = { .sun_family = AF_UNIX };
	const int is_unix = strncmp(options.listen, "unix:", 5) == 0;
	struct sockaddr *at = is_unix ? (struct sockaddr *)&un : (struct sockaddr *)&in;
	socklen_t length = is_unix ? sizeof un : sizeof in;
	unsigned port = 0;
	int fd;

	if (is_unix ? strlen(options.listen + 5) >= sizeof un.sun_path
	            : sscanf(options.listen, "127.0.0.1:%u", &port) != 1 || port > 65535)
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: it takes 127.0.0.1:PORT or unix:PATH", options.listen);
	if (is_unix)
		strcpy(un.sun_path, options.listen + 5);
	in.sin_port = htons((uint16_t)port);
	fd = socket(at->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd < 0 || bind(fd, at, length) != 0 || listen(fd, 128) != 0 || (!is_unix && getsockname(fd, at, &length) != 0))
		return psr_fail(err, PSR_ERR_IO, "--listen %.200s: %s", options.listen, strerror(errno));
	if (is_unix)
		printf("READY %s\n", options.listen);
	else
		printf("READY 127.0.0.1:%d\n", ntohs(in.sin_port));
	fflush(stdout);
	return fd;
}

static int open_signals(void)
{
	sigset_t set;

	sigemptyset(&set);
	sigaddset(&set, SIGTERM);
	sigaddset(&set, SIGINT);
	sigprocmask(SIG_BLOCK, &set, NULL);
	return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

static void remove_dead(void)
{
	for (struct link **at = &links; *at != NULL;) {
		struct link *link = *at;

		if (link->is_dead) {
			*at = link->next;
			free(link);
		} else {
			at = &link->next;
		}
	}
}

static int wait_ms(void)
{
	uint64_t next = NEVER;

	for (const struct link *link = links; link != NULL; link = link->next)
		for (int way = 0; way < 2; way++)
			next = ready_at(&link->flow[way]) < next ? ready_at(&link->flow[way]) : next;
	return next == NEVER ? -1 : next <= now_ns ? 0 : (int)((next - now_ns + MS - 1) / MS);
}

static void run(int listener, int signals)
{
	struct epoll_event accepts = { .events = EPOLLIN }, ends = { .events = EPOLLIN, .data.ptr = &ends };

	epoll_fd = epoll_create1(EPOLL_CLOEXEC);
	if (epoll_fd < 0 || epoll_ctl(epoll_fd, EPOLL_CTL_ADD, listener, &accepts) != 0
	    || epoll_ctl(epoll_fd, EPOLL_CTL_ADD, signals, &ends) != 0)
		die("epoll");
	for (start_ns = now_ns = clock_ns();; now_ns = clock_ns()) {
		struct epoll_event event[64];
		int n;

		for (struct link *link = links; link != NULL; link = link->next)
			pump(link);
		remove_dead();
		n = epoll_wait(epoll_fd, event, 64, wait_ms());
		now_ns = clock_ns();
		for (int i = 0; i < n; i++) {
			if (event[i].data.ptr == &ends)
				return;
			if (event[i].data.ptr == NULL)
				admit(listener);
			else
				on_event(event[i].data.ptr, event[i].events);
		}
	}
}

#define FAULT(option, field, what) \
	{ .name = option, .type = PSR_OPT_INT, .value = &(field), .arg = "BYTES", .min = -1, .max = 1e15, .help = what }

int main(int argc, char **argv)
{
	const struct psr_opt opts[] = {
		{ .name = "to", .type = PSR_OPT_STRING, .value = &options.to, .arg = "ADDR", .help = "Where psrd listens." },
		{ .name = "listen", .type = PSR_OPT_STRING, .value = &options.listen, .arg = "127.0.0.1:PORT|unix:PATH",
		  .help = "Where clients connect. Port 0 takes any free one." },
		{ .name = "delay", .type = PSR_OPT_REAL, .value = &options.delay_ms, .arg = "MS", .max = 1e6,
		  .help = "Each way takes so long." },
		{ .name = "jitter", .type = PSR_OPT_REAL, .value = &options.jitter_ms, .arg = "MS", .max = 1e6,
		  .help = "And up to so much longer, at random; bytes keep their order." },
		{ .name = "rate-up", .type = PSR_OPT_REAL, .value = &options.rate[UP], .arg = "MBIT", .max = 1e6,
		  .help = "Mbit/s of a connection from the client; 0: as fast as it goes." },
		{ .name = "rate-down", .type = PSR_OPT_REAL, .value = &options.rate[DOWN], .arg = "MBIT", .max = 1e6,
		  .help = "The same to the client." },
		{ .name = "queue", .type = PSR_OPT_INT, .value = &options.queue, .arg = "BYTES", .min = 1, .max = 1e12,
		  .help = "What waits here at most, each way of a connection; then the sender has to wait." },
		{ .name = "stall", .type = PSR_OPT_REAL, .value = &options.stall_ms, .arg = "MS", .max = 1e6,
		  .help = "Nothing passes for so long at the beginning of each --every." },
		{ .name = "every", .type = PSR_OPT_REAL, .value = &options.every_ms, .arg = "MS", .min = 1, .max = 1e6,
		  .help = "From stall to stall." },
		{ .name = "split", .type = PSR_OPT_INT, .value = &options.split, .arg = "N", .max = 65536,
		  .help = "Writes have 1 to N bytes, at random; 0: as they come." },
		FAULT("reset-up", options.fault[RESET][UP], "Resets both sides after so many bytes of the client; -1: never."),
		FAULT("reset-down", options.fault[RESET][DOWN], "The same after so many of psrd's."),
		FAULT("close-up", options.fault[CLOSE][UP], "Closes both sides after so many bytes of the client; -1: never."),
		FAULT("close-down", options.fault[CLOSE][DOWN], "The same after so many of psrd's."),
		FAULT("cut-up", options.fault[CUT][UP], "After so many bytes takes nothing more from the client, not even that"
		      " it is gone, and keeps both sides open; -1: never."),
		FAULT("cut-down", options.fault[CUT][DOWN], "The same from psrd."),
		{ .name = "faulty", .type = PSR_OPT_INT, .value = &options.n_faulty, .arg = "N", .max = 9e18,
		  .help = "These six happen to the first N connections alone." },
		{ .name = "stamps", .type = PSR_OPT_STRING, .value = &options.stamps, .arg = "FILE",
		  .help = "Microseconds from each FRAME, as it comes here, to its FRAME_END, as it leaves, a line each." },
		{ .name = "seed", .type = PSR_OPT_INT, .value = &options.seed, .arg = "N", .max = 9e15,
		  .help = "Of all that is random." },
		{ 0 },
	};
	const struct psr_cli cli = { .usage = "relay --to ADDR [options]", .opts = opts,
		                         .summary = "A bad network between a client and psrd, on one machine.",
		                         .footer = "SIGTERM ends it; it then prints what it saw." };
	struct psr_error err;
	int n_operands, listener, signals, code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);

	if (code == 1)
		return 0;
	if (code == PSR_OK && (n_operands > 0 || options.to == NULL))
		code = psr_fail(&err, PSR_ERR_ARG, "it takes --to ADDR and options; see --help");
	if (code == PSR_OK)
		code = psr_address_check(options.to, &err);
	if (code != PSR_OK)
		return psr_cli_fail("relay", &err);
	if (options.stamps != NULL && (stamps_file = fopen(options.stamps, "w")) == NULL)
		code = psr_fail(&err, PSR_ERR_IO, "--stamps %.300s: %s", options.stamps, strerror(errno));
	if (code != PSR_OK)
		return psr_cli_fail("relay", &err);
	signals = open_signals();
	listener = open_listener(&err);
	if (listener < 0)
		return psr_cli_fail("relay", &err);
	run(listener, signals);
	printf("connections %" PRIu64 " up %" PRIu64 " down %" PRIu64 " resets %" PRIu64 " closes %" PRIu64 " cuts %" PRIu64
	       "\n", counts.connections, counts.bytes[UP], counts.bytes[DOWN], counts.faults[RESET], counts.faults[CLOSE],
	       counts.faults[CUT]);
	if (stamps_file != NULL)
		fclose(stamps_file);
	return 0;
}
