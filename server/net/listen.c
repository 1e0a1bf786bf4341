#define _GNU_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "listen.h"

#define BACKLOG 1024 /* connections that may arrive within one turn of the loop */
#define NOT_SENT_BYTES 262144

/* Sets options that accepted sockets inherit. Messages go out at once; psrd finds out about a dead peer two minutes
 * after its last word; little waits in the kernel, where control messages cannot overtake it. */
static void set_tcp_options(int fd)
{
	static const struct {
		int level, name, value;
	} options[] = {
		{ IPPROTO_TCP, TCP_NODELAY, 1 }, { SOL_SOCKET, SO_KEEPALIVE, 1 }, { IPPROTO_TCP, TCP_KEEPIDLE, 60 },
		{ IPPROTO_TCP, TCP_KEEPINTVL, 15 }, { IPPROTO_TCP, TCP_KEEPCNT, 4 },
		{ IPPROTO_TCP, TCP_NOTSENT_LOWAT, NOT_SENT_BYTES },
	};

	for (size_t i = 0; i < sizeof options / sizeof options[0]; i++)
		setsockopt(fd, options[i].level, options[i].name, &options[i].value, sizeof options[i].value);
}

static int is_loopback(const struct sockaddr *address)
{
	if (address->sa_family == AF_INET)
		return ntohl(((const struct sockaddr_in *)(const void *)address)->sin_addr.s_addr) >> 24 == 127;
	if (address->sa_family == AF_INET6) {
		const struct in6_addr *a = &((const struct sockaddr_in6 *)(const void *)address)->sin6_addr;

		return IN6_IS_ADDR_LOOPBACK(a) || (IN6_IS_ADDR_V4MAPPED(a) && a->s6_addr[12] == 127);
	}
	return 0;
}

static int fail_system(struct psr_error *err, const char *address, const char *what)
{
	int code = errno == EADDRINUSE ? PSR_ERR_BUSY : PSR_ERR_IO;

	return psr_fail(err, code, "--listen %.200s: %s: %s", address, what, strerror(errno));
}

/* Splits ADDR:PORT at the last colon and removes brackets. */
static int split(char host[LISTEN_NAME], char port[16], const char *text, const char *address, struct psr_error *err)
{
	const char *colon = strrchr(text, ':');
	size_t n = colon != NULL ? (size_t)(colon - text) : 0;

	if (n > 0 && text[0] == '[' && text[n - 1] == ']') {
		text++;
		n -= 2;
	} else if (n > 0 && memchr(text, ':', n) != NULL) {
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: an IPv6 address stands in brackets, as [::1]:7447",
		                address);
	}
	if (n == 0 || n >= LISTEN_NAME || colon[1] == '\0' || strlen(colon + 1) > 5
	    || strspn(colon + 1, "0123456789") != strlen(colon + 1) || atoi(colon + 1) > 65535)
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: it takes ADDR:PORT with a port of 0 to 65535, as "
		                "127.0.0.1:7447, or unix:PATH", address);
	memcpy(host, text, n);
	host[n] = '\0';
	snprintf(port, 16, "%s", colon + 1);
	return PSR_OK;
}

