#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "cloud.h"

#define MAX_HEADER 375 /* bytes, of version 1.4 */
#define LEAST_HEADER 227
#define VLR_HEADER 54
#define FORMATS 11

/* LAS 1.2 to 1.4 in the terms of the ASPRS specifications. */
struct las {
	const char *path;
	const uint8_t *bytes;
	uint64_t n_bytes, first, n_points; /* first: the offset of the points */
	unsigned minor, format, record;    /* record: bytes of a point */
	double scale[3], offset[3];
};

/* Bytes of a point of each format, and the offset of its color; 0: none. */
static const struct {
	uint8_t size, color;
} formats[FORMATS] = {
	{ 20, 0 }, { 28, 0 }, { 26, 20 }, { 34, 28 }, { 57, 0 }, { 63, 28 }, { 30, 0 }, { 36, 30 }, { 38, 30 }, { 59, 0 },
	{ 67, 30 },
};

static uint64_t get(const uint8_t *p, int n)
{
	uint64_t x = 0;
	for (int i = 0; i < n; i++)
		x |= (uint64_t)p[i] << 8 * i;
	return x;
}

static double get_double(const uint8_t *p)
{
	uint64_t bits = get(p, 8);
	double x;
	memcpy(&x, &bits, sizeof x);
	return x;
}

static int refuse_laz(const struct las *las, struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_UNSUPPORTED,
	                "%s: compressed (LAZ); unpack it with \"laszip -i IN.laz -o OUT.las\", with las2las, or with "
	                "\"pdal translate IN.laz OUT.las\"",
	                las->path);
}

static int read_numbers(struct las *las, struct psr_error *err)
{
	const uint8_t *b = las->bytes;
	for (int c = 0; c < 3; c++) {
		las->scale[c] = get_double(b + 131 + 8 * c);
		las->offset[c] = get_double(b + 155 + 8 * c);
		if (!isfinite(las->scale[c]) || las->scale[c] == 0.0 || !isfinite(las->offset[c]))
			return psr_fail(err, PSR_ERR_FORMAT, "%s: the LAS header's scale or offset of %c is zero or not finite",
			                las->path, "xyz"[c]);
	}
	return PSR_OK;
}

/* Checks the variable length records between header and points; *is_laz: one is LASzip's. */
static int check_records(const struct las *las, uint64_t header, uint32_t n, int *is_laz, struct psr_error *err)
{
	uint64_t at = header;
	*is_laz = 0;
	for (uint32_t i = 0; i < n; i++) {
		uint64_t length;
		if (las->first - at < VLR_HEADER)
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: the LAS header promises %u variable length records, but there is room for only %u "
			                "before the points",
			                las->path, n, i);
		length = get(las->bytes + at + 20, 2);
		if (memcmp(las->bytes + at + 2, "laszip encoded", 14) == 0)
			*is_laz = 1;
		at += VLR_HEADER;
		if (length > las->first - at)
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: variable length record %u, of %llu bytes, reaches into the points", las->path, i,
			                (unsigned long long)length);
		at += length;
	}
	return PSR_OK;
}

/* Since version 1.4 the count has 64 bits, and the old field may be 0. */
static uint64_t count_of(const struct las *las)
{
	uint64_t old = get(las->bytes + 107, 4), count = las->minor >= 4 ? get(las->bytes + 247, 8) : 0;
	return count > 0 ? count : old;
}

static int check_points(struct las *las, struct psr_error *err)
{
	uint64_t room;
	if (las->format >= FORMATS)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: LAS point format %u is not supported; 0 to 10 are", las->path,
		                las->format);
	if (las->record < formats[las->format].size)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: points of %u bytes, but point format %u takes %u", las->path,
		                las->record, las->format, formats[las->format].size);
	room = (las->n_bytes - las->first) / las->record;
	if (las->n_points > room)
		return psr_fail(
			err, PSR_ERR_FORMAT,
			"%s: the LAS header promises %llu points, but the file has room for only %llu; is it cut short?",
			las->path, (unsigned long long)las->n_points, (unsigned long long)room);
	if (las->n_points == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the LAS header promises no points", las->path);
	return PSR_OK;
}

