#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "import/import.h"
#include "points.h"

#define ROOM 4096

static int append(struct import_mesh *im, const struct octree_point *point, size_t n, const struct octree_source *source,
                  struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	const uint32_t first = mesh->n_points;
	const int rc = import_mesh_grow_points(im, n, source->has_color, err);

	for (size_t i = 0; i < n && rc == PSR_OK; i++) {
		memcpy(mesh->point[first + i], point[i].at, sizeof point[i].at);
		memcpy(mesh->point_normal[first + i], point[i].normal, sizeof point[i].normal);
		for (int c = 0; c < 3 && source->has_color; c++)
			mesh->point_color[first + i][c] = psr_srgb_to_linear[point[i].color[c]];
	}
	return rc;
}

static int read_all(struct import_mesh *im, struct octree_source *source, struct psr_error *err)
{
	struct octree_point *point = malloc(ROOM * sizeof *point);
	int rc = point != NULL ? source->rewind(source->userdata, err) : psr_fail(err, PSR_ERR_MEMORY, "no memory for points");
	size_t n = 1;

	while (rc == PSR_OK && n > 0) {
		rc = source->read(&n, point, ROOM, source->userdata, err);
		if (rc == PSR_OK && n > 0)
			rc = append(im, point, n, source, err);
	}
	free(point);
	return rc;
}

int import_points(struct import_mesh *im, struct psr_error *err)
{
	struct octree_source source;
	struct psr_material material;
	uint64_t n_left_out;
	int rc = octree_source_open(&source, im->path, err);

	if (rc != PSR_OK)
		return rc;
	psr_material_default(&material);
	material.two_sided = 1;
	for (int c = 0; c < 3 && !source.has_color; c++)
		material.base_color[c] = IMPORT_GRAY;
	rc = import_mesh_add_material(im, &material, err);
	if (rc >= 0)
		rc = read_all(im, &source, err);
	n_left_out = octree_source_count(&source).n_left_out;
	if (rc == PSR_OK && n_left_out > 0) {
		import_mesh_warn(im, "points without a finite place were left out: %llu", (unsigned long long)n_left_out);
		im->mesh->n_dropped_primitives += (uint32_t)n_left_out;
	}
	octree_source_close(&source);
	return rc;
}
