#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/mem.h"
#include "cubes.h"
#include "file.h"
#include "pack.h"

#define MAX_NAME 200 /* of a path in an error text, to leave room for the sentence */

#define LEAST_SHARED ((size_t)8 << 20) /* bytes of an image whose checks threads share */

struct psr_model {
	atomic_uint n_refs;
	int is_mapped, is_packed;
	uint64_t file_bytes;
	size_t n_bytes;
	const uint8_t *bytes; /* the image */
	struct content content;
	pthread_mutex_t making;  /* held by the one who makes the cubes */
	_Atomic(struct psr_cubes *) cubes; /* of its octree, once somebody has asked for them; or NULL */
	struct psr_points *points; /* of its differential points, or NULL */
	struct pack_facts facts; /* of the packed file */
};

static void release_image(const uint8_t *bytes, size_t n_bytes, int is_mapped)
{
	if (is_mapped)
		munmap((void *)bytes, n_bytes);
	else
		psr_free_huge((void *)bytes, n_bytes);
}

/* Returns threads for what is large; NULL otherwise, and where the system has none: the caller then works alone. */
static struct psr_pool *pool_for(size_t n_bytes)
{
	struct psr_pool *pool = NULL;

	return n_bytes >= LEAST_SHARED && psr_pool_create(&pool, psr_pool_all_cores(), NULL) == PSR_OK ? pool : NULL;
}

int model_adopt(struct psr_model **out, const uint8_t *bytes, size_t n_bytes, int is_mapped, const char *name,
                struct psr_error *err)
{
	struct psr_model *model = calloc(1, sizeof *model);
	struct psr_pool *pool = pool_for(n_bytes);
	int code;

	if (model == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "%s: out of memory", name);
	else
		code = file_parse(bytes, n_bytes, pool, name, &model->content, err);
	if (code == PSR_OK && model->content.has_points)
		code = psr_points_create(&model->points, &model->content.points, name, err);
	psr_pool_destroy(pool);
	if (code != PSR_OK) {
		free(model);
		release_image(bytes, n_bytes, is_mapped);
		return code;
	}
	atomic_init(&model->n_refs, 1);
	atomic_init(&model->cubes, NULL);
	pthread_mutex_init(&model->making, NULL);
	model->is_mapped = is_mapped;
	model->bytes = bytes;
	model->n_bytes = n_bytes;
	*out = model;
	return PSR_OK;
}

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
	if (code == PSR_OK) {
		(*out)->is_packed = 1;
		(*out)->facts = facts;
		(*out)->file_bytes = source->n_bytes;
	}
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

/* pixels: of a first picture; 0: reads all. */
static int open_model(struct psr_model **out, const char *path, int mapped, uint32_t pixels, struct psr_error *err)
{
	const char *name = short_name(path);
	const uint8_t *bytes = NULL;
	struct found f;
	int code = open_file(&f, path, name, err);

	if (code != PSR_OK)
		return code;
	if (f.is_packed) {
		struct pack_source source = { .fd = f.fd, .n_bytes = f.n_bytes, .name = name };

		if (pixels > 0)
			source.n_bytes = pack_coarse_end(&source, pixels);
		code = adopt_packed(out, &source, err);
	} else {
		code = mapped ? map_image(&bytes, f.fd, f.n_bytes, name, err) : read_image(&bytes, f.fd, f.n_bytes, name, err);
	}
	close(f.fd);
	if (f.is_packed || code != PSR_OK)
		return code;
	code = model_adopt(out, bytes, f.n_bytes, mapped, name, err);
	if (code == PSR_OK)
		(*out)->file_bytes = f.n_bytes;
	return code;
}

int psr_model_need(uint64_t *n_bytes, const char *path, struct psr_error *err)
{
	const char *name = short_name(path);
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
	close(f.fd);
	if (f.is_packed && f.n_whole > f.n_bytes && cubes > 2 * f.n_image)
		cubes = 2 * f.n_image; /* OCTR counts the whole tree */
	*n_bytes = (f.is_packed ? f.n_image : f.n_bytes) + sizeof(struct psr_model) + cubes;
	return PSR_OK;
}

int psr_model_map(struct psr_model **out, const char *path, struct psr_error *err)
{
	return open_model(out, path, 1, 0, err);
}

