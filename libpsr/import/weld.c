#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "import.h"

#define EMPTY UINT32_MAX
#define MAX_KEY 128

/* Part of the mesh's size, below anything visible: positions computed in single precision, such as the pole of a ball
 * from every side, differ by a few roundings. */
#define NEARLY 0x1p-22

struct keys {
	struct import_column column[IMPORT_MAX_COLUMNS];
	int n_columns;
	double low[3], step; /* step 0: exact positions */
};

/* Skips non-finite positions, which repair.c drops later. */
static void find_step(struct keys *keys, const struct psr_mesh *mesh)
{
	double most = 0;

	for (int c = 0; c < 3; c++) {
		double low = INFINITY, high = -INFINITY;

		for (uint32_t v = 0; v < mesh->n_vertices; v++) {
			if (!isfinite(mesh->position[v][c]))
				continue;
			low = fmin(low, mesh->position[v][c]);
			high = fmax(high, mesh->position[v][c]);
		}
		keys->low[c] = low;
		most = fmax(most, high - low);
	}
	keys->step = isfinite(most) ? NEARLY * most : 0;
}

/* Makes the bytes that equal vertices have in common. Adding 0 turns -0 into 0. */
static size_t key_of(const struct keys *keys, uint32_t v, uint8_t key[MAX_KEY])
{
	double position[3];
	size_t n = sizeof position;

	memcpy(position, import_column_at(&keys->column[0], v), sizeof position);
	for (int c = 0; c < 3; c++) {
		if (keys->step > 0)
			position[c] = rint((position[c] - keys->low[c]) / keys->step);
		position[c] += 0.0;
	}
	memcpy(key, position, n);
	for (int i = 1; i < keys->n_columns; i++) {
		memcpy(key + n, import_column_at(&keys->column[i], v), keys->column[i].size);
		n += keys->column[i].size;
	}
	return n;
}

int import_mesh_groups(uint32_t **first_of, const struct import_mesh *im, enum import_same same,
                       struct psr_error *err)
{
	const struct psr_mesh *mesh = im->mesh;
	struct keys keys = { .step = 0 };
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
	keys.n_columns = import_vertex_columns(keys.column, im->mesh);
	if (same != IMPORT_SAME_ALL)
		keys.n_columns = 1;
	if (same == IMPORT_SAME_NEARLY)
		find_step(&keys, mesh);
	memset(slot, 0xff, n_slots * sizeof *slot);
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		uint8_t key[MAX_KEY], other[MAX_KEY];
		size_t n = key_of(&keys, v, key);
		uint64_t at = XXH64(key, n, 0) & mask;

		while (slot[at] != EMPTY) {
			key_of(&keys, slot[at], other);
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
	int rc = import_mesh_groups(&first, im, IMPORT_SAME_ALL, err);

	if (rc != PSR_OK)
		return rc;
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			mesh->triangle[t][c] = first[mesh->triangle[t][c]];
	free(first);
	return PSR_OK;
}
