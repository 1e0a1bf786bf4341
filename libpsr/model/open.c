/* Models from files: whole ones, and the beginnings of packed ones. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/mem.h"
#include "file.h"
#include "pack.h"

#define MAX_NAME 200 /* of a path in an error text, to leave room for the sentence */

static const char *short_name(const char *path)
{
	size_t length = strlen(path);

	return length > MAX_NAME ? path + length - MAX_NAME : path;
}

/* Facts about a file before reading. */
struct found {
	int fd, is_packed;
	size_t n_bytes;   /* of the file */
	uint64_t n_image; /* its unpacked size by the header, if packed */
	uint64_t n_whole; /* its own size by the header, if packed */
};

static int adopt_packed(struct psr_model **out, const struct pack_source *source, struct psr_error *err)
{
	uint8_t *image = NULL;
	struct pack_facts facts;
	size_t n_image = 0;
	int code = pack_open(&image, &n_image, &facts, source, err);

	if (code == PSR_OK)
		code = model_adopt(out, image, n_image, 0, source->name, err);
	if (code == PSR_OK)
		model_set_source(*out, source->n_bytes, &facts);
	return code;
}

/* Opens a regular file with the beginning of a .psr file. */
static int open_file(struct found *found, const char *path, const char *name, struct psr_error *err)
{
	uint8_t header[FILE_HEADER_BYTES] = { 0 };
	struct stat st;
	ssize_t got;
	int code, *fd = &found->fd;

	/* O_NONBLOCK: opening a pipe without a writer would wait for one. */
	*fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	if (*fd < 0)
		return psr_fail(err, errno == ENOENT || errno == ENOTDIR ? PSR_ERR_NOT_FOUND : PSR_ERR_IO,
		                "%s: cannot open the model: %m", name);
	if (fstat(*fd, &st) != 0)
		code = psr_fail(err, PSR_ERR_IO, "%s: cannot look at the file: %m", name);
	else if (!S_ISREG(st.st_mode))
		code = psr_fail(err, PSR_ERR_IO, "%s: not a regular file", name);
	else if ((got = pread(*fd, header, sizeof header, 0)) < 0)
		code = psr_fail(err, PSR_ERR_IO, "%s: cannot read the file: %m", name);
	else if (got < FILE_HEADER_BYTES)
		code = psr_fail(err, PSR_ERR_FORMAT, "%s: the file ends at byte %zd, within its header (bytes 0 to %d); it is "
		                "not a .psr file or was cut short", name, got, FILE_HEADER_BYTES);
	else
		code = file_check_header(header, name, err);
	if (code != PSR_OK) {
		close(*fd);
		return code;
	}
	found->n_bytes = (size_t)st.st_size;
	found->is_packed = pack_is_packed(header);
	found->n_image = file_get(header + HEADER_FILE_SIZE, 8);
	found->n_whole = file_get(header + HEADER_PACKED_SIZE, 8);
	return PSR_OK;
}

static int read_all(int fd, uint8_t *bytes, size_t n_bytes, const char *name, struct psr_error *err)
{
	size_t at = 0;

	while (at < n_bytes) {
		ssize_t got = read(fd, bytes + at, n_bytes - at);

		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0)
			return psr_fail(err, PSR_ERR_IO, "%s: cannot read the file from byte %zu on: %m", name, at);
		if (got == 0)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: the file shrank to %zu bytes while it was read", name, at);
		at += (size_t)got;
	}
	return PSR_OK;
}

static int map_image(const uint8_t **out, int fd, size_t n_bytes, const char *name, struct psr_error *err)
{
	void *bytes = mmap(NULL, n_bytes, PROT_READ, MAP_PRIVATE, fd, 0);

	if (bytes == MAP_FAILED)
		return psr_fail(err, errno == ENOMEM ? PSR_ERR_MEMORY : PSR_ERR_IO, "%s: cannot map the file: %m", name);
	*out = bytes;
	return PSR_OK;
}

