#include "cold.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/clock.h"

#define CHUNK (1 << 20)

static int count_pages(uint64_t *n_left, uint64_t *n_pages, int fd)
{
	const size_t page = (size_t)sysconf(_SC_PAGESIZE);
	unsigned char *in_memory;
	struct stat is;
	void *bytes;
	int is_known;

	if (fstat(fd, &is) != 0)
		return 0;
	*n_pages = ((uint64_t)is.st_size + page - 1) / page;
	*n_left = 0;
	if (is.st_size == 0)
		return 1;
	bytes = mmap(NULL, (size_t)is.st_size, PROT_READ, MAP_SHARED, fd, 0);
	if (bytes == MAP_FAILED)
		return 0;
	in_memory = malloc(*n_pages);
	is_known = in_memory != NULL && mincore(bytes, (size_t)is.st_size, in_memory) == 0;
	for (uint64_t i = 0; is_known && i < *n_pages; i++)
		*n_left += in_memory[i] & 1;
	free(in_memory);
	munmap(bytes, (size_t)is.st_size);
	return is_known;
}

int cold_drop(uint64_t *n_left, uint64_t *n_pages, const char *path, struct psr_error *err)
{
	const int fd = open(path, O_RDONLY | O_CLOEXEC);
	int is_dropped;

	if (fd < 0)
		return psr_fail(err, PSR_ERR_IO, "%s: %s", path, strerror(errno));
	is_dropped = fsync(fd) == 0 && posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED) == 0 && count_pages(n_left, n_pages, fd);
	close(fd);
	return is_dropped ? PSR_OK : psr_fail(err, PSR_ERR_IO, "%s: cannot be put out of the page cache", path);
}

int cold_read(double *seconds, uint64_t *n_bytes, const char *path, struct psr_error *err)
{
	const double begin = clock_seconds();
	const int fd = open(path, O_RDONLY | O_CLOEXEC);
	char *chunk = malloc(CHUNK);
	ssize_t n = -1;

	*n_bytes = 0;
	while (fd >= 0 && chunk != NULL && (n = read(fd, chunk, CHUNK)) > 0)
		*n_bytes += (uint64_t)n;
	*seconds = clock_seconds() - begin;
	free(chunk);
	if (fd >= 0)
		close(fd);
	return n == 0 ? PSR_OK : psr_fail(err, PSR_ERR_IO, "%s: cannot be read", path);
}
