#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "pcd_point.h"

struct points {
	const struct pcd *pcd;
	struct pcd_roles roles;
	const uint8_t *at, *end; /* binary: of all points; text: of the values left */
	uint8_t *owned;          /* unpacked points, or NULL */
	locale_t locale;
};

/* Leaves intensities as they are. */
static void put_point(struct psr_mesh *mesh, uint32_t at, const struct pcd_point *point,
                      const struct pcd_roles *roles)
{
	for (int c = 0; c < 3; c++)
		mesh->point[at][c] = point->value[c];
	for (int c = 0; roles->field[PCD_NORMAL_X] != NULL && c < 3; c++)
		mesh->point_normal[at][c] = (float)point->value[PCD_NORMAL_X + c];
	for (int c = 0; roles->field[PCD_RGB] != NULL && c < 3; c++)
		mesh->point_color[at][c] = cloud_linear((double)(point->rgb >> (16 - 8 * c) & 255));
	if (roles->field[PCD_INTENSITY] != NULL)
		mesh->point_color[at][0] = (float)point->value[PCD_INTENSITY];
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
	const int has_color = points->roles.field[PCD_RGB] != NULL || points->roles.field[PCD_INTENSITY] != NULL;
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
		struct pcd_point point;

		if (pcd->data != PCD_ASCII)
			pcd_point_get(&point, &points->roles, pcd, points->at, i);
		else if (!pcd_point_parse(&point, &points->roles, pcd, &points->at, points->end, points->locale))
			return psr_fail(err, PSR_ERR_FORMAT,
			                "%s: point %llu of %llu, below line %u: expected %llu numbers; is the file cut short?",
			                pcd->path, (unsigned long long)i + 1, (unsigned long long)pcd->n_points, pcd->data_line,
			                (unsigned long long)pcd->columns);
		put_point(mesh, first + (uint32_t)i, &point, &points->roles);
	}
	return points->roles.field[PCD_INTENSITY] != NULL ? make_gray(mesh, first, pcd->path, err) : PSR_OK;
}

static int unpack(struct points *points, struct psr_error *err)
{
	const struct pcd *pcd = points->pcd;
	const uint64_t left = pcd->n_bytes - pcd->body;
	uint64_t packed;
	int rc;

	if (left < PCD_SIZES)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the compressed points are cut short", pcd->path);
	rc = pcd_check_sizes(&packed, pcd, pcd->bytes + pcd->body, err);
	if (rc == PSR_OK)
		rc = pcd_unpack(&points->owned, pcd, pcd->bytes + pcd->body + PCD_SIZES, packed, err);
	points->at = points->owned;
	return rc;
}

static int read_points(struct import_mesh *im, const struct pcd *pcd, struct psr_error *err)
{
	struct points points = { .pcd = pcd, .at = pcd->bytes + pcd->body, .end = pcd->bytes + pcd->n_bytes };
	int rc = pcd_roles_find(&points.roles, pcd, err);

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
	pcd->n_bytes = pcd->n_there = n_bytes;
	pcd->most = IMPORT_MAX_POINTS;
	rc = pcd_header_read(pcd, err);
	if (rc == PSR_OK)
		rc = read_points(im, pcd, err);
	if (rc == PSR_OK && pcd->has_viewpoint)
		import_mesh_warn(im, "the viewpoint is left aside: points stay where the file has them");
	free(pcd);
	return rc;
}
