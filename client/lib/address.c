#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>
#include "base/clock.h"
#include "internal.h"

struct address {
	int is_unix;
	char host[256]; /* without brackets */
	char port[6];
	char path[108];
};

uint64_t client_deadline_ns(int timeout_ms)
{
	return timeout_ms < 0 ? UINT64_MAX : clock_ns() + (uint64_t)timeout_ms * 1000000u;
}

int client_poll(int fd, int events, uint64_t deadline_ns, struct psr_error *err)
{
	for (;;) {
		struct pollfd watch = { .fd = fd, .events = (short)events };
		uint64_t now = clock_ns(), left = deadline_ns > now ? deadline_ns - now : 0;
		int wait_ms = deadline_ns == UINT64_MAX ? -1
		              : left > 3600000000000u   ? 3600000
		                                        : (int)((left + 999999) / 1000000);
		int n = poll(&watch, 1, wait_ms);

		if (n > 0)
			return 1;
		if (n < 0 && errno != EINTR)
			return psr_fail(err, PSR_ERR_IO, "poll: %s", strerror(errno));
		if (n == 0 && clock_ns() >= deadline_ns)
			return 0;
	}
}

static int parse_port(struct address *address, const char *port, const char *text, struct psr_error *err)
{
	size_t length = strlen(port);

	if (length == 0 || length > 5 || strspn(port, "0123456789") != length || atoi(port) < 1 || atoi(port) > 65535)
		return psr_fail(err, PSR_ERR_ARG, "'%.200s': '%.20s' is not a port, which is a number of 1 to 65535", text,
		                port);
	memcpy(address->port, port, length + 1);
	return PSR_OK;
}

static int parse(struct address *address, const char *text, struct psr_error *err)
{
	const char *at = text, *host_end;

	memset(address, 0, sizeof *address);
	if (strncmp(at, "unix:", 5) == 0) {
		size_t length = strlen(at + 5);

		if (length == 0)
			return psr_fail(err, PSR_ERR_ARG, "'unix:' needs the path of a socket, such as unix:/run/psrd.sock");
		if (length >= sizeof address->path)
			return psr_fail(err, PSR_ERR_ARG, "'%.200s': the path of a Unix socket has at most %zu bytes", text,
			                sizeof address->path - 1);
		address->is_unix = 1;
		memcpy(address->path, at + 5, length + 1);
		return PSR_OK;
	}
	if (strncmp(at, "tls://", 6) == 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "'%.200s': this build does not speak TLS; reach the server through "
		                "an ssh tunnel, or by tcp:// on its own machine",
		                text);
	if (strncmp(at, "tcp://", 6) == 0)
		at += 6;
	else if (strstr(at, "://") != NULL)
		return psr_fail(err, PSR_ERR_ARG,
		                "'%.200s': unknown kind of address; there are HOST:PORT, tcp://HOST:PORT and "
		                "unix:PATH",
		                text);
	if (*at == '[') {
		host_end = strchr(++at, ']');
		if (host_end == NULL || host_end[1] != ':')
			return psr_fail(err, PSR_ERR_ARG, "'%.200s' is not an address such as [::1]:7447", text);
	} else {
		host_end = strrchr(at, ':');
		if (host_end == NULL)
			return psr_fail(err, PSR_ERR_ARG, "'%.200s' has no port; an address is HOST:PORT, such as 127.0.0.1:7447",
			                text);
		if (memchr(at, ':', (size_t)(host_end - at)) != NULL)
			return psr_fail(err, PSR_ERR_ARG, "'%.200s': an IPv6 address stands in brackets, such as [::1]:7447", text);
	}
	if (host_end == at || (size_t)(host_end - at) >= sizeof address->host)
		return psr_fail(err, PSR_ERR_ARG, "'%.200s' has no usable host name before its port", text);
	memcpy(address->host, at, (size_t)(host_end - at));
	return parse_port(address, strchr(host_end, ':') + 1, text, err);
}

int psr_address_check(const char *address, struct psr_error *err)
{
	struct address parsed;

	return parse(&parsed, address, err);
}

/* Returns the open socket, or CONNECTION with the system's reason in err. */
static int try_connect(int *out, const struct sockaddr *to, socklen_t length, const char *name, uint64_t deadline_ns,
                       struct psr_error *err)
{
	int fd = socket(to->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), reason = 0, one = 1;
	socklen_t reason_size = sizeof reason;

	if (fd < 0)
		return psr_fail(err, PSR_ERR_CONNECTION, "cannot connect to %s: %s", name, strerror(errno));
	while (connect(fd, to, length) != 0) {
		static const struct timespec pause = { .tv_nsec = 5000000 };

		reason = errno;
		/* the server's backlog is full */
		if (to->sa_family == AF_UNIX && reason == EAGAIN && clock_ns() < deadline_ns) {
			reason = 0;
			nanosleep(&pause, NULL);
			continue;
		}
		if (reason == EINPROGRESS || reason == EINTR) {
			int ready = client_poll(fd, POLLOUT, deadline_ns, err);

			if (ready == 0)
				reason = ETIMEDOUT;
			else if (ready < 0 || getsockopt(fd, SOL_SOCKET, SO_ERROR, &reason, &reason_size) != 0)
				reason = errno;
		}
		break;
	}
	if (reason != 0) {
		close(fd);
		return psr_fail(err, PSR_ERR_CONNECTION, "cannot connect to %s: %s; does psrd run there?", name,
		                strerror(reason));
	}
	if (to->sa_family != AF_UNIX)
		setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
	*out = fd;
	return PSR_OK;
}

int client_socket_connect(int *out, const char *text, uint64_t deadline_ns, struct psr_error *err)
{
	struct addrinfo hints = { .ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV }, *all;
	struct address address;
	int code = parse(&address, text, err);

	if (code != PSR_OK)
		return code;
	if (address.is_unix) {
		struct sockaddr_un to = { .sun_family = AF_UNIX };

		memcpy(to.sun_path, address.path, sizeof address.path);
		return try_connect(out, (struct sockaddr *)&to, sizeof to, text, deadline_ns, err);
	}
	code = getaddrinfo(address.host, address.port, &hints, &all);
	if (code != 0)
		return psr_fail(err, PSR_ERR_CONNECTION, "cannot find the host of %.200s: %s", text, gai_strerror(code));
	code = PSR_ERR_CONNECTION;
	for (const struct addrinfo *one = all; one != NULL && code != PSR_OK; one = one->ai_next)
		code = try_connect(out, one->ai_addr, one->ai_addrlen, text, deadline_ns, err);
	freeaddrinfo(all);
	return code;
}
