#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include "client/cli/cli.h"
#include "daemon.h"
#include "home.h"
#include "psr/client.h"

#define ANSWER_MS 10000
#define MOST_RESOLUTION "1536"
#define TEXT(number) TEXT_OF(number)
#define TEXT_OF(number) #number

struct home {
	struct daemon *daemon;
	char file[PATH_MAX];
	char model[PSR_WIRE_MAX_NAME + 1];
};

/* Returns the length of a file's name without the ending of what psr fetch has not yet brought whole. */
static size_t whole_name(const char *name)
{
	static const char ending[] = ".psr.part";
	const size_t n = strlen(name), n_ending = sizeof ending - 1;

	return n > n_ending && strcmp(name + n - n_ending, ending) == 0 ? n - strlen(".part") : n;
}

/* Files that name no others can stand alone in a folder of links; the others need theirs. */
static int is_alone(const char *name)
{
	static const char *const endings[] = { ".psr", ".ply", ".glb", ".las", ".off", ".stl", ".3mf", ".amf",
		                                   ".pcd", ".pts", ".ptx", ".xyz" };
	const char *dot = strrchr(name, '.');

	if (name[whole_name(name)] != '\0')
		return 1;
	for (size_t i = 0; dot != NULL && i < sizeof endings / sizeof endings[0]; i++)
		if (strcasecmp(dot, endings[i]) == 0)
			return 1;
	return 0;
}

/* The name that psrd gives the file. file: its whole path. */
static int name_model(char model[PSR_WIRE_MAX_NAME + 1], const char *file, struct psr_error *err)
{
	const char *name = strrchr(file, '/') + 1;
	const char *dot = name[whole_name(name)] == '\0' ? strrchr(name, '.') : name + whole_name(name) - strlen(".psr");
	const size_t n_stem = dot != NULL && dot != name ? (size_t)(dot - name) : strlen(name);

	if (n_stem > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "%s: its name has more than %d bytes", file, PSR_WIRE_MAX_NAME);
	memcpy(model, name, n_stem);
	model[n_stem] = '\0';
	return PSR_OK;
}

/* The folder that psrd is to serve: of the file alone, or the file's own. */
static int choose_models(char models[PATH_MAX], struct home *home, struct psr_error *err)
{
	const char *file = home->file, *name = strrchr(file, '/') + 1;
	char at[PATH_MAX];

	if (!is_alone(name)) {
		snprintf(models, PATH_MAX, "%.*s", name - 1 == file ? 1 : (int)(name - 1 - file), file);
		snprintf(at, sizeof at, "%.3000s/%s.psr", models, home->model);
		if (access(at, F_OK) == 0) /* psrd would serve it, and not tell of the other one */
			return psr_fail(err, PSR_ERR_ARG, "%s has the same name; view it, or move one of the two", at);
		return PSR_OK;
	}
	snprintf(models, PATH_MAX, "%s/models", daemon_folder(home->daemon));
	if (mkdir(models, 0700) != 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", models, strerror(errno));
	snprintf(at, sizeof at, "%s/models/%.*s", daemon_folder(home->daemon), (int)whole_name(name), name);
	if (symlink(file, at) != 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", at, strerror(errno));
	return PSR_OK;
}

/* Whether psrd's list has the file, and not another one of its name. */
static int check_list(struct home *home, struct psr_error *err)
{
	const char *file = home->file, *name = strrchr(file, '/') + 1;
	struct psr_msg_list_entry *entry = NULL;
	struct psr_client *client;
	uint32_t n = 0;
	int code = psr_client_connect(&client, daemon_address(home->daemon), PSR_PROGRAM, NULL, ANSWER_MS, err), has_it = 0;

	if (code != PSR_OK)
		return code;
	code = psr_client_list(client, &entry, &n, ANSWER_MS, err);
	for (uint32_t i = 0; code == PSR_OK && i < n; i++) {
		has_it |= strcmp(entry[i].name, home->model) == 0;
		if (strcmp(entry[i].name, name) == 0 && strcmp(name, home->model) != 0) {
			/* The entry is a format that nobody reads, or the second file of the name: OPEN says which. */
			struct psr_msg_opened opened;

			code = psr_client_open(client, name, ANSWER_MS, &opened, err);
		}
	}
	if (code == PSR_OK && !has_it)
		code = psr_fail(err, PSR_ERR_FORMAT, "%s: psr reads no files of this kind; psr-model build --help lists those "
		                                     "that it reads", file);
	free(entry);
	psr_client_close(client);
	return code;
}

int home_create(struct home **out, const char *path, struct psr_error *err)
{
	char *file = realpath(path, NULL);
	struct home *home = calloc(1, sizeof *home);
	struct stat status;
	int code = PSR_OK;

	if (home == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a private psrd");
	else if (file == NULL || stat(file, &status) != 0)
		code = psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	else if (!S_ISREG(status.st_mode))
		code = psr_fail(err, PSR_ERR_ARG, "%s is no file; psrd --models serves a folder", path);
	else
		code = name_model(home->model, file, err);
	if (code == PSR_OK) {
		snprintf(home->file, sizeof home->file, "%s", file);
		*out = home;
	} else {
		free(home);
	}
	free(file);
	return code;
}

int home_start(struct home *home, struct psr_error *err)
{
	const char *const options[] = { "--resolution", TEXT(HOME_COARSE_PIXELS), "--max-resolution", MOST_RESOLUTION,
		                            NULL };
	char models[PATH_MAX];
	int code = daemon_create(&home->daemon, err);

	if (code == PSR_OK)
		code = choose_models(models, home, err);
	if (code == PSR_OK)
		code = daemon_start(home->daemon, models, options, err);
	return code == PSR_OK ? check_list(home, err) : code;
}

int home_open(struct home **out, const char *path, struct psr_error *err)
{
	struct home *home = NULL;
	int code = home_create(&home, path, err);

	if (code == PSR_OK)
		code = home_start(home, err);
	if (code == PSR_OK)
		*out = home;
	else
		home_close(home);
	return code;
}

void home_close(struct home *home)
{
	char models[PATH_MAX];

	if (home == NULL)
		return;
	if (home->daemon != NULL) { /* the folder of links is empty, or psrd has started, and a keeper removes it */
		snprintf(models, sizeof models, "%s/models", daemon_folder(home->daemon));
		rmdir(models);
	}
	daemon_destroy(home->daemon);
	free(home);
}

const char *home_address(const struct home *home)
{
	return daemon_address(home->daemon);
}

const char *home_model(const struct home *home)
{
	return home->model;
}

const char *home_file(const struct home *home)
{
	return home->file;
}