int psr_model_read(struct psr_model **out, const char *path, struct psr_error *err)
{
	return open_model(out, path, 0, 0, err);
}

int psr_model_read_coarse(struct psr_model **out, const char *path, uint32_t pixels, struct psr_error *err)
{
	return open_model(out, path, 0, pixels, err);
}

int psr_model_has_coarse(const char *path, uint32_t pixels)
{
	struct found f;
	uint64_t end;

	if (open_file(&f, path, path, NULL) != PSR_OK)
		return 0;
	end = pack_coarse_end(&(struct pack_source){ .fd = f.fd, .n_bytes = f.n_bytes, .name = path }, pixels);
	close(f.fd);
	return end < f.n_bytes;
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

struct psr_model *psr_model_ref(struct psr_model *model)
{
	atomic_fetch_add_explicit(&model->n_refs, 1, memory_order_relaxed);
	return model;
}

void psr_model_unref(struct psr_model *model)
{
	if (model == NULL || atomic_fetch_sub_explicit(&model->n_refs, 1, memory_order_acq_rel) != 1)
		return;
	release_image(model->bytes, model->n_bytes, model->is_mapped);
	psr_cubes_destroy(atomic_load_explicit(&model->cubes, memory_order_acquire));
	pthread_mutex_destroy(&model->making);
	psr_points_destroy(model->points);
	free(model);
}

const struct psr_model_info *psr_model_info(const struct psr_model *model)
{
	return &model->content.info;
}

const struct psr_blocks *psr_model_blocks(const struct psr_model *model)
{
	return model->content.has_blocks ? &model->content.blocks : NULL;
}

const struct octree *psr_model_octree(const struct psr_model *model)
{
	return model->content.has_octree ? &model->content.octree : NULL;
}

int psr_model_octree_shares(const struct psr_model *model, struct octree_shares *shares)
{
	*shares = model->facts.shares;
	return shares->codes > 0;
}

const struct psr_presets *psr_model_presets(const struct psr_model *model)
{
	return &model->content.presets;
}

int psr_model_is_prefix(const struct psr_model *model, struct psr_model_prefix *prefix)
{
	*prefix = model->facts.prefix;
	return prefix->levels > 0;
}

void psr_model_content_id(const struct psr_model *model, uint8_t id[16])
{
	memcpy(id, model->bytes + HEADER_CONTENT_ID, 16);
}

uint64_t psr_model_file_bytes(const struct psr_model *model, int *is_packed)
{
	*is_packed = model->is_packed;
	return model->file_bytes;
}

uint64_t psr_model_bytes(const struct psr_model *model)
{
	const struct psr_cubes *cubes = psr_model_cubes(model);

	return model->n_bytes + sizeof *model + (cubes != NULL ? cubes->n_bytes : 0)
	       + (model->points != NULL ? model->points->n_bytes : 0);
}

int psr_model_make_cubes(const struct psr_model *model, struct psr_error *err)
{
	/* Cubes are a cache: whoever reads the model sees no change. */
	struct psr_model *own = (struct psr_model *)(uintptr_t)model;
	int code = PSR_OK;

	if (!model->content.has_octree || psr_model_cubes(model) != NULL)
		return PSR_OK;
	pthread_mutex_lock(&own->making);
	if (psr_model_cubes(model) == NULL) {
		struct psr_pool *pool = pool_for(model->n_bytes);
		struct psr_cubes *cubes = NULL;

		code = psr_cubes_create(&cubes, &model->content.octree, pool, err);
		psr_pool_destroy(pool);
		atomic_store_explicit(&own->cubes, cubes, memory_order_release);
	}
	pthread_mutex_unlock(&own->making);
	return code;
}

const struct psr_cubes *psr_model_cubes(const struct psr_model *model)
{
	return atomic_load_explicit(&model->cubes, memory_order_acquire);
}

const struct psr_points *psr_model_points(const struct psr_model *model)
{
	return model->points;
}

const struct dpoint_set *psr_model_point_set(const struct psr_model *model)
{
	return model->content.has_points ? &model->content.points : NULL;
}

const uint8_t *model_image(const struct psr_model *model, size_t *n_bytes)
{
	*n_bytes = model->n_bytes;
	return model->bytes;
}

const struct content *model_content(const struct psr_model *model)
{
	return &model->content;
}
