#include <assert.h>
#include <liblzf/lzf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "pcd.h"

#define SIZES 8        /* bytes of compressed points before them: sizes */
#define MOST_GROWTH 88 /* three bytes of LZF become at most 264 */

enum role { X, Y, Z, NORMAL_X, NORMAL_Y, NORMAL_Z, RGB, INTENSITY, ROLES };

struct points {
	const struct pcd *pcd;
	const struct pcd_field *field[ROLES]; /* NULL: none */
	const uint8_t *at, *end; /* binary: of all points; text: of the values left */
	uint8_t *owned;          /* unpacked points, or NULL */
	locale_t locale;
};

/* A point's values; `rgb` has red in bits 16 to 23. */
struct point {
	double value[ROLES];
	uint32_t rgb;
};

static uint64_t get(const uint8_t *p, unsigned n)
{
	uint64_t x = 0;

	for (unsigned i = 0; i < n; i++)
		x |= (uint64_t)p[i] << 8 * i;
	return x;
}

static uint32_t bits_of(float x)
{
	uint32_t bits;

	memcpy(&bits, &x, sizeof bits);
	return bits;
}

static double number_of(uint64_t bits, const struct pcd_field *f)
{
	const uint32_t low = (uint32_t)bits;
	float single;
	double x;

	if (f->type == 'U')
		return (double)bits;
	if (f->type == 'I')
		return (double)((int64_t)(bits << (64 - 8 * f->size)) >> (64 - 8 * f->size));
	memcpy(&single, &low, sizeof single);
	memcpy(&x, &bits, sizeof x);
	return f->size == 4 ? (double)single : x;
}

/* The bits that stand for a colour in text: of a float, or of an integer of either sign. */
static uint32_t bits_of_text(double x, const struct pcd_field *f)
{
	if (f->type == 'F')
		return bits_of((float)x);
	return x > -0x1p31 && x < 0x1p32 ? (uint32_t)(int64_t)x : 0;
}

static const struct pcd_field *find_single(const struct pcd *pcd, const char *name)
{
	const struct pcd_field *f = pcd_find(pcd, name);

	return f != NULL && f->count == 1 ? f : NULL;
}

static int find_fields(struct points *points, struct psr_error *err)
{
	static const char *const names[ROLES] = { "x", "y", "z", "normal_x", "normal_y", "normal_z", "rgb", "intensity" };
	const struct pcd_field **f = points->field;

	for (int i = 0; i < ROLES; i++)
		f[i] = find_single(points->pcd, names[i]);
	for (int i = X; i <= Z; i++)
		if (f[i] == NULL)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: no field %s of one value a point", points->pcd->path, names[i]);
	if (f[NORMAL_X] == NULL || f[NORMAL_Y] == NULL || f[NORMAL_Z] == NULL)
		f[NORMAL_X] = f[NORMAL_Y] = f[NORMAL_Z] = NULL;
	if (f[RGB] == NULL)
		f[RGB] = find_single(points->pcd, "rgba");
	if (f[RGB] != NULL && f[RGB]->size != 4)
		f[RGB] = NULL;
	if (f[RGB] != NULL)
		f[INTENSITY] = NULL;
	return PSR_OK;
}

/* Unpacks LZF: the values of a field for all points, then those of the next field. */
static int unpack(struct points *points, struct psr_error *err)
{
	const struct pcd *pcd = points->pcd;
	const uint64_t left = pcd->n_bytes - pcd->body, size = pcd->n_points * pcd->record;
	const uint8_t *from = pcd->bytes + pcd->body;

	if (left < SIZES || get(from, 4) > left - SIZES)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the compressed points are cut short", pcd->path);
	const uint64_t packed = get(from, 4);
	if (get(from + 4, 4) != size || size > MOST_GROWTH * packed)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: %llu points take %llu bytes, but %llu compressed bytes promise %llu", pcd->path,
		                (unsigned long long)pcd->n_points, (unsigned long long)size, (unsigned long long)packed,
		                (unsigned long long)get(from + 4, 4));
	points->owned = malloc(size);
	if (points->owned == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %llu points", pcd->path,
		                (unsigned long long)pcd->n_points);
	if (lzf_decompress(from + SIZES, (unsigned)packed, points->owned, (unsigned)size) != size)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the compressed points are damaged", pcd->path);
	points->at = points->owned;
	points->end = points->owned + size;
	return PSR_OK;
}

static void get_point(struct point *to, const struct points *points, uint64_t i)
{
	const struct pcd *pcd = points->pcd;

	for (int r = 0; r < ROLES; r++) {
		const struct pcd_field *f = points->field[r];

		if (f == NULL)
			continue;
		const uint8_t *at = points->at + (pcd->data == PCD_COMPRESSED ? f->offset * pcd->n_points + i * f->size
		                                                              : i * pcd->record + f->offset);
		const uint64_t bits = get(at, f->size);
		to->value[r] = number_of(bits, f);
		if (r == RGB)
			to->rgb = (uint32_t)bits;
	}
}

