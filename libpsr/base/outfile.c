#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "outfile.h"

#define MAX_TRIES 1000

const char *outfile_ending(const char *path)
{
	const char *name = strrchr(path, '/'), *dot;

	name = name != NULL ? name + 1 : path;
	dot = strrchr(name, '.');
	return dot == NULL || dot == name ? "" : dot + 1;
}

static int fail_system(const struct outfile *file, int reason, struct psr_error *err)
{
	return psr_fail(err, reason == ENOENT || reason == ENOTDIR ? PSR_ERR_NOT_FOUND : PSR_ERR_IO,
	                "cannot write %.300s: %s", file->path, strerror(reason));
}

/* Makes a name FOLDER/.psr-PID-N.ENDING, short enough for any file system that takes the target's name. */
static int name_temporary(char name[PATH_MAX], const char *target, pid_t pid, int n)
{
	const char *slash = strrchr(target, '/'), *ending = outfile_ending(target);
	int folder = slash == NULL ? 0 : (int)(slash + 1 - target);

	return snprintf(name, PATH_MAX, "%.*s.psr-%ld-%d%s%s", folder, target, (long)pid, n, ending[0] != '\0' ? "." : "",
	                ending) < PATH_MAX;
}

/* Takes the first free name; mkstemp() would ignore the umask. */
static int open_temporary(struct outfile *file)
{
	int fd = -1;

	for (int n = 0; n < MAX_TRIES && fd < 0; n++) {
		if (!name_temporary(file->temporary, file->target, getpid(), n)) {
			errno = ENAMETOOLONG;
			return -1;
		}
		fd = open(file->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
		if (fd < 0 && errno != EEXIST)
			return -1;
	}
	return fd;
}

static int open_target(struct outfile *file)
{
	struct stat status;

	if (stat(file->target, &status) != 0 || S_ISREG(status.st_mode))
		return open_temporary(file);
	errno = EISDIR;
	return S_ISDIR(status.st_mode) ? -1 : open(file->target, O_WRONLY | O_CLOEXEC);
}

static int attach_stream(struct outfile *file, int fd, struct psr_error *err)
{
	if (fd < 0) {
		file->temporary[0] = '\0';
		return fail_system(file, errno, err);
	}
	file->stream = fdopen(fd, "wb");
	if (file->stream != NULL)
		return PSR_OK;
	close(fd);
	if (file->temporary[0] != '\0')
		unlink(file->temporary);
	return psr_fail(err, PSR_ERR_MEMORY, "no memory to write %.300s", file->path);
}

int outfile_open(struct outfile *file, const char *path, enum outfile_kind kind, struct psr_error *err)
{
	struct stat status;

	memset(file, 0, sizeof *file);
	file->kind = kind;
	file->path = path;
	if (kind == OUTFILE_PLAIN && strcmp(path, OUTFILE_STDOUT) == 0) {
		file->path = "standard output";
		return attach_stream(file, fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3), err);
	}
	if (strlen(path) >= sizeof file->target)
		return fail_system(file, ENAMETOOLONG, err);
	if (kind == OUTFILE_DURABLE && stat(path, &status) == 0 && !S_ISREG(status.st_mode))
		return psr_fail(err, PSR_ERR_IO, "cannot write %.300s: it is not a regular file, and is left as it is", path);
	if (realpath(path, file->target) == NULL)
		strcpy(file->target, path);
	return attach_stream(file, open_target(file), err);
}

void outfile_write(struct outfile *file, const void *data, size_t n)
{
	if (file->reason == 0 && fwrite(data, 1, n, file->stream) != n)
		file->reason = errno != 0 ? errno : EIO;
}

const char *outfile_name(const struct outfile *file)
{
	return file->temporary[0] != '\0' ? file->temporary : file->path;
}

/* The new name must survive a power cut. Some file systems cannot sync folders, and say so with EINVAL. */
static int sync_folder(struct outfile *file, struct psr_error *err)
{
	char *slash = strrchr(file->target, '/');
	int fd, failed;

	strcpy(slash == NULL ? file->target : slash + 1, ".");
	fd = open(file->target, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	failed = fd < 0 || (fsync(fd) != 0 && errno != EINVAL);
	if (failed)
		psr_fail(err, PSR_ERR_IO, "%.300s is written, but a power cut may lose it: cannot sync its folder: %s",
		         file->path, strerror(errno));
	if (fd >= 0)
		close(fd);
	return failed ? PSR_ERR_IO : PSR_OK;
}

int outfile_close(struct outfile *file, int code, struct psr_error *err)
{
	if (code == PSR_OK && file->reason == 0 && file->kind == OUTFILE_DURABLE
	    && (fflush(file->stream) != 0 || fsync(fileno(file->stream)) != 0))
		file->reason = errno;
	if (fclose(file->stream) != 0 && file->reason == 0)
		file->reason = errno;
	if (code == PSR_OK && file->reason != 0)
		code = fail_system(file, file->reason, err);
	if (file->temporary[0] == '\0')
		return code;
	if (code == PSR_OK && rename(file->temporary, file->target) != 0)
		code = fail_system(file, errno, err);
	if (code != PSR_OK)
		unlink(file->temporary);
	else if (file->kind == OUTFILE_DURABLE)
		code = sync_folder(file, err);
	return code;
}

int outfile_save(const char *path, enum outfile_kind kind, const void *data, size_t n, struct psr_error *err)
{
	struct outfile file;
	int code = outfile_open(&file, path, kind, err);

	if (code != PSR_OK)
		return code;
	outfile_write(&file, data, n);
	return outfile_close(&file, PSR_OK, err);
}

int outfile_flush_stdout(struct psr_error *err)
{
	errno = 0;
	if (ferror(stdout) || fflush(stdout) != 0)
		return psr_fail(err, PSR_ERR_IO, "cannot write to standard output: %s", strerror(errno != 0 ? errno : EIO));
	return PSR_OK;
}

void outfile_remove_remains(const char *path, pid_t pid)
{
	char name[PATH_MAX];

	for (int n = 0; n < MAX_TRIES && name_temporary(name, path, pid, n) && unlink(name) == 0; n++)
		;
}
