#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/clock.h"
#include "client/cli/cli.h"
#include "home.h"
#include "psr/client.h"

#define READY_MS 10000
#define MOST_RESOLUTION "1536"
#define TEXT(number) TEXT_OF(number)
#define TEXT_OF(number) #number

extern char **environ;

struct home {
	char folder[64];         /* temporary; "": none */
	char address[80];
	char model[PSR_WIRE_MAX_NAME + 1];
	pid_t keeper;            /* 0: none */
	int held_fd;             /* the keeper ends psrd when this pipe closes */
};

/* Outlives the viewer by as long as it takes to end psrd and to remove the folder ($1). Standard input is a pipe that
 * the viewer holds open. */
static const char keeper[] =
	"folder=$1; shift; trap '' INT HUP TERM PIPE; \"$@\" </dev/null & psrd=$!; cat >/dev/null; "
	"kill -TERM $psrd 2>/dev/null; wait $psrd; rm -rf \"$folder\"";

/* Files that name no others can stand alone in a folder of links; the others need theirs. */
static int is_alone(const char *name)
{
	static const char *const endings[] = { ".psr", ".ply", ".glb", ".las", ".off", ".stl", ".3mf", ".amf" };
	const char *dot = strrchr(name, '.');

	for (size_t i = 0; dot != NULL && i < sizeof endings / sizeof endings[0]; i++)
		if (strcasecmp(dot, endings[i]) == 0)
			return 1;
	return 0;
}

static int make_folder(struct home *home, struct psr_error *err)
{
	const char *base = getenv("TMPDIR");

	/* A socket's path has at most 107 bytes. */
	if (base == NULL || base[0] != '/' || strlen(base) > 40)
		base = "/tmp";
	snprintf(home->folder, sizeof home->folder, "%s/psr-view-XXXXXX", base);
	if (mkdtemp(home->folder) == NULL) {
		home->folder[0] = '\0';
		return psr_fail(err, PSR_ERR_IO, "no temporary folder in %s: %s", base, strerror(errno));
	}
	snprintf(home->address, sizeof home->address, "unix:%s/socket", home->folder);
	return PSR_OK;
}

/* The folder that psrd is to serve: of the file alone, or the file's own. file: its whole path. */
static int choose_models(char models[PATH_MAX], struct home *home, const char *file, struct psr_error *err)
{
	const char *name = strrchr(file, '/') + 1;
	const char *dot = strrchr(name, '.');
	const size_t n_stem = dot != NULL && dot != name ? (size_t)(dot - name) : strlen(name);
	char at[PATH_MAX];

	if (n_stem > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "%s: its name has more than %d bytes", file, PSR_WIRE_MAX_NAME);
	memcpy(home->model, name, n_stem);
	if (!is_alone(name)) {
		snprintf(models, PATH_MAX, "%.*s", name - 1 == file ? 1 : (int)(name - 1 - file), file);
		snprintf(at, sizeof at, "%.3000s/%s.psr", models, home->model);
		if (access(at, F_OK) == 0) /* psrd would serve it, and not tell of the other one */
			return psr_fail(err, PSR_ERR_ARG, "%s has the same name; view it, or move one of the two", at);
		return PSR_OK;
	}
	snprintf(models, PATH_MAX, "%s/models", home->folder);
	if (mkdir(models, 0700) != 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", models, strerror(errno));
	snprintf(at, sizeof at, "%s/models/%s", home->folder, name);
	if (symlink(file, at) != 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", at, strerror(errno));
	return PSR_OK;
}

/* in, out, log: its standard input, output and error. In a session of its own, so that Ctrl-C is the viewer's alone. */
static int spawn(struct home *home, const char *models, int in, int out, int log, struct psr_error *err)
{
	char psrd[PATH_MAX];
	const char *argv[] = { "sh", "-c", keeper, "psr-view", home->folder, psrd, "--models", models,
		                   "--listen", home->address, "--resolution", TEXT(HOME_COARSE_PIXELS),
		                   "--max-resolution", MOST_RESOLUTION, NULL };
	posix_spawn_file_actions_t files;
	posix_spawnattr_t attributes;
	sigset_t none;
	int code;

	psr_find_program(psrd, "psrd");
	sigemptyset(&none);
	posix_spawn_file_actions_init(&files);
	posix_spawnattr_init(&attributes);
	posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
	posix_spawnattr_setsigmask(&attributes, &none);
	posix_spawn_file_actions_adddup2(&files, in, 0);
	posix_spawn_file_actions_adddup2(&files, out, 1);
	posix_spawn_file_actions_adddup2(&files, log, 2);
	code = posix_spawn(&home->keeper, "/bin/sh", &files, &attributes, (char *const *)argv, environ);
	posix_spawn_file_actions_destroy(&files);
	posix_spawnattr_destroy(&attributes);
	if (code == 0)
		return PSR_OK;
	home->keeper = 0;
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
static int wait_ready(struct home *home, int out, int log, struct psr_error *err)
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
			close(home->held_fd);
			home->held_fd = -1;
		}
	}
	return psr_fail(err, PSR_ERR_IO, "psrd does not start within %d s", READY_MS / 1000);
}

