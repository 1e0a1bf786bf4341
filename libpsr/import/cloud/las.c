#include <assert.h>
#include "las.h"

static const uint8_t *point_of(const struct las *las, uint64_t i)
{
	return las->bytes + las->first + i * las->record;
}

static int find_tint(struct las_tint *tint, const struct las *las, struct psr_error *err)
{
	const int rc = las_tint_begin(tint, las, err);

	if (rc != PSR_OK)
		return rc;
	for (uint64_t i = 0; i < las->n_points; i++)
		las_tint_note(tint, las, point_of(las, i));
	las_tint_end(tint);
	return PSR_OK;
}

static void put_color(float out[4], const struct las_tint *tint, const uint8_t *p)
{
	double gray = (double)las_get(p + 12, 2) * tint->scale;
	for (int c = 0; c < 3; c++)
		out[c] = tint->color > 0 ? cloud_linear((double)las_get(p + tint->color + 2 * c, 2) * tint->scale)
		                         : (float)(gray < 1.0 ? gray : 1.0);
}

static int add_points(struct import_mesh *im, const struct las *las, const struct las_tint *tint, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint64_t n_kept = 0;
	uint32_t to;
	int rc;
	for (uint64_t i = 0; i < las->n_points; i++)
		n_kept += !las_is_left_out(las, point_of(las, i));
	to = mesh->n_points;
	rc = import_mesh_grow_points(im, n_kept, !tint->is_none, err);
	if (rc != PSR_OK)
		return rc;
	for (uint64_t i = 0; i < las->n_points; i++) {
		const uint8_t *p = point_of(las, i);
		if (las_is_left_out(las, p))
			continue;
		for (int c = 0; c < 3; c++)
			mesh->point[to][c] = (double)(int32_t)(uint32_t)las_get(p + 4 * c, 4) * las->scale[c] + las->offset[c];
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
	struct las_tint tint = { 0 };
	int rc = las_read_header(&las, err);
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
