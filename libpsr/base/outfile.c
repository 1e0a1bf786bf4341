#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "outfile.h"

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

/* The first free name `.STEM.PID-N.ENDING` in the target's folder. */
static int open_temporary(struct outfile *file)
{
	const char *slash = strrchr(file->target, '/'), *ending = outfile_ending(file->target);
	int folder = slash == NULL ? 0 : (int)(slash + 1 - file->target), fd = -1;

	for (int n = 0; n < 1000 && fd < 0; n++) {
		if (snprintf(file->temporary, sizeof file->temporary, "%.*s.psr-%ld-%d%s%s", folder, file->target,
		             (long)getpid(), n, ending[0] != '\0' ? "." : "", ending)
		    >= (int)sizeof file->temporary) {
			errno = ENAMETOOLONG;
			return -1;
		}
		fd = open(file->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
		if (fd < 0 && errno != EEXIST)
			return -1;
	}
	return fd;
}

static int open_stdout(struct outfile *file, struct psr_error *err)
{
	int fd = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);

	file->path = "standard output";
	if (fd < 0)
		return fail_system(file, errno, err);
	file->stream = fdopen(fd, "wb");
	if (file->stream != NULL)
		return PSR_OK;
	close(fd);
	return psr_fail(err, PSR_ERR_MEMORY, "no memory to write to standard output");
}

int outfile_open(struct outfile *file, const char *path, struct psr_error *err)
{
	struct stat status;
	int fd, reason;

	memset(file, 0, sizeof *file);
	if (strcmp(path, OUTFILE_STDOUT) == 0)
		return open_stdout(file, err);
	file->path = path;
	if (strlen(path) >= sizeof file->target)
		return fail_system(file, ENAMETOOLONG, err);
	if (realpath(path, file->target) == NULL)
		strcpy(file->target, path);
	if (stat(file->target, &status) == 0 && !S_ISREG(status.st_mode)) {
		if (S_ISDIR(status.st_mode))
			return fail_system(file, EISDIR, err);
		fd = open(file->target, O_WRONLY | O_CLOEXEC);
	} else {
		fd = open_temporary(file);
	}
	if (fd < 0) {
		reason = errno;
		file->temporary[0] = '\0';
		return fail_system(file, reason, err);
	}
	file->stream = fdopen(fd, "wb");
	if (file->stream == NULL) {
		close(fd);
		if (file->temporary[0] != '\0')
			unlink(file->temporary);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to write %.300s", path);
	}
	return PSR_OK;
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

int outfile_close(struct outfile *file, int code, struct psr_error *err)
{
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
	return code;
}