static int is_space(uint8_t c)
{
	return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Reads the next point's words. Returns 0 if one is missing, or is not a number where one is needed. */
static int parse_point(struct point *to, struct points *points)
{
	for (uint64_t column = 0; column < points->pcd->columns; column++) {
		while (points->at < points->end && is_space(*points->at))
			points->at++;
		const uint8_t *word = points->at;

		while (points->at < points->end && !is_space(*points->at))
			points->at++;
		if (points->at == word)
			return 0;
		for (int r = 0; r < ROLES; r++) {
			const struct pcd_field *f = points->field[r];

			if (f == NULL || f->column != column)
				continue;
			if (!import_number(&to->value[r], word, (size_t)(points->at - word), points->locale))
				return 0;
			if (r == RGB)
				to->rgb = bits_of_text(to->value[r], f);
		}
	}
	return 1;
}

/* Leaves intensities as they are. */
static void put_point(struct psr_mesh *mesh, uint32_t at, const struct point *point, const struct points *points)
{
	for (int c = 0; c < 3; c++)
		mesh->point[at][c] = point->value[c];
	for (int c = 0; points->field[NORMAL_X] != NULL && c < 3; c++)
		mesh->point_normal[at][c] = (float)point->value[NORMAL_X + c];
	for (int c = 0; points->field[RGB] != NULL && c < 3; c++)
		mesh->point_color[at][c] = cloud_linear((double)(point->rgb >> (16 - 8 * c) & 255));
	if (points->field[INTENSITY] != NULL)
		mesh->point_color[at][0] = (float)point->value[INTENSITY];
}

/* Turns intensities into grey. */
static int make_gray(struct psr_mesh *mesh, uint32_t first, const char *path, struct psr_error *err)
{
	uint64_t *histogram = calloc(CLOUD_BINS, sizeof *histogram);
	float most = 0;

	if (histogram == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a histogram", path);
	for (uint32_t i = first; i < mesh->n_points; i++) {
		const float x = mesh->point_color[i][0];

		most = isfinite(x) && x > most ? x : most;
	}
	for (uint32_t i = first; i < mesh->n_points; i++) {
		const float x = mesh->point_color[i][0];

		if (isfinite(x))
			histogram[x > 0 ? (uint32_t)((double)x / (double)most * (CLOUD_BINS - 1)) : 0]++;
	}
	const double white = (double)most * cloud_white(histogram) / (CLOUD_BINS - 1);
	for (uint32_t i = first; i < mesh->n_points; i++) {
		const double x = (double)mesh->point_color[i][0] / white;
		const float gray = !(white > 0) ? IMPORT_GRAY : !(x > 0) ? 0 : x < 1 ? (float)x : 1;

		for (int c = 0; c < 3; c++)
			mesh->point_color[i][c] = gray;
	}
	free(histogram);
	return PSR_OK;
}

static int add_points(struct import_mesh *im, struct points *points, struct psr_error *err)
{
	const struct pcd *pcd = points->pcd;
	const int has_color = points->field[RGB] != NULL || points->field[INTENSITY] != NULL;
	struct psr_mesh *mesh = im->mesh;
	const uint32_t first = mesh->n_points;
	struct psr_material material;
	int rc;

	psr_material_default(&material);
	material.two_sided = 1;
	for (int c = 0; c < 3 && !has_color; c++)
		material.base_color[c] = IMPORT_GRAY;
	rc = import_mesh_add_material(im, &material, err);
	if (rc < 0)
		return rc;
	assert(rc == 0); /* all points have material 0 */
	rc = import_mesh_grow_points(im, pcd->n_points, has_color, err);
	if (rc != PSR_OK)
		return rc;
	for (uint64_t i = 0; i < pcd->n_points; i++) {
		struct point point = { .rgb = 0 };

		if (pcd->data != PCD_ASCII)
			get_point(&point, points, i);
		else if (!parse_point(&point, points))
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: point %llu of %llu, below line %u: expected %llu numbers; is the file cut short?",
			                pcd->path, (unsigned long long)i + 1, (unsigned long long)pcd->n_points, pcd->data_line,
			                (unsigned long long)pcd->columns);
		put_point(mesh, first + (uint32_t)i, &point, points);
	}
	return points->field[INTENSITY] != NULL ? make_gray(mesh, first, pcd->path, err) : PSR_OK;
}

static int read_points(struct import_mesh *im, const struct pcd *pcd, struct psr_error *err)
{
	struct points points = { .pcd = pcd, .at = pcd->bytes + pcd->body, .end = pcd->bytes + pcd->n_bytes };
	int rc = find_fields(&points, err);

	if (rc == PSR_OK && pcd->data == PCD_COMPRESSED)
		rc = unpack(&points, err);
	if (rc == PSR_OK) {
		points.locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
		if (points.locale == (locale_t)0)
			rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a locale", pcd->path);
	}
	if (rc == PSR_OK) {
		rc = add_points(im, &points, err);
		freelocale(points.locale);
	}
	free(points.owned);
	return rc;
}

int import_pcd(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct pcd *pcd = calloc(1, sizeof *pcd);
	int rc;

	if (pcd == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a header", im->path);
	pcd->path = im->path;
	pcd->bytes = bytes;
	pcd->n_bytes = n_bytes;
	rc = pcd_header_read(pcd, err);
	if (rc == PSR_OK)
		rc = read_points(im, pcd, err);
	if (rc == PSR_OK && pcd->has_viewpoint)
		import_mesh_warn(im, "the viewpoint is left aside: points stay where the file has them");
	free(pcd);
	return rc;
}
