#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "import.h"

#define EMPTY UINT32_MAX

/* The triangle's points, rotated so that the least comes first, and its material. */
static void key_of(uint32_t key[4], const struct psr_mesh *mesh, const uint32_t *first_of, uint32_t t)
{
	uint32_t point[3];
	int least = 0;

	for (int c = 0; c < 3; c++) {
		point[c] = first_of[mesh->triangle[t][c]];
		if (point[c] < point[least])
			least = c;
	}
	for (int c = 0; c < 3; c++)
		key[c] = point[(least + c) % 3];
	key[3] = mesh->triangle_material[t];
}

int import_mesh_drop_duplicates(uint32_t *n_dropped, struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint64_t n_slots = 16;
	uint32_t *first_of, *slot, kept = 0;
	int rc = import_mesh_groups(&first_of, im, IMPORT_SAME_POSITION, err);

	if (rc != PSR_OK)
		return rc;
	while (n_slots < 2 * (uint64_t)mesh->n_triangles)
		n_slots *= 2;
	slot = malloc(n_slots * sizeof *slot);
	if (slot == NULL) {
		free(first_of);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to compare %u triangles", im->path, mesh->n_triangles);
	}
	memset(slot, 0xff, n_slots * sizeof *slot);
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		uint32_t key[4], other[4];
		uint64_t at;

		key_of(key, mesh, first_of, t);
		for (at = XXH64(key, sizeof key, 0) & (n_slots - 1); slot[at] != EMPTY; at = (at + 1) & (n_slots - 1)) {
			key_of(other, mesh, first_of, slot[at]);
			if (memcmp(key, other, sizeof key) == 0)
				break;
		}
		if (slot[at] != EMPTY)
			continue;
		slot[at] = kept;
		import_mesh_move_triangle(mesh, kept++, t);
	}
	*n_dropped = mesh->n_triangles - kept;
	mesh->n_triangles = kept;
	free(slot);
	free(first_of);
	return PSR_OK;
}
