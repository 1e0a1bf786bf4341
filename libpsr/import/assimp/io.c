#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "io.h"

struct open_file {
	struct aiFile file; /* first */
	const uint8_t *bytes;
	uint8_t *owned;
	size_t n_bytes, at;
};

static size_t on_read(struct aiFile *file, char *out, size_t size, size_t count)
{
	struct open_file *f = (struct open_file *)file;
	size_t n = size > 0 ? (f->n_bytes - f->at) / size : 0;

	if (n > count)
		n = count;
	if (n > 0)
		memcpy(out, f->bytes + f->at, n * size);
	f->at += n * size;
	return n;
}

static size_t on_write(struct aiFile *file, const char *bytes, size_t size, size_t count)
{
	(void)file, (void)bytes, (void)size, (void)count;
	return 0;
}

static size_t on_tell(struct aiFile *file)
{
	return ((struct open_file *)file)->at;
}

static size_t on_size(struct aiFile *file)
{
	return ((struct open_file *)file)->n_bytes;
}

static enum aiReturn on_seek(struct aiFile *file, size_t offset, enum aiOrigin origin)
{
	struct open_file *f = (struct open_file *)file;
	size_t from = origin == aiOrigin_CUR ? f->at : origin == aiOrigin_END ? f->n_bytes : 0;

	/* Negative offsets come as large unsigned ones; the sum wraps to the right place, or is out of range. */
	if (from + offset > f->n_bytes)
		return aiReturn_FAILURE;
	f->at = from + offset;
	return aiReturn_SUCCESS;
}

static void on_flush(struct aiFile *file)
{
	(void)file;
}

static void on_close(struct aiFileIO *io, struct aiFile *file)
{
	(void)io;
	free(((struct open_file *)file)->owned);
	free(file);
}

static int open_named(struct open_file *f, struct assimp_io *io, const char *name)
{
	struct psr_error error;
	char *path;
	int rc = import_path_inside(&path, io->folder, name, &error);

	if (rc == PSR_OK) {
		rc = infile_read(&f->owned, &f->n_bytes, path, IMPORT_MAX_FILE, &error);
		free(path);
	}
	/* Assimp also probes for optional files. */
	if (rc != PSR_OK && rc != PSR_ERR_NOT_FOUND)
		import_mesh_warn(io->im, "%.200s", error.text);
	f->bytes = f->owned;
	return rc;
}

static struct aiFile *on_open(struct aiFileIO *aio, const char *name, const char *mode)
{
	struct assimp_io *io = (struct assimp_io *)aio;
	struct open_file *f;

	if (strchr(mode, 'w') != NULL || strchr(mode, 'a') != NULL || strchr(mode, '+') != NULL)
		return NULL;
	f = calloc(1, sizeof *f);
	if (f == NULL)
		return NULL;
	if (strcmp(name, io->path) == 0) {
		f->bytes = io->bytes;
		f->n_bytes = io->n_bytes;
	} else if (open_named(f, io, name) != PSR_OK) {
		free(f);
		return NULL;
	}
	f->file.ReadProc = on_read;
	f->file.WriteProc = on_write;
	f->file.TellProc = on_tell;
	f->file.FileSizeProc = on_size;
	f->file.SeekProc = on_seek;
	f->file.FlushProc = on_flush;
	return &f->file;
}

int assimp_io_init(struct assimp_io *io, struct import_mesh *im, const uint8_t *bytes, size_t n_bytes,
                   struct psr_error *err)
{
	const char *slash = strrchr(im->path, '/');
	int rc;

	memset(io, 0, sizeof *io);
	rc = import_path_folder(&io->folder, im->path, err);
	if (rc != PSR_OK)
		return rc;
	if (asprintf(&io->path, "%s/%s", io->folder, slash == NULL ? im->path : slash + 1) < 0) {
		io->path = NULL; /* asprintf leaves it undefined */
		assimp_io_fini(io);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for its path", im->path);
	}
	io->io.OpenProc = on_open;
	io->io.CloseProc = on_close;
	io->im = im;
	io->bytes = bytes;
	io->n_bytes = n_bytes;
	return PSR_OK;
}

void assimp_io_fini(struct assimp_io *io)
{
	for (uint32_t i = 0; io->image_path != NULL && i < io->im->mesh->n_images; i++)
		free(io->image_path[i]);
	free(io->image_path);
	free(io->folder);
	free(io->path);
	memset(io, 0, sizeof *io);
}
