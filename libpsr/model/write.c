#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/mem.h"
#include "file.h"
#include "pack.h"

#define MAX_TRIES 100

/* Creates "PATH.<process>-<number>.tmp"; mkstemp() would ignore the umask. */
static int open_temporary(char **out, const char *path, struct psr_error *err)
{
	static atomic_uint n_made;
	size_t size = strlen(path) + 64;
	char *name = malloc(size);
	int fd = -1;
	if (name == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the name of a file");
	for (int i = 0; i < MAX_TRIES && fd < 0; i++) {
		snprintf(name, size, "%s.%ld-%u.tmp", path, (long)getpid(), atomic_fetch_add(&n_made, 1));
		fd = open(name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
		if (fd < 0 && errno != EEXIST)
			break;
	}
	if (fd < 0) {
		psr_fail(err, PSR_ERR_IO, "%.200s: cannot create a file beside it: %m", path);
		free(name);
		return PSR_ERR_IO;
	}
	*out = name;
	return fd;
}

static int write_all(int fd, const uint8_t *bytes, size_t n_bytes)
{
	size_t at = 0;
	while (at < n_bytes) {
		ssize_t done = write(fd, bytes + at, n_bytes - at);
		if (done < 0 && errno != EINTR)
			return -1;
		if (done > 0)
			at += (size_t)done;
	}
	return 0;
}

/* Makes the new name survive a power cut. File systems that cannot sync folders fail with EINVAL. */
static int sync_folder(const char *path)
{
	const char *slash = strrchr(path, '/');
	char *folder = slash == NULL ? strdup(".") : strndup(path, slash == path ? 1 : (size_t)(slash - path));
	int fd, failed;
	if (folder == NULL)
		return -1;
	fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	free(folder);
	if (fd < 0)
		return -1;
	failed = fsync(fd) != 0 && errno != EINVAL;
	close(fd);
	return failed ? -1 : 0;
}

static int fill(int fd, const uint8_t *bytes, size_t n_bytes)
{
	int failed = write_all(fd, bytes, n_bytes) != 0 || fsync(fd) != 0, reason = errno;
	if (close(fd) != 0 && !failed) {
		failed = 1;
		reason = errno;
	}
	errno = reason;
	return failed ? -1 : 0;
}

/* Fails before the work if the path cannot be written. */
static int check_place(const char *path, struct psr_error *err)
{
	struct stat st;
	if (stat(path, &st) == 0 && !S_ISREG(st.st_mode))
		return psr_fail(err, PSR_ERR_IO, "%.200s: exists and is not a regular file", path);
	return PSR_OK;
}

static int write_file(const char *path, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	char *temporary = NULL;
	int fd, code = PSR_OK;
	fd = open_temporary(&temporary, path, err);
	if (fd < 0)
		return fd;
	if (fill(fd, bytes, n_bytes) != 0)
		code = psr_fail(err, PSR_ERR_IO, "%.200s: cannot write the model: %m", path);
	else if (rename(temporary, path) != 0)
		code = psr_fail(err, PSR_ERR_IO, "%.200s: cannot give the file its name: %m", path);
	else if (sync_folder(path) != 0)
		code = psr_fail(err, PSR_ERR_IO, "%.200s: the model is written, and may be lost in a power cut: cannot sync "
		                "its folder: %m", path);
	if (code != PSR_OK)
		unlink(temporary);
	free(temporary);
	return code;
}

int psr_model_write(const struct psr_model *model, const char *path, struct psr_error *err)
{
	size_t n_bytes;
	const uint8_t *bytes = model_image(model, &n_bytes);
	int code = check_place(path, err);
	return code == PSR_OK ? write_file(path, bytes, n_bytes, err) : code;
}

int psr_model_write_packed(const struct psr_model *model, const char *path, struct psr_error *err)
{
	size_t n_image, n_bytes, capacity;
	const uint8_t *image = model_image(model, &n_image);
	uint8_t *bytes;
	int code = check_place(path, err);
	if (code == PSR_OK)
		code = pack_image(&bytes, &n_bytes, &capacity, image, n_image, err);
	if (code != PSR_OK)
		return code;
	code = write_file(path, bytes, n_bytes, err);
	psr_free_huge(bytes, capacity);
	return code;
}
