#define _GNU_SOURCE
#include "daemon.h"
#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/clock.h"
#include "client/cli/cli.h"

#define READY_MS 30000

extern char **environ;

struct daemon {
	char folder[64];
	char address[80];
	pid_t keeper;            /* 0: none */
	int held_fd;             /* the keeper ends psrd when this pipe closes */
};

/* Outlives the program by as long as it takes to end psrd and to remove the folder ($1). Standard input is a pipe that
 * the program holds open. */
static const char keeper[] =
	"folder=$1; shift; trap '' INT HUP TERM PIPE; \"$@\" </dev/null & psrd=$!; cat >/dev/null; "
	"kill -TERM $psrd 2>/dev/null; wait $psrd; rm -rf \"$folder\"";

int daemon_create(struct daemon **out, struct psr_error *err)
{
	const char *base = getenv("TMPDIR");
	struct daemon *daemon = calloc(1, sizeof *daemon);
	int code;

	if (daemon == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a private psrd");
	daemon->held_fd = -1;
	/* A socket's path has at most 107 bytes. */
	if (base == NULL || base[0] != '/' || strlen(base) > 40)
		base = "/tmp";
	snprintf(daemon->folder, sizeof daemon->folder, "%s/psr-XXXXXX", base);
	if (mkdtemp(daemon->folder) == NULL) {
		code = psr_fail(err, PSR_ERR_IO, "no temporary folder in %s: %s", base, strerror(errno));
		free(daemon);
		return code;
	}
	snprintf(daemon->address, sizeof daemon->address, "unix:%s/socket", daemon->folder);
	*out = daemon;
	return PSR_OK;
}

struct files { /* standard input, output and error of a process */
	int in, out, log;
};

/* In a session of its own, so that Ctrl-C is the program's alone. */
static int spawn(struct daemon *daemon, const char *models, const char *const *options, const struct files *to,
                 struct psr_error *err)
{
	char psrd[PATH_MAX];
	const char *argv[11 + DAEMON_MAX_OPTIONS] = { "sh", "-c", keeper, "psr", daemon->folder, psrd, "--models", models,
		                                          "--listen", daemon->address };
	posix_spawn_file_actions_t files;
	posix_spawnattr_t attributes;
	sigset_t none;
	int code;

	for (size_t i = 0; options[i] != NULL; i++) {
		assert(i < DAEMON_MAX_OPTIONS);
		argv[10 + i] = options[i];
	}
	psr_find_program(psrd, "psrd");
	sigemptyset(&none);
	posix_spawn_file_actions_init(&files);
	posix_spawnattr_init(&attributes);
	posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
	posix_spawnattr_setsigmask(&attributes, &none);
	posix_spawn_file_actions_adddup2(&files, to->in, 0);
	posix_spawn_file_actions_adddup2(&files, to->out, 1);
	posix_spawn_file_actions_adddup2(&files, to->log, 2);
	code = posix_spawn(&daemon->keeper, "/bin/sh", &files, &attributes, (char *const *)argv, environ);
	posix_spawn_file_actions_destroy(&files);
	posix_spawnattr_destroy(&attributes);
	if (code == 0)
		return PSR_OK;
	daemon->keeper = 0;
	return psr_fail(err, PSR_ERR_IO, "/bin/sh cannot be started: %s", strerror(code));
}

/* The log's last line says why psrd ended. */
static int fail_by_log(int log, struct psr_error *err)
{
	char text[4096], *line = text;
	const ssize_t n = pread(log, text, sizeof text - 1, 0);

	text[n > 0 ? n : 0] = '\0';
	while (strlen(line) > 0 && line[strlen(line) - 1] == '\n')
		line[strlen(line) - 1] = '\0';
	if (strrchr(line, '\n') != NULL)
		line = strrchr(line, '\n') + 1;
	return psr_fail(err, strstr(line, "not found") != NULL ? PSR_ERR_NOT_FOUND : PSR_ERR_IO,
	                "psrd does not start: %.400s", line[0] != '\0' ? line : "it says nothing");
}

/* Until READY; `out` is closed if psrd ends, but for the keeper, which is told to. */
static int wait_ready(struct daemon *daemon, int out, int log, struct psr_error *err)
{
	const uint64_t end_ns = clock_ns() + READY_MS * UINT64_C(1000000);
	struct pollfd waits = { .fd = out, .events = POLLIN };
	char text[256];

	while (clock_ns() < end_ns) {
		struct stat status;

		if (poll(&waits, 1, 50) > 0) {
			const ssize_t n = read(out, text, sizeof text);

			return n > 0 ? PSR_OK : fail_by_log(log, err);
		}
		if (fstat(log, &status) == 0 && status.st_size > 0) { /* psrd is silent unless it fails */
			close(daemon->held_fd);
			daemon->held_fd = -1;
		}
	}
	return psr_fail(err, PSR_ERR_IO, "psrd does not start within %d s", READY_MS / 1000);
}

int daemon_start(struct daemon *daemon, const char *models, const char *const *options, struct psr_error *err)
{
	int in[2] = { -1, -1 }, out[2] = { -1, -1 }, log, code;

	log = memfd_create("psrd.log", MFD_CLOEXEC);
	if (log < 0 || pipe2(in, O_CLOEXEC) != 0 || pipe2(out, O_CLOEXEC) != 0)
		code = psr_fail(err, PSR_ERR_IO, "the system gives no more descriptors: %s", strerror(errno));
	else
		code = spawn(daemon, models, options, &(struct files){ in[0], out[1], log }, err);
	daemon->held_fd = in[1];
	if (in[0] >= 0)
		close(in[0]);
	if (out[1] >= 0)
		close(out[1]);
	if (code == PSR_OK)
		code = wait_ready(daemon, out[0], log, err);
	if (out[0] >= 0)
		close(out[0]);
	if (log >= 0)
		close(log);
	return code;
}

void daemon_destroy(struct daemon *daemon)
{
	int status;

	if (daemon == NULL)
		return;
	if (daemon->held_fd >= 0)
		close(daemon->held_fd);
	if (daemon->keeper > 0) {
		while (waitpid(daemon->keeper, &status, 0) < 0 && errno == EINTR)
			;
	} else {
		rmdir(daemon->folder);
	}
	free(daemon);
}

const char *daemon_folder(const struct daemon *daemon)
{
	return daemon->folder;
}

const char *daemon_address(const struct daemon *daemon)
{
	return daemon->address;
}
