#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "peer.h"
#include "report.h"

struct corner {
	uint32_t cell, vertex;
};

static int compare(const void *a, const void *b)
{
	const struct corner *x = a, *y = b;

	if (x->cell != y->cell)
		return x->cell < y->cell ? -1 : 1;
	return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

static uint32_t cell_of(const float p[3], uint32_t cells)
{
	uint32_t cell = 0;

	for (int c = 0; c < 3; c++)
		cell = cell * cells + (uint32_t)((p[c] + 1.1f) / 2.2f * (float)cells);
	return cell;
}

/* Puts the mean of n vertices into the mesh. Where their normals cancel out it has the first one's. */
static void put_mean(struct peer_mesh *out, const struct peer_mesh *of, const struct corner *corner, uint32_t n)
{
	float place[3] = { 0, 0, 0 }, normal[3] = { 0, 0, 0 };

	for (uint32_t i = 0; i < n; i++) {
		v3f_add(place, place, of->position[corner[i].vertex]);
		v3f_add(normal, normal, of->normal[corner[i].vertex]);
	}
	v3f_scale(out->position[out->n_vertices], place, 1 / (float)n);
	if (v3f_dot(normal, normal) > 0)
		v3f_normalize(out->normal[out->n_vertices], normal);
	else
		memcpy(out->normal[out->n_vertices], of->normal[corner->vertex], sizeof normal);
	out->n_vertices++;
}

void peer_mesh_merge(struct peer_mesh *out, const struct peer_mesh *of, uint32_t cells)
{
	struct corner *corner = report_alloc(of->n_vertices, sizeof *corner);
	uint32_t *merged = report_alloc(of->n_vertices, sizeof *merged);

	*out = (struct peer_mesh){ .n_looks = of->n_looks };
	out->position = report_alloc(of->n_vertices, sizeof *out->position);
	out->normal = report_alloc(of->n_vertices, sizeof *out->normal);
	out->triangle = report_alloc(of->n_triangles, sizeof *out->triangle);
	out->triangle_look = report_alloc(of->n_triangles, sizeof *out->triangle_look);
	out->look = report_alloc(of->n_looks, sizeof *out->look);
	memcpy(out->look, of->look, of->n_looks * sizeof *out->look);
	for (uint32_t v = 0; v < of->n_vertices; v++)
		corner[v] = (struct corner){ cell_of(of->position[v], cells), v };
	qsort(corner, of->n_vertices, sizeof *corner, compare);
	for (uint32_t first = 0, n; first < of->n_vertices; first += n) {
		for (n = 0; first + n < of->n_vertices && corner[first + n].cell == corner[first].cell; n++)
			merged[corner[first + n].vertex] = out->n_vertices;
		put_mean(out, of, corner + first, n);
	}
	for (uint32_t t = 0; t < of->n_triangles; t++) {
		const uint32_t *from = of->triangle[t];
		const uint32_t v[3] = { merged[from[0]], merged[from[1]], merged[from[2]] };

		if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
			continue;
		out->triangle_look[out->n_triangles] = of->triangle_look[t];
		memcpy(out->triangle[out->n_triangles++], v, sizeof v);
	}
	peer_mesh_order(out);
	free(corner);
	free(merged);
}
