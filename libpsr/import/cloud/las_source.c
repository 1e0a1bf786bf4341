#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>
#include "las.h"
#include "las_source.h"
#include "base/srgb.h"

#define SLAB (1 << 20) /* bytes read at a time */
#define HEADER 375     /* at most, of version 1.4 */
#define MOST_BEFORE ((uint64_t)256 << 20)

struct las_source {
	struct las las;
	struct las_tint tint;
	int fd;
	uint64_t step;                 /* of so many runs of LAS_RUN points, one is read; 1: all */
	uint64_t next;                 /* the next point, */
	uint8_t *before, *slab;        /* the file's bytes before the points; points read: */
	size_t n_slab, slab_next;      /* points, and the next of them */
};

static int read_at(const struct las_source *s, uint8_t *to, size_t n, uint64_t at, struct psr_error *err)
{
	for (size_t got = 0; got < n;) {
		const ssize_t more = pread(s->fd, to + got, n - got, (off_t)(at + got));

		if (more < 0 && errno == EINTR)
			continue;
		if (more < 0)
			return psr_fail(err, PSR_ERR_IO, "%s: %s", s->las.path, strerror(errno));
		if (more == 0)
			return psr_fail(err, PSR_ERR_IO, "%s: became shorter while it was read", s->las.path);
		got += (size_t)more;
	}
	return PSR_OK;
}

/* Returns the next point; NULL behind the last one, or with *rc other than PSR_OK. */
static const uint8_t *next_point(struct las_source *s, int *rc, struct psr_error *err)
{
	const struct las *las = &s->las;

	*rc = PSR_OK;
	if (s->slab_next == s->n_slab) {
		const uint64_t left = las->n_points > s->next ? las->n_points - s->next : 0;
		const uint64_t most = s->step > 1 ? LAS_RUN : SLAB / las->record;

		s->n_slab = (size_t)(left < most ? left : most);
		s->slab_next = 0;
		if (s->n_slab == 0)
			return NULL;
		*rc = read_at(s, s->slab, s->n_slab * las->record, las->first + s->next * las->record, err);
		if (*rc != PSR_OK)
			return NULL;
		s->next += s->n_slab * s->step;
	}
	return s->slab + s->slab_next++ * las->record;
}

static int go_back(void *userdata, struct psr_error *err)
{
	struct las_source *s = userdata;

	(void)err;
	s->next = s->n_slab = s->slab_next = 0;
	return PSR_OK;
}

static void put_color(uint8_t color[3], const struct las_tint *tint, const uint8_t *p)
{
	const double gray = (double)las_get(p + 12, 2) * tint->scale;

	for (int c = 0; c < 3; c++) {
		if (tint->color > 0)
			color[c] = (uint8_t)fmin((double)las_get(p + tint->color + 2 * c, 2) * tint->scale + 0.5, 255.0);
		else
			color[c] = psr_linear_to_srgb((float)gray);
	}
}

/* Point formats 6 and above have the fields of those before elsewhere, and wider ones. */
static void put_scan(struct octree_point *point, const struct las *las, const uint8_t *p)
{
	const int is_new = las->format >= 6;

	point->intensity = (uint16_t)las_get(p + 12, 2);
	point->returns = is_new ? p[14] : (uint8_t)((p[14] & 7) | (p[14] >> 3 & 7) << 4);
	point->class = is_new ? p[16] : p[15] & 31;
	point->time = las_has_time(las) ? las_get_double(p + (is_new ? 22 : 20)) : 0.0;
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct las_source *s = userdata;
	const uint8_t *p;
	int rc = PSR_OK;

	for (*n = 0; *n < room && (p = next_point(s, &rc, err)) != NULL;) {
		struct octree_point *point = &points[*n];

		if (las_is_left_out(&s->las, p))
			continue;
		for (int c = 0; c < 3; c++)
			point->at[c] = (double)(int32_t)(uint32_t)las_get(p + 4 * c, 4) * s->las.scale[c] + s->las.offset[c];
		if (!s->tint.is_none)
			put_color(point->color, &s->tint, p);
		put_scan(point, &s->las, p);
		++*n;
	}
	return rc;
}