static int start(struct home *home, const char *models, struct psr_error *err)
{
	int in[2] = { -1, -1 }, out[2] = { -1, -1 }, log, code;

	log = memfd_create("psrd.log", MFD_CLOEXEC);
	if (log < 0 || pipe2(in, O_CLOEXEC) != 0 || pipe2(out, O_CLOEXEC) != 0)
		code = psr_fail(err, PSR_ERR_IO, "the system gives no more descriptors: %s", strerror(errno));
	else
		code = spawn(home, models, in[0], out[1], log, err);
	home->held_fd = in[1];
	if (in[0] >= 0)
		close(in[0]);
	if (out[1] >= 0)
		close(out[1]);
	if (code == PSR_OK)
		code = wait_ready(home, out[0], log, err);
	if (out[0] >= 0)
		close(out[0]);
	if (log >= 0)
		close(log);
	return code;
}

/* Whether psrd's list has the file, and not another one of its name. */
static int check_list(struct home *home, const char *file, struct psr_error *err)
{
	const char *name = strrchr(file, '/') + 1;
	struct psr_msg_list_entry *entry = NULL;
	struct psr_client *client;
	uint32_t n = 0;
	int code = psr_client_connect(&client, home->address, "psr-view " PSR_VERSION, NULL, READY_MS, err), has_it = 0;

	if (code != PSR_OK)
		return code;
	code = psr_client_list(client, &entry, &n, READY_MS, err);
	for (uint32_t i = 0; code == PSR_OK && i < n; i++) {
		has_it |= strcmp(entry[i].name, home->model) == 0;
		if (strcmp(entry[i].name, name) == 0 && strcmp(name, home->model) != 0) {
			/* The entry is a format that nobody reads, or the second file of the name: OPEN says which. */
			struct psr_msg_opened opened;

			code = psr_client_open(client, name, READY_MS, &opened, err);
		}
	}
	if (code == PSR_OK && !has_it)
		code = psr_fail(err, PSR_ERR_FORMAT, "%s: psr reads no files of this kind; psr-model build --help lists those "
		                                     "that it reads", file);
	free(entry);
	psr_client_close(client);
	return code;
}

static int begin(struct home *home, const char *file, struct psr_error *err)
{
	char models[PATH_MAX];
	int code = make_folder(home, err);

	if (code == PSR_OK)
		code = choose_models(models, home, file, err);
	if (code == PSR_OK)
		code = start(home, models, err);
	return code == PSR_OK ? check_list(home, file, err) : code;
}

int home_open(struct home **out, const char *path, struct psr_error *err)
{
	char *file = realpath(path, NULL);
	struct home *home = calloc(1, sizeof *home);
	struct stat status;
	int code = PSR_OK;

	if (home == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a private psrd");
	else
		home->held_fd = -1;
	if (code == PSR_OK && (file == NULL || stat(file, &status) != 0))
		code = psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	else if (code == PSR_OK && !S_ISREG(status.st_mode))
		code = psr_fail(err, PSR_ERR_ARG, "%s is no file; psrd --models serves a folder", path);
	if (code == PSR_OK)
		code = begin(home, file, err);
	free(file);
	if (code == PSR_OK)
		*out = home;
	else
		home_close(home);
	return code;
}

void home_close(struct home *home)
{
	int status;

	if (home == NULL)
		return;
	if (home->held_fd >= 0)
		close(home->held_fd);
	if (home->keeper > 0) {
		while (waitpid(home->keeper, &status, 0) < 0 && errno == EINTR)
			;
	} else if (home->folder[0] != '\0') {
		char models[PATH_MAX];

		snprintf(models, sizeof models, "%s/models", home->folder); /* empty, or it would have a keeper */
		rmdir(models);
		rmdir(home->folder);
	}
	free(home);
}

const char *home_address(const struct home *home)
{
	return home->address;
}

const char *home_model(const struct home *home)
{
	return home->model;
}
