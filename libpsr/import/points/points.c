#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "feed.h"
#include "pcd_points.h"
#include "ply_points.h"
#include "points.h"
#include "text.h"
#include "import/cloud/las_source.h"
#include "import/import.h"

#define SNIFF 65536

enum format { LAS, PLY, PCD, PTS, PTX, XYZ, E57, OTHER };

struct points {
	struct octree_source inner;
	enum format format;
	uint64_t left_out, n_read;
};

static int begins_with(const uint8_t *bytes, size_t n, const char *text)
{
	return n >= strlen(text) && strncasecmp((const char *)bytes, text, strlen(text)) == 0;
}

/* Meshes are lines of numbers, too. */
static int may_be_text(const char *path)
{
	static const char *const endings[] = { ".txt", ".csv", ".tsv", ".asc", ".dat", ".xyzrgb", ".xyzi", ".xyzn" };
	const char *name = strrchr(path, '/');

	for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
		if (import_path_ends_with(path, endings[i]))
			return 1;
	return strchr(name != NULL ? name : path, '.') == NULL;
}

static enum format format_of(const char *path, const uint8_t *bytes, size_t n)
{
	static const struct {
		const char *ending;
		enum format format;
	} endings[] = { { ".las", LAS }, { ".laz", LAS }, { ".ply", PLY }, { ".pcd", PCD }, { ".e57", E57 },
		            { ".pts", PTS }, { ".ptx", PTX }, { ".xyz", XYZ } };

	if (begins_with(bytes, n, "LASF"))
		return LAS;
	if (begins_with(bytes, n, "ply\n") || begins_with(bytes, n, "ply\r"))
		return PLY;
	if (begins_with(bytes, n, "# .PCD"))
		return PCD;
	if (begins_with(bytes, n, "ASTM-E57"))
		return E57;
	for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
		if (import_path_ends_with(path, endings[i].ending))
			return endings[i].format;
	return may_be_text(path) && text_looks_like_points(bytes, n) ? XYZ : OTHER;
}

static int find_format(enum format *format, const char *path, struct psr_error *err)
{
	struct feed feed;
	int rc = feed_open(&feed, path, err);

	if (rc == PSR_OK)
		rc = feed_need(&feed, SNIFF, err);
	if (rc == PSR_OK)
		*format = format_of(path, feed.bytes, feed.n < SNIFF ? feed.n : SNIFF);
	feed_close(&feed);
	return rc;
}

static int open_format(struct octree_source *out, const char *path, enum format format, uint64_t part,
                       struct psr_error *err)
{
	switch (format) {
	case LAS:
		return las_source_open_part(out, path, part, err);
	case PLY:
		return ply_points_open(out, path, part, err);
	case PCD:
		return pcd_points_open(out, path, POINTS_MOST_UNPACKED, part, err);
	case PTS:
		return text_points_open(out, path, TEXT_PTS, part, err);
	case PTX:
		return text_points_open(out, path, TEXT_PTX, part, err);
	case XYZ:
		return text_points_open(out, path, TEXT_XYZ, part, err);
	case E57:
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "%s: E57 is not supported; convert it with \"pdal translate IN.e57 OUT.las\", or with CloudCompare",
		                path);
	default:
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "%s: not a file of points that is known: LAS, PLY, PCD, PTS, PTX, or lines of numbers, x y z first; "
		                "\"pdal translate IN OUT.las\" converts many others",
		                path);
	}
}

static int go_back(void *userdata, struct psr_error *err)
{
	struct points *p = userdata;

	p->left_out = p->n_read = 0;
	return p->inner.rewind(p->inner.userdata, err);
}

/* Moves points without a finite place away; returns how many are left. */
static size_t sift(struct octree_point *points, size_t n)
{
	size_t to = 0;

	for (size_t i = 0; i < n; i++) {
		const double *at = points[i].at;

		if (!isfinite(at[0]) || !isfinite(at[1]) || !isfinite(at[2]))
			continue;
		if (to != i)
			points[to] = points[i];
		to++;
	}
	return to;
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct points *p = userdata;
	size_t got;
	int rc;

	do {
		rc = p->inner.read(&got, points, room, p->inner.userdata, err);
		if (rc != PSR_OK)
			return rc;
		*n = sift(points, got);
		p->n_read += *n;
		p->left_out += got - *n;
	} while (got > 0 && *n == 0);
	if (got == 0 && p->n_read == 0 && p->left_out == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: all of its points are marked as noise or withheld", p->inner.name);
	if (got == 0 && p->n_read == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: none of its %llu points has a finite place", p->inner.name,
		                (unsigned long long)p->left_out);
	return PSR_OK;
}

static void close_format(struct points *p)
{
	if (p->format == LAS)
		las_source_close(&p->inner);
	else if (p->format == PLY)
		ply_points_close(&p->inner);
	else if (p->format == PCD)
		pcd_points_close(&p->inner);
	else
		text_points_close(&p->inner);
}

int octree_source_open(struct octree_source *out, const char *path, struct psr_error *err)
{
	return octree_source_open_part(out, path, 0, err);
}

int octree_source_open_part(struct octree_source *out, const char *path, uint64_t part, struct psr_error *err)
{
	struct points *p = calloc(1, sizeof *p);
	int rc;

	*out = (struct octree_source){ .name = path };
	if (p == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read it", path);
	rc = find_format(&p->format, path, err);
	if (rc == PSR_OK)
		rc = open_format(&p->inner, path, p->format, part, err);
	if (rc != PSR_OK) {
		free(p);
		return rc;
	}
	*out = p->inner;
	out->rewind = go_back;
	out->read = read_points;
	out->userdata = p;
	return PSR_OK;
}

void octree_source_close(struct octree_source *source)
{
	struct points *p = source->userdata;

	if (p == NULL)
		return;
	close_format(p);
	free(p);
	source->userdata = NULL;
}

struct octree_source_count octree_source_count(const struct octree_source *source)
{
	const struct points *p = source->userdata;

	return (struct octree_source_count){ p->n_read, p->left_out };
}

int octree_source_suits(const char *path)
{
	struct octree_source ply;
	enum format format;
	int has_faces;

	if (find_format(&format, path, NULL) != PSR_OK || format == OTHER)
		return 0;
	if (format != PLY || ply_points_open(&ply, path, 0, NULL) != PSR_OK)
		return format != PLY;
	has_faces = ply_points_have_faces(&ply);
	ply_points_close(&ply);
	return !has_faces;
}

int octree_source_up(const struct octree_source *source, const double low[3], double edge)
{
	const struct points *p = source->userdata;
	const double high[3] = { low[0] + edge, low[1] + edge, low[2] + edge };

	return p->format != PLY || import_is_survey(low, high) ? 2 : 1;
}
