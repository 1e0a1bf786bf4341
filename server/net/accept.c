#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include "accept.h"
#include "server/log.h"

#define ACCEPT_TURN 16
#define WARN_US 10000000 /* between two warnings that psrd cannot accept connections */
#define OTHER_DESCRIPTORS 64 /* beside connections: listeners, pipes, files, the loop's own */

static void set_resting(struct acceptor *acceptor, int is_resting)
{
	acceptor->is_resting = is_resting;
	for (int i = 0; i < acceptor->n; i++)
		loop_set(acceptor->conns->loop, &acceptor->listener[i].source, is_resting ? 0 : EPOLLIN);
}

void accept_wake(struct acceptor *acceptor)
{
	if (acceptor->is_resting)
		set_resting(acceptor, 0);
}

static void rest(struct acceptor *acceptor, int reason)
{
	uint64_t now_us = acceptor->conns->loop->now_us;

	if (acceptor->warned_us == 0 || now_us - acceptor->warned_us >= WARN_US) {
		log_warn("cannot accept connections for now: %s", strerror(reason));
		acceptor->warned_us = now_us;
	}
	set_resting(acceptor, 1);
}

/* Without descriptors or memory, connections that are not clients make room. If there are none, the listeners rest
 * until the next tick: epoll would report them without end. */
static void on_connection(uint32_t events, void *userdata)
{
	struct accept_source *l = userdata;
	struct conns *conns = l->acceptor->conns;

	(void)events;
	for (int i = 0; i < ACCEPT_TURN; i++) {
		struct sockaddr_storage peer = { 0 };
		socklen_t n = sizeof peer;
		int fd = accept4(l->listener.fd, (struct sockaddr *)&peer, &n, SOCK_NONBLOCK | SOCK_CLOEXEC);

		if (fd >= 0) {
			conn_accept(conns, fd, &peer);
		} else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
			int reason = errno;

			if (conns_drop_pending(conns))
				continue;
			rest(l->acceptor, reason);
			return;
		} else if (errno == EAGAIN || errno == EWOULDBLOCK) {
			return;
		}
	}
}

void accept_close(struct acceptor *acceptor)
{
	while (acceptor->n > 0) {
		struct accept_source *l = &acceptor->listener[--acceptor->n];

		loop_remove(acceptor->conns->loop, &l->source);
		listen_close(&l->listener);
	}
}

int accept_open(struct acceptor *acceptor, struct conns *conns, const char *const *address, int n,
                struct psr_error *err)
{
	acceptor->conns = conns;
	for (int i = 0; i < n; i++) {
		struct listener opened[4];
		int n_opened, max = ACCEPT_MAX - acceptor->n;
		int code = listen_open(opened, max < 4 ? max : 4, &n_opened, address[i], err);

		if (code != PSR_OK)
			return code;
		for (int k = 0; k < n_opened; k++) {
			struct accept_source *l = &acceptor->listener[acceptor->n++];

			l->listener = opened[k];
			l->acceptor = acceptor;
			l->source = (struct loop_source){ .fd = l->listener.fd, .on_ready = on_connection, .userdata = l,
			                                  .is_last = 1 };
			if (code == PSR_OK)
				code = loop_add(conns->loop, &l->source, EPOLLIN, err);
		}
		if (code != PSR_OK)
			return code;
	}
	return PSR_OK;
}

/* Connections that are not clients get at most a fourth of all descriptors. */
void accept_raise_descriptors(int64_t *max_clients, int64_t *max_pending)
{
	struct rlimit limit;
	rlim_t wanted = (rlim_t)*max_clients + (rlim_t)*max_pending + OTHER_DESCRIPTORS;
	int64_t all, rest;

	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted)
		return;
	limit.rlim_cur = wanted < limit.rlim_max ? wanted : limit.rlim_max;
	setrlimit(RLIMIT_NOFILE, &limit);
	if (limit.rlim_cur >= wanted)
		return;
	all = limit.rlim_cur > OTHER_DESCRIPTORS + 2 ? (int64_t)limit.rlim_cur - OTHER_DESCRIPTORS : 2;
	rest = all / 4 > all - *max_clients ? all / 4 : all - *max_clients;
	rest = rest > 1 ? rest : 1;
	*max_pending = *max_pending < rest ? *max_pending : rest;
	if (*max_clients <= all - *max_pending)
		return;
	*max_clients = all - *max_pending;
	log_warn("the system allows %" PRIu64 " open files (ulimit -n): --max-clients is now %" PRId64,
	         (uint64_t)limit.rlim_cur, *max_clients);
}