/* Reads all that stands before the points, and checks it. */
static int read_before(struct las_source *s, struct psr_error *err)
{
	uint64_t n = s->las.n_bytes < HEADER ? s->las.n_bytes : HEADER, first;
	uint8_t *all;
	int rc;

	s->before = calloc(1, HEADER);
	if (s->before == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the header", s->las.path);
	rc = read_at(s, s->before, n, 0, err);
	if (rc != PSR_OK)
		return rc;
	first = las_get(s->before + 96, 4);
	if (n == HEADER && first > HEADER && first <= s->las.n_bytes && memcmp(s->before, "LASF", 4) == 0) {
		if (first > MOST_BEFORE)
			return psr_fail(err, PSR_ERR_LIMIT, "%s: %llu MB stand before the points; the limit is %llu MB", s->las.path,
			                (unsigned long long)(first >> 20), (unsigned long long)(MOST_BEFORE >> 20));
		all = realloc(s->before, first);
		if (all == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the header", s->las.path);
		s->before = all;
		rc = read_at(s, all, first, 0, err);
	}
	s->las.bytes = s->before;
	return rc == PSR_OK ? las_read_header(&s->las, err) : rc;
}

static int find_tint(struct las_source *s, struct psr_error *err)
{
	const uint8_t *p;
	int rc = las_tint_begin(&s->tint, &s->las, err);

	if (rc != PSR_OK)
		return rc;
	while ((p = next_point(s, &rc, err)) != NULL)
		las_tint_note(&s->tint, &s->las, p);
	las_tint_end(&s->tint);
	return rc;
}

/* A point may take 64 KB. */
static size_t slab_bytes(const struct las *las)
{
	return (size_t)LAS_RUN * las->record > SLAB ? (size_t)LAS_RUN * las->record : SLAB;
}

static int open_file(struct las_source *s, struct psr_error *err)
{
	struct stat st;
	int rc;

	s->fd = open(s->las.path, O_RDONLY | O_CLOEXEC);
	if (s->fd < 0)
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", s->las.path, strerror(errno));
	if (fstat(s->fd, &st) != 0 || !S_ISREG(st.st_mode))
		return psr_fail(err, PSR_ERR_IO, "%s: not a file", s->las.path);
	s->las.n_bytes = (uint64_t)st.st_size;
	rc = read_before(s, err);
	if (rc != PSR_OK)
		return rc;
	s->slab = malloc(slab_bytes(&s->las));
	if (s->slab == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for points", s->las.path);
	s->step = s->step == 0 ? 1 : (s->las.n_points + s->step - 1) / s->step;
	return find_tint(s, err);
}

int las_source_open(struct octree_source *out, const char *path, struct psr_error *err)
{
	return las_source_open_part(out, path, 0, err);
}

int las_source_open_part(struct octree_source *out, const char *path, uint64_t most, struct psr_error *err)
{
	struct las_source *s = calloc(1, sizeof *s);
	int rc;

	if (s == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read it", path);
	s->fd = -1;
	s->las.path = path;
	s->step = most;
	*out = (struct octree_source){ .name = path, .rewind = go_back, .read = read_points, .userdata = s };
	rc = open_file(s, err);
	if (rc != PSR_OK) {
		las_source_close(out);
		return rc;
	}
	out->has_color = !s->tint.is_none;
	out->scan = 1u << OCTREE_INTENSITY | 1u << OCTREE_CLASS | 1u << OCTREE_RETURNS
	            | (unsigned)las_has_time(&s->las) << OCTREE_TIME;
	out->n_points = (s->las.n_points + s->step - 1) / s->step;
	return PSR_OK;
}

void las_source_close(struct octree_source *source)
{
	struct las_source *s = source->userdata;

	if (s == NULL)
		return;
	if (s->fd >= 0)
		close(s->fd);
	free(s->before);
	free(s->slab);
	free(s);
	source->userdata = NULL;
}
