#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include "accept.h"
#include "server/log.h"

#define ACCEPT_TURN 64
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

/* Without descriptors or memory the listeners rest until the next tick: epoll would report them without end. */
static void on_connection(uint32_t events, void *userdata)
{
	struct accept_source *l = userdata;
	struct conns *conns = l->acceptor->conns;

	(void)events;
	for (int i = 0; i < ACCEPT_TURN; i++) {
		int fd = accept4(l->listener.fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

		if (fd >= 0) {
			if (conns->n >= conns->limits.max_clients + CONN_SPARE)
				close(fd);
			else
				conn_accept(conns, fd);
		} else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
			log_warn("cannot accept connections for now: %s", strerror(errno));
			set_resting(l->acceptor, 1);
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
			l->source = (struct loop_source){ .fd = l->listener.fd, .on_ready = on_connection, .userdata = l };
			if (code == PSR_OK)
				code = loop_add(conns->loop, &l->source, EPOLLIN, err);
		}
		if (code != PSR_OK)
			return code;
	}
	return PSR_OK;
}

int64_t accept_raise_descriptors(int64_t max_clients)
{
	const rlim_t others = CONN_SPARE + OTHER_DESCRIPTORS;
	struct rlimit limit;
	rlim_t wanted = (rlim_t)max_clients + others;
	int64_t allowed;

	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted)
		return max_clients;
	limit.rlim_cur = wanted < limit.rlim_max ? wanted : limit.rlim_max;
	setrlimit(RLIMIT_NOFILE, &limit);
	if (limit.rlim_cur >= wanted)
		return max_clients;
	allowed = limit.rlim_cur > others ? (int64_t)(limit.rlim_cur - others) : 1;
	log_warn("the system allows %" PRIu64 " open files (ulimit -n): --max-clients is now %" PRId64,
	         (uint64_t)limit.rlim_cur, allowed);
	return allowed;
}
