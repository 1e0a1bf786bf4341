#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "of_mesh.h"
#include "base/mem.h"
#include "base/vec.h"

#define NONE UINT32_MAX
/* Rims leave a sum of areas; rounding leaves some 2^-50 of each. */
#define CLOSED 1e-9

/* What a part of the surface sums up to. */
struct part {
	double area[3], volume, total; /* of vectors; times six; of lengths */
	uint8_t is_one_sided;
};

struct sides {
	const struct psr_mesh *mesh;
	uint32_t *above, *slot; /* above: of vertices that hang together */
	uint64_t n_slots;
	struct part *part;      /* at the vertex that stands for it */
};

static uint32_t find(uint32_t *above, uint32_t v)
{
	while (above[v] != v)
		v = above[v] = above[above[v]];
	return v;
}

static void join(uint32_t *above, uint32_t a, uint32_t b)
{
	a = find(above, a);
	b = find(above, b);
	above[a > b ? a : b] = a > b ? b : a;
}

/* Joins vertices at one place. Adding 0 turns -0 into 0. */
static void join_places(struct sides *s)
{
	for (uint32_t v = 0; v < s->mesh->n_vertices; v++) {
		const double *p = s->mesh->position[v];
		const double key[3] = { p[0] + 0.0, p[1] + 0.0, p[2] + 0.0 };
		uint64_t at = XXH64(key, sizeof key, 0) & (s->n_slots - 1);

		s->above[v] = v;
		while (s->slot[at] != NONE) {
			const double *q = s->mesh->position[s->slot[at]];

			if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2])
				break;
			at = (at + 1) & (s->n_slots - 1);
		}
		if (s->slot[at] == NONE)
			s->slot[at] = v;
		else
			join(s->above, v, s->slot[at]);
	}
}

/* Volumes are of pyramids up to the first vertex of the part. */
static void add_triangle(struct sides *s, uint32_t t)
{
	const struct psr_mesh *mesh = s->mesh;
	const uint32_t *index = mesh->triangle[t], root = find(s->above, index[0]);
	struct part *part = &s->part[root];
	double p[3][3], n[3];

	for (int i = 0; i < 3; i++)
		v3d_sub(p[i], mesh->position[index[i]], mesh->position[root]);
	v3d_sub(p[1], p[1], p[0]);
	v3d_sub(p[2], p[2], p[0]);
	v3d_cross(n, p[1], p[2]);
	v3d_add(part->area, part->area, n);
	part->volume += v3d_dot(p[0], n);
	part->total += v3d_length(n);
	part->is_one_sided |= !mesh->material[mesh->triangle_material[t]].two_sided;
}

static int is_closed_part(const struct part *part)
{
	return v3d_length(part->area) <= CLOSED * part->total;
}

int octree_mesh_sides(uint8_t **is_turned, int *is_closed, const struct psr_mesh *mesh)
{
	struct sides s = { .mesh = mesh, .n_slots = 16 };

	while (s.n_slots < 2 * (uint64_t)mesh->n_vertices)
		s.n_slots *= 2;
	s.above = psr_alloc_array(mesh->n_vertices, sizeof *s.above);
	s.slot = psr_alloc_array(s.n_slots, sizeof *s.slot);
	s.part = calloc(mesh->n_vertices, sizeof *s.part);
	*is_turned = malloc(mesh->n_triangles);
	if (s.above != NULL && s.slot != NULL && s.part != NULL && *is_turned != NULL) {
		memset(s.slot, 0xff, s.n_slots * sizeof *s.slot);
		join_places(&s);
		for (uint32_t t = 0; t < mesh->n_triangles; t++)
			for (int i = 1; i < 3; i++)
				join(s.above, mesh->triangle[t][0], mesh->triangle[t][i]);
		for (uint32_t t = 0; t < mesh->n_triangles; t++)
			add_triangle(&s, t);
		*is_closed = 1;
		for (uint32_t t = 0; t < mesh->n_triangles; t++) {
			const struct part *part = &s.part[find(s.above, mesh->triangle[t][0])];

			*is_closed &= is_closed_part(part);
			(*is_turned)[t] = !part->is_one_sided && part->volume < 0.0 && is_closed_part(part);
		}
	} else {
		free(*is_turned);
		*is_turned = NULL;
	}
	psr_free(s.above);
	psr_free(s.slot);
	free(s.part);
	return *is_turned != NULL ? PSR_OK : PSR_ERR_MEMORY;
}
