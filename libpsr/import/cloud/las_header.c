#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "las.h"

#define MAX_HEADER 375 /* bytes, of version 1.4 */
#define LEAST_HEADER 227
#define VLR_HEADER 54
#define FORMATS 11

/* Bytes of a point of each format, and the offset of its color; 0: none. */
static const struct {
	uint8_t size, color;
} formats[FORMATS] = {
	{ 20, 0 }, { 28, 0 }, { 26, 20 }, { 34, 28 }, { 57, 0 }, { 63, 28 }, { 30, 0 }, { 36, 30 }, { 38, 30 }, { 59, 0 },
	{ 67, 30 },
};

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
		las->scale[c] = las_get_double(b + 131 + 8 * c);
		las->offset[c] = las_get_double(b + 155 + 8 * c);
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
		length = las_get(las->bytes + at + 20, 2);
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
	uint64_t old = las_get(las->bytes + 107, 4), count = las->minor >= 4 ? las_get(las->bytes + 247, 8) : 0;
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

int las_read_header(struct las *las, struct psr_error *err)
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
	header = las_get(b + 94, 2);
	las->first = las_get(b + 96, 4);
	las->format = b[104] & 0x3f;
	las->record = (unsigned)las_get(b + 105, 2);
	if (header < least[las->minor] || header > las->first || las->first > las->n_bytes)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: a LAS header of %llu bytes and points from byte %llu on do not fit a version 1.%u file of "
		                "%llu bytes",
		                las->path, (unsigned long long)header, (unsigned long long)las->first, las->minor,
		                (unsigned long long)las->n_bytes);
	rc = check_records(las, header, (uint32_t)las_get(b + 100, 4), &is_laz, err);
	if (rc != PSR_OK)
		return rc;
	if ((b[104] & 0xc0) != 0 || is_laz)
		return refuse_laz(las, err);
	las->n_points = count_of(las);
	rc = read_numbers(las, err);
	return rc == PSR_OK ? check_points(las, err) : rc;
}

int las_is_left_out(const struct las *las, const uint8_t *p)
{
	const int is_new = las->format >= 6, class = is_new ? p[16] : p[15] & 31;

	return class == 7 || class == 18 || (is_new ? p[15] & 4 : p[15] & 0x80) != 0;
}

int las_tint_begin(struct las_tint *tint, const struct las *las, struct psr_error *err)
{
	*tint = (struct las_tint){ .color = formats[las->format].color };
	tint->histogram = calloc(CLOUD_BINS, sizeof *tint->histogram);
	return tint->histogram != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a histogram", las->path);
}

void las_tint_note(struct las_tint *tint, const struct las *las, const uint8_t *p)
{
	for (int c = 0; tint->color > 0 && c < 3; c++)
		tint->most = las_get(p + tint->color + 2 * c, 2) > tint->most ? las_get(p + tint->color + 2 * c, 2) : tint->most;
	if (!las_is_left_out(las, p))
		tint->histogram[las_get(p + 12, 2)]++;
}

void las_tint_end(struct las_tint *tint)
{
	const double white = cloud_white(tint->histogram);

	free(tint->histogram);
	tint->histogram = NULL;
	if (tint->most == 0)
		tint->color = 0;
	tint->is_none = tint->color == 0 && white == 0.0;
	tint->scale = tint->color == 0 ? 1.0 / white : tint->most > 255 ? 255.0 / 65535.0 : 1.0;
}
