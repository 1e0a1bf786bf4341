#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include "of_mesh.h"
#include "base/mem.h"
#include "base/vec.h"

#define NONE UINT32_MAX
/* Steps of places in the mesh's extent: far finer than floats, but a sine of 2 pi is 0. */
#define STEPS 0x1p40

/* What a part of the surface sums up to. */
struct part {
	double volume; /* times six */
	uint64_t rim;  /* of hashes of sides, those of one direction less those of the other: 0 where all go both ways */
	uint8_t is_one_sided;
};

struct sides {
	const struct psr_mesh *mesh;
	uint32_t *above, *slot; /* above: of vertices that hang together */
	uint32_t *place;        /* the first vertex at a vertex's place */
	uint64_t n_slots;
	double low[3], scale;   /* of places, in steps */
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

static void find_extent(struct sides *s)
{
	double extent = 0;

	for (int c = 0; c < 3; c++) {
		double high = -INFINITY;

		s->low[c] = INFINITY;
		for (uint32_t v = 0; v < s->mesh->n_vertices; v++) {
			s->low[c] = fmin(s->low[c], s->mesh->position[v][c]);
			high = fmax(high, s->mesh->position[v][c]);
		}
		extent = fmax(extent, high - s->low[c]);
	}
	s->scale = extent > 0 ? STEPS / extent : 0;
}

static void find_step(int64_t step[3], const struct sides *s, uint32_t v)
{
	for (int c = 0; c < 3; c++)
		step[c] = (int64_t)((s->mesh->position[v][c] - s->low[c]) * s->scale + 0.5);
}

/* Joins vertices at one place. */
static void join_places(struct sides *s)
{
	for (uint32_t v = 0; v < s->mesh->n_vertices; v++) {
		int64_t p[3], q[3];

		find_step(p, s, v);
		uint64_t at = XXH64(p, sizeof p, 0) & (s->n_slots - 1);
		s->above[v] = v;
		while (s->slot[at] != NONE) {
			find_step(q, s, s->slot[at]);
			if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2])
				break;
			at = (at + 1) & (s->n_slots - 1);
		}
		if (s->slot[at] == NONE)
			s->slot[at] = v;
		else
			join(s->above, v, s->slot[at]);
		s->place[v] = s->slot[at];
	}
}

static uint64_t hash_side(uint32_t a, uint32_t b)
{
	const uint32_t key[2] = { a < b ? a : b, a < b ? b : a };
	const uint64_t hash = XXH64(key, sizeof key, 0);

	return a < b ? hash : a > b ? -hash : 0;
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
	part->volume += v3d_dot(p[0], n);
	for (int i = 0; i < 3; i++)
		part->rim += hash_side(s->place[index[i]], s->place[index[(i + 1) % 3]]);
	part->is_one_sided |= !mesh->material[mesh->triangle_material[t]].two_sided;
}

int octree_mesh_sides(uint8_t **is_turned, int *is_closed, const struct psr_mesh *mesh)
{
	struct sides s = { .mesh = mesh, .n_slots = 16 };

	while (s.n_slots < 2 * (uint64_t)mesh->n_vertices)
		s.n_slots *= 2;
	s.above = psr_alloc_array(mesh->n_vertices, sizeof *s.above);
	s.slot = psr_alloc_array(s.n_slots, sizeof *s.slot);
	s.place = psr_alloc_array(mesh->n_vertices, sizeof *s.place);
	s.part = calloc(mesh->n_vertices, sizeof *s.part);
	*is_turned = malloc(mesh->n_triangles);
	if (s.above != NULL && s.slot != NULL && s.place != NULL && s.part != NULL && *is_turned != NULL) {
		memset(s.slot, 0xff, s.n_slots * sizeof *s.slot);
		find_extent(&s);
		join_places(&s);
		for (uint32_t t = 0; t < mesh->n_triangles; t++)
			for (int i = 1; i < 3; i++)
				join(s.above, mesh->triangle[t][0], mesh->triangle[t][i]);
		for (uint32_t t = 0; t < mesh->n_triangles; t++)
			add_triangle(&s, t);
		*is_closed = 1;
		for (uint32_t t = 0; t < mesh->n_triangles; t++) {
			const struct part *part = &s.part[find(s.above, mesh->triangle[t][0])];

			*is_closed &= part->rim == 0;
			(*is_turned)[t] = !part->is_one_sided && part->volume < 0.0 && part->rim == 0;
		}
	} else {
		free(*is_turned);
		*is_turned = NULL;
	}
	psr_free(s.above);
	psr_free(s.slot);
	psr_free(s.place);
	free(s.part);
	return *is_turned != NULL ? PSR_OK : PSR_ERR_MEMORY;
}