static int read_header(struct las *las, struct psr_error *err)
{
	static const uint64_t least[] = { LEAST_HEADER, LEAST_HEADER, LEAST_HEADER, 235, MAX_HEADER };
	const uint8_t *b = las->bytes;
	uint64_t header;
	int rc, is_laz;
	if (las->n_bytes < 4 || memcmp(b, "LASF", 4) != 0)
		return import_path_ends_with(las->path, ".laz") ? refuse_laz(las, err)
		                                    : psr_fail(err, PSR_ERR_FORMAT, "%s: does not begin with LASF", las->path);
	if (las->n_bytes < LEAST_HEADER)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the LAS header is cut short after %llu of %d bytes", las->path,
		                (unsigned long long)las->n_bytes, LEAST_HEADER);
	las->minor = b[25];
	if (b[24] != 1 || las->minor > 4)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: LAS version %u.%u is not supported; 1.0 to 1.4 are", las->path,
		                b[24], las->minor);
	header = get(b + 94, 2);
	las->first = get(b + 96, 4);
	las->format = b[104] & 0x3f;
	las->record = (unsigned)get(b + 105, 2);
	if (header < least[las->minor] || header > las->first || las->first > las->n_bytes)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: a LAS header of %llu bytes and points from byte %llu on do not fit a version 1.%u file of "
		                "%llu bytes",
		                las->path, (unsigned long long)header, (unsigned long long)las->first, las->minor,
		                (unsigned long long)las->n_bytes);
	rc = check_records(las, header, (uint32_t)get(b + 100, 4), &is_laz, err);
	if (rc != PSR_OK)
		return rc;
	if ((b[104] & 0xc0) != 0 || is_laz)
		return refuse_laz(las, err);
	las->n_points = count_of(las);
	rc = read_numbers(las, err);
	return rc == PSR_OK ? check_points(las, err) : rc;
}

static const uint8_t *point_of(const struct las *las, uint64_t i)
{
	return las->bytes + las->first + i * las->record;
}

/* Points classified as low or high noise, or marked as withheld. */
static int is_left_out(const struct las *las, const uint8_t *p)
{
	const int is_new = las->format >= 6, class = is_new ? p[16] : p[15] & 31;
	return class == 7 || class == 18 || (is_new ? p[15] & 4 : p[15] & 0x80) != 0;
}

/* Finds the colours of points: their own, of 16 bits or of 8 in 16, or intensity. */
struct tint {
	unsigned color;     /* its offset in a point; 0: intensity */
	double scale;       /* to codes of 0..255, or of intensity to linear light */
	int is_none;
};

static int find_tint(struct tint *tint, const struct las *las, struct psr_error *err)
{
	uint64_t *histogram = calloc(CLOUD_BINS, sizeof *histogram), most = 0;
	double white;
	if (histogram == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a histogram", las->path);
	tint->color = formats[las->format].color;
	for (uint64_t i = 0; i < las->n_points; i++) {
		const uint8_t *p = point_of(las, i);
		for (int c = 0; tint->color > 0 && c < 3; c++)
			most = get(p + tint->color + 2 * c, 2) > most ? get(p + tint->color + 2 * c, 2) : most;
		if (!is_left_out(las, p))
			histogram[get(p + 12, 2)]++;
	}
	white = cloud_white(histogram);
	free(histogram);
	if (most == 0)
		tint->color = 0;
	tint->is_none = tint->color == 0 && white == 0.0;
	tint->scale = tint->color == 0 ? 1.0 / white : most > 255 ? 255.0 / 65535.0 : 1.0;
	return PSR_OK;
}

static void put_color(float out[4], const struct tint *tint, const uint8_t *p)
{
	double gray = (double)get(p + 12, 2) * tint->scale;
	for (int c = 0; c < 3; c++)
		out[c] = tint->color > 0 ? cloud_linear((double)get(p + tint->color + 2 * c, 2) * tint->scale)
		                         : (float)(gray < 1.0 ? gray : 1.0);
}

static int add_points(struct import_mesh *im, const struct las *las, const struct tint *tint, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint64_t n_kept = 0;
	uint32_t to;
	int rc;
	for (uint64_t i = 0; i < las->n_points; i++)
		n_kept += !is_left_out(las, point_of(las, i));
	to = mesh->n_points;
	rc = import_mesh_grow_points(im, n_kept, !tint->is_none, err);
	if (rc != PSR_OK)
		return rc;
	for (uint64_t i = 0; i < las->n_points; i++) {
		const uint8_t *p = point_of(las, i);
		if (is_left_out(las, p))
			continue;
		for (int c = 0; c < 3; c++)
			mesh->point[to][c] = (double)(int32_t)(uint32_t)get(p + 4 * c, 4) * las->scale[c] + las->offset[c];
		if (!tint->is_none)
			put_color(mesh->point_color[to], tint, p);
		to++;
	}
	if (n_kept < las->n_points) {
		mesh->n_dropped_primitives += (uint32_t)(las->n_points - n_kept);
		import_mesh_warn(im, "points classified as noise or withheld were left out: %llu",
		                 (unsigned long long)(las->n_points - n_kept));
	}
	return PSR_OK;
}

int import_las(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct las las = { .path = im->path, .bytes = bytes, .n_bytes = n_bytes };
	struct psr_material material;
	struct tint tint = { 0, 0.0, 0 };
	int rc = read_header(&las, err);
	if (rc == PSR_OK)
		rc = find_tint(&tint, &las, err);
	if (rc != PSR_OK)
		return rc;
	psr_material_default(&material);
	material.two_sided = 1;
	for (int c = 0; c < 3 && tint.is_none; c++)
		material.base_color[c] = IMPORT_GRAY;
	rc = import_mesh_add_material(im, &material, err);
	if (rc < 0)
		return rc;
	assert(rc == 0); /* all points have material 0 */
	return add_points(im, &las, &tint, err);
}
