#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "import.h"

#define EMPTY UINT32_MAX
#define MAX_KEY 128

/* What makes vertices the same: the position, or everything. Adding 0 makes one zero of the two. */
static size_t key_of(const struct import_column *column, int n_columns, uint32_t v, uint8_t key[MAX_KEY])
{
	double position[3];
	size_t n = sizeof position;

	memcpy(position, import_column_at(&column[0], v), sizeof position);
	for (int c = 0; c < 3; c++)
		position[c] += 0.0;
	memcpy(key, position, n);
	for (int i = 1; i < n_columns; i++) {
		memcpy(key + n, import_column_at(&column[i], v), column[i].size);
		n += column[i].size;
	}
	return n;
}

int import_mesh_groups(uint32_t **first_of, const struct import_mesh *im, int whole, struct psr_error *err)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	const struct psr_mesh *mesh = im->mesh;
	const int n_columns = import_vertex_columns(column, im->mesh);
	uint64_t n_slots = 16, mask;
	uint32_t *slot, *first;

	while (n_slots < 2 * (uint64_t)mesh->n_vertices)
		n_slots *= 2;
	mask = n_slots - 1;
	slot = malloc(n_slots * sizeof *slot);
	first = malloc(((size_t)mesh->n_vertices + 1) * sizeof *first);
	if (slot == NULL || first == NULL) {
		free(slot);
		free(first);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to join %u vertices", im->path, mesh->n_vertices);
	}
	memset(slot, 0xff, n_slots * sizeof *slot);
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		uint8_t key[MAX_KEY], other[MAX_KEY];
		size_t n = key_of(column, whole ? n_columns : 1, v, key);
		uint64_t at = XXH64(key, n, 0) & mask;

		while (slot[at] != EMPTY) {
			key_of(column, whole ? n_columns : 1, slot[at], other);
			if (memcmp(key, other, n) == 0)
				break;
			at = (at + 1) & mask;
		}
		if (slot[at] == EMPTY)
			slot[at] = v;
		first[v] = slot[at];
	}
	free(slot);
	*first_of = first;
	return PSR_OK;
}

int import_mesh_weld(struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint32_t *first;
	int rc = import_mesh_groups(&first, im, 1, err);

	if (rc != PSR_OK)
		return rc;
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			mesh->triangle[t][c] = first[mesh->triangle[t][c]];
	free(first);
	return PSR_OK;
}