static int open_one(struct listener *l, const struct addrinfo *info, const char *address, struct psr_error *err)
{
	struct sockaddr_storage bound;
	socklen_t n = sizeof bound;
	char host[INET6_ADDRSTRLEN], port[16];
	const int on = 1;
	int code;

	memset(l, 0, sizeof *l);
	l->fd = socket(info->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (l->fd < 0)
		return fail_system(err, address, "no socket");
	setsockopt(l->fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
	if (info->ai_family == AF_INET6)
		setsockopt(l->fd, IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof on);
	set_tcp_options(l->fd);
	if (bind(l->fd, info->ai_addr, info->ai_addrlen) != 0 || listen(l->fd, BACKLOG) != 0
	    || getsockname(l->fd, (struct sockaddr *)&bound, &n) != 0
	    || getnameinfo((struct sockaddr *)&bound, n, host, sizeof host, port, sizeof port,
	                   NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
		code = fail_system(err, address, "cannot serve there");
		close(l->fd);
		return code;
	}
	snprintf(l->name, sizeof l->name, info->ai_family == AF_INET6 ? "[%s]:%s" : "%s:%s", host, port);
	return PSR_OK;
}

static int open_tcp(struct listener *listeners, int max, int *n, const char *text, const char *address,
                    struct psr_error *err)
{
	const struct addrinfo hints = { .ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICSERV };
	char host[LISTEN_NAME], port[16];
	struct addrinfo *list;
	int code = split(host, port, text, address, err), failed;

	if (code != PSR_OK)
		return code;
	failed = getaddrinfo(host, port, &hints, &list);
	if (failed != 0)
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: %s", address, gai_strerror(failed));
	for (struct addrinfo *info = list; info != NULL; info = info->ai_next) {
		if (!is_loopback(info->ai_addr)) {
			freeaddrinfo(list);
			return psr_fail(err, PSR_ERR_ARG,
			                "--listen %.200s: not a loopback address, and this psrd has neither encryption "
			                "nor tokens; listen on 127.0.0.1 and let clients come through "
			                "`ssh -L 7447:127.0.0.1:7447 HOST`, or on unix:PATH",
			                address);
		}
	}
	*n = 0;
	code = PSR_ERR_IO;
	for (struct addrinfo *info = list; info != NULL && *n < max; info = info->ai_next) {
		code = open_one(&listeners[*n], info, address, err);
		if (code == PSR_OK)
			++*n;
		else if (code == PSR_ERR_BUSY)
			break;
	}
	freeaddrinfo(list);
	if (*n > 0 && code != PSR_ERR_BUSY)
		return PSR_OK; /* one address of a host name is enough: a machine may lack ::1 */
	while (*n > 0)
		listen_close(&listeners[--*n]);
	return code;
}

/* A killed daemon leaves its socket file behind, but nobody answers there. */
static int remove_stale(const struct sockaddr_un *name, const char *address, struct psr_error *err)
{
	struct stat status;
	int fd, answered, reason;

	if (lstat(name->sun_path, &status) != 0)
		return errno == ENOENT ? PSR_OK : fail_system(err, address, "cannot look there");
	if (!S_ISSOCK(status.st_mode))
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: exists and is not a socket", address);
	fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return fail_system(err, address, "no socket");
	answered = connect(fd, (const struct sockaddr *)name, sizeof *name) == 0;
	reason = errno;
	close(fd);
	if (answered || reason != ECONNREFUSED)
		return psr_fail(err, PSR_ERR_BUSY, "--listen %.200s: a daemon already serves there", address);
	if (unlink(name->sun_path) != 0 && errno != ENOENT)
		return fail_system(err, address, "the stale socket cannot be removed");
	return PSR_OK;
}

static int open_unix(struct listener *l, const char *path, const char *address, struct psr_error *err)
{
	struct sockaddr_un name = { .sun_family = AF_UNIX };
	struct stat status;
	mode_t mask;
	int code;

	if (path[0] == '\0' || strlen(path) >= sizeof name.sun_path)
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: the path takes 1 to %zu bytes", address,
		                sizeof name.sun_path - 1);
	strcpy(name.sun_path, path);
	code = remove_stale(&name, address, err);
	if (code != PSR_OK)
		return code;
	memset(l, 0, sizeof *l);
	l->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (l->fd < 0)
		return fail_system(err, address, "no socket");
	mask = umask(0177);
	code = bind(l->fd, (struct sockaddr *)&name, sizeof name);
	umask(mask);
	if (code != 0 || listen(l->fd, BACKLOG) != 0 || stat(path, &status) != 0) {
		int failure = fail_system(err, address, "cannot serve there");

		if (code == 0)
			unlink(path);
		close(l->fd);
		return failure;
	}
	l->device = status.st_dev;
	l->inode = status.st_ino;
	snprintf(l->path, sizeof l->path, "%s", path);
	snprintf(l->name, sizeof l->name, "unix:%.200s", path);
	return PSR_OK;
}

int listen_open(struct listener *listeners, int max, int *n, const char *address, struct psr_error *err)
{
	*n = 0;
	if (max < 1)
		return psr_fail(err, PSR_ERR_LIMIT, "--listen %.200s: too many listeners", address);
	if (strncmp(address, "tls://", 6) == 0)
		return psr_fail(err, PSR_ERR_ARG, "--listen %.200s: this psrd has no TLS; listen on 127.0.0.1 and let clients "
		                "come through `ssh -L 7447:127.0.0.1:7447 HOST`", address);
	if (strncmp(address, "unix:", 5) == 0) {
		int code = open_unix(listeners, address + 5, address, err);

		*n = code == PSR_OK;
		return code;
	}
	return open_tcp(listeners, max, n, strncmp(address, "tcp://", 6) == 0 ? address + 6 : address, address, err);
}

void listen_close(struct listener *listener)
{
	struct stat status;

	if (listener->fd < 0)
		return;
	close(listener->fd);
	listener->fd = -1;
	if (listener->path[0] != '\0' && lstat(listener->path, &status) == 0 && status.st_dev == listener->device
	    && status.st_ino == listener->inode)
		unlink(listener->path);
}