static int read_image(const uint8_t **out, int fd, size_t n_bytes, const char *name, struct psr_error *err)
{
	uint8_t *bytes = psr_alloc_huge(n_bytes);
	int code;

	if (bytes == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a model of %zu bytes", name, n_bytes);
	code = read_all(fd, bytes, n_bytes, name, err);
	if (code != PSR_OK) {
		psr_free_huge(bytes, n_bytes);
		return code;
	}
	*out = bytes;
	return PSR_OK;
}

/* Finds the shortest beginning of the file of at least so many levels. Returns whether there is one. */
static int find_beginning(struct pack_beginning *is, const struct found *f, const char *name, uint32_t levels)
{
	const struct pack_source source = { .fd = f->fd, .n_bytes = f->n_bytes, .name = name };
	struct pack_beginning all[OCTREE_MOST_STEPS];
	const int n = levels > 0 && f->is_packed ? pack_beginnings(all, &source) : 0;

	for (int i = 0; i < n; i++) {
		if (all[i].levels < levels)
			continue;
		*is = all[i];
		return 1;
	}
	return 0;
}

struct how {
	int is_mapped;
	uint32_t levels; /* 0: all */
	const struct psr_cancel *cancel;
};

static int open_model(struct psr_model **out, const char *path, struct how how, struct psr_error *err)
{
	const char *name = short_name(path);
	const uint8_t *bytes = NULL;
	struct found f;
	int code = open_file(&f, path, name, err);

	if (code != PSR_OK)
		return code;
	if (f.is_packed) {
		struct pack_source source = { .fd = f.fd, .n_bytes = f.n_bytes, .name = name, .cancel = how.cancel };
		struct pack_beginning is;

		if (find_beginning(&is, &f, name, how.levels))
			source.n_bytes = is.end;
		code = adopt_packed(out, &source, err);
	} else {
		code = (how.is_mapped ? map_image : read_image)(&bytes, f.fd, f.n_bytes, name, err);
	}
	close(f.fd);
	if (f.is_packed || code != PSR_OK)
		return code;
	code = model_adopt(out, bytes, f.n_bytes, how.is_mapped, name, err);
	if (code == PSR_OK)
		model_set_source(*out, f.n_bytes, NULL);
	return code;
}

int psr_model_need(uint64_t *n_bytes, const char *path, uint32_t levels, struct psr_error *err)
{
	const char *name = short_name(path);
	struct pack_beginning is;
	struct found f;
	uint64_t cubes;
	int code = open_file(&f, path, name, err);

	if (code != PSR_OK)
		return code;
	if (f.is_packed && f.n_whole > f.n_bytes && f.n_image > pack_max_image(f.n_bytes))
		f.n_image = pack_max_image(f.n_bytes); /* a beginning of the file becomes no more */
	if (f.is_packed && f.n_image > pack_max_image(f.n_bytes)) {
		close(f.fd);
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the header says that %zu bytes unpack to %" PRIu64 "; the limit is "
		                "%d to 1", name, f.n_bytes, f.n_image, PACK_MAX_RATIO);
	}
	cubes = model_cubes_need(&(struct pack_source){ .fd = f.fd, .n_bytes = f.n_bytes, .name = name }, f.is_packed);
	if (find_beginning(&is, &f, name, levels)) { /* of the octree's arrays about the part that it has of the leaves */
		f.n_image = is.n_rest + (uint64_t)ceil(is.part * (double)(f.n_image - is.n_rest));
		cubes = (uint64_t)ceil(is.part * (double)cubes);
	}
	close(f.fd);
	if (f.is_packed && f.n_whole > f.n_bytes && cubes > 2 * f.n_image)
		cubes = 2 * f.n_image; /* OCTR counts the whole tree */
	*n_bytes = (f.is_packed ? f.n_image : f.n_bytes) + model_own_bytes() + cubes;
	return PSR_OK;
}

int psr_model_map(struct psr_model **out, const char *path, struct psr_error *err)
{
	return open_model(out, path, (struct how){ .is_mapped = 1 }, err);
}

int psr_model_read(struct psr_model **out, const char *path, struct psr_error *err)
{
	return open_model(out, path, (struct how){ 0 }, err);
}

int psr_model_read_levels(struct psr_model **out, const char *path, uint32_t levels, const struct psr_cancel *cancel,
                          struct psr_error *err)
{
	return open_model(out, path, (struct how){ .levels = levels, .cancel = cancel }, err);
}

uint32_t psr_model_beginnings(const char *path)
{
	struct pack_beginning all[OCTREE_MOST_STEPS];
	uint32_t levels = 0;
	struct found f;
	int n = 0;

	if (open_file(&f, path, path, NULL) != PSR_OK)
		return 0;
	if (f.is_packed)
		n = pack_beginnings(all, &(struct pack_source){ .fd = f.fd, .n_bytes = f.n_bytes, .name = path });
	close(f.fd);
	for (int i = 0; i < n; i++)
		levels |= (uint32_t)1 << all[i].levels;
	return levels;
}

int psr_model_parse(struct psr_model **out, const void *bytes, size_t n_bytes, struct psr_error *err)
{
	uint8_t *copy;

	if (n_bytes == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "the model has no bytes");
	if (n_bytes >= FILE_HEADER_BYTES && file_check_header(bytes, "the model", NULL) == PSR_OK && pack_is_packed(bytes))
		return adopt_packed(out, &(struct pack_source){ .fd = -1, .bytes = bytes, .n_bytes = n_bytes,
		                                                .name = "the model" }, err);
	copy = psr_alloc_huge(n_bytes);
	if (copy == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model of %zu bytes", n_bytes);
	memcpy(copy, bytes, n_bytes);
	return model_adopt(out, copy, n_bytes, 0, "the model", err);
}
