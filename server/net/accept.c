#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include "accept.h"
#include "conn.h"
#include "server/log.h"

#define ACCEPT_TURN 64
#define OTHER_DESCRIPTORS 64 /* beside connections: listeners, pipes, files, the loop's own */

void accept_pause(struct server *server, int paused)
{
	server->are_paused = paused;
	for (int i = 0; i < server->n_listeners; i++)
		loop_set(&server->loop, &server->listener[i].source, paused ? 0 : EPOLLIN);
}

/* Without descriptors or memory the listeners rest until the next tick: epoll would report them without end. */
static void on_connection(uint32_t events, void *userdata)
{
	struct server_listener *l = userdata;
	struct server *server = l->server;

	(void)events;
	for (int i = 0; i < ACCEPT_TURN; i++) {
		int fd = accept4(l->listener.fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

		if (fd >= 0) {
			if (server->n_conns >= (unsigned)server->options->max_clients + SERVER_SPARE_CLIENTS)
				close(fd);
			else
				conn_accept(server, fd);
		} else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
			log_warn("no connection can be accepted just now: %s", strerror(errno));
			accept_pause(server, 1);
			return;
		} else if (errno == EAGAIN || errno == EWOULDBLOCK) {
			return;
		}
	}
}

void accept_close(struct server *server)
{
	while (server->n_listeners > 0) {
		struct server_listener *l = &server->listener[--server->n_listeners];

		loop_remove(&server->loop, &l->source);
		listen_close(&l->listener);
	}
}

int accept_open(struct server *server, struct psr_error *err)
{
	const struct options *options = server->options;

	for (int i = 0; i < options->n_listen; i++) {
		struct listener opened[4];
		int n, max = OPTIONS_MAX_LISTEN - server->n_listeners;
		int code = listen_open(opened, max < 4 ? max : 4, &n, options->listen[i], err);

		if (code != PSR_OK)
			return code;
		for (int k = 0; k < n; k++) {
			struct server_listener *l = &server->listener[server->n_listeners++];

			l->listener = opened[k];
			l->server = server;
			l->source = (struct loop_source){ .fd = l->listener.fd, .on_ready = on_connection, .userdata = l };
			if (code == PSR_OK)
				code = loop_add(&server->loop, &l->source, EPOLLIN, err);
		}
		if (code != PSR_OK)
			return code;
	}
	return PSR_OK;
}

/* As many descriptors as the system gives; fewer clients if they are too few. */
void accept_raise_descriptors(struct options *options)
{
	struct rlimit limit;
	rlim_t wanted = (rlim_t)options->max_clients + SERVER_SPARE_CLIENTS + OTHER_DESCRIPTORS;

	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted)
		return;
	limit.rlim_cur = wanted < limit.rlim_max ? wanted : limit.rlim_max;
	setrlimit(RLIMIT_NOFILE, &limit);
	if (limit.rlim_cur >= wanted)
		return;
	options->max_clients = limit.rlim_cur > SERVER_SPARE_CLIENTS + OTHER_DESCRIPTORS
	                       ? (int64_t)(limit.rlim_cur - SERVER_SPARE_CLIENTS - OTHER_DESCRIPTORS) : 1;
	log_warn("the system allows %" PRIu64 " open files (ulimit -n): --max-clients is %" PRId64 " now",
	         (uint64_t)limit.rlim_cur, options->max_clients);
}
