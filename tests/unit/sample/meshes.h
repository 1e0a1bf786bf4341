/* Small meshes for the tests of sampler and measures. Each is the caller's: meshes_free(). */
#ifndef TESTS_SAMPLE_MESHES_H
#define TESTS_SAMPLE_MESHES_H

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "psr/mesh.h"

static inline struct psr_mesh *meshes_new(uint32_t n_vertices, uint32_t n_triangles)
{
	struct psr_mesh *mesh = calloc(1, sizeof *mesh);

	mesh->n_vertices = n_vertices;
	mesh->n_triangles = n_triangles;
	mesh->n_materials = 1;
	mesh->position = calloc(n_vertices, sizeof *mesh->position);
	mesh->normal = calloc(n_vertices, sizeof *mesh->normal);
	mesh->triangle = calloc(n_triangles, sizeof *mesh->triangle);
	mesh->triangle_material = calloc(n_triangles, sizeof *mesh->triangle_material);
	mesh->material = calloc(1, sizeof *mesh->material);
	psr_material_default(mesh->material);
	return mesh;
}

static inline void meshes_free(struct psr_mesh *mesh)
{
	if (mesh == NULL)
		return;
	for (uint32_t i = 0; i < mesh->n_images; i++)
		free(mesh->image[i].rgba);
	free(mesh->image);
	free(mesh->position);
	free(mesh->normal);
	free(mesh->uv[0]);
	free(mesh->color);
	free(mesh->triangle);
	free(mesh->triangle_material);
	free(mesh->material);
	free(mesh);
}

/* Six squares of half side `half`, fronts outside; or five of them, without the one at +z. */
static inline struct psr_mesh *meshes_box(double half, int is_open)
{
	uint32_t n = is_open ? 5 : 6;
	struct psr_mesh *mesh = meshes_new(4 * n, 2 * n);

	for (uint32_t f = 0; f < n; f++) {
		int axis = (int)f / 2, sign = f % 2 == 0 ? -1 : 1; /* -x, +x, -y, +y, -z, and last +z */

		for (uint32_t c = 0; c < 4; c++) {
			double *p = mesh->position[4 * f + c];

			p[axis] = sign * half;
			p[(axis + 1) % 3] = (c == 1 || c == 2 ? 1 : -1) * half;
			p[(axis + 2) % 3] = (c >= 2 ? 1 : -1) * sign * half;
		}
		for (uint32_t t = 0; t < 2; t++) {
			mesh->triangle[2 * f + t][0] = 4 * f;
			mesh->triangle[2 * f + t][1] = 4 * f + 1 + t;
			mesh->triangle[2 * f + t][2] = 4 * f + 2 + t;
		}
	}
	return mesh;
}

/* A grid of 2 * n_u * n_v triangles, (n_u + 1) * (n_v + 1) vertices; front on the left of u cross v. */
static inline struct psr_mesh *meshes_grid(uint32_t n_u, uint32_t n_v)
{
	struct psr_mesh *mesh = meshes_new((n_u + 1) * (n_v + 1), 2 * n_u * n_v);

	for (uint32_t v = 0; v < n_v; v++) {
		for (uint32_t u = 0; u < n_u; u++) {
			uint32_t a = v * (n_u + 1) + u, *t = mesh->triangle[2 * (v * n_u + u)];

			t[0] = a;
			t[1] = a + 1;
			t[2] = a + n_u + 2;
			t[3] = a;
			t[4] = a + n_u + 2;
			t[5] = a + n_u + 1;
		}
	}
	return mesh;
}

/* The square -1..1 in x and y at z = 0, front towards +z; uv with v downwards. */
static inline struct psr_mesh *meshes_square(uint32_t n)
{
	struct psr_mesh *mesh = meshes_grid(n, n);

	mesh->uv[0] = calloc(mesh->n_vertices, sizeof *mesh->uv[0]);
	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		double u = (double)(i % (n + 1)) / n, v = (double)(i / (n + 1)) / n;

		mesh->position[i][0] = 2 * u - 1;
		mesh->position[i][1] = 2 * v - 1;
		mesh->normal[i][2] = 1;
		mesh->uv[0][i][0] = (float)u;
		mesh->uv[0][i][1] = (float)(1 - v);
	}
	return mesh;
}

static inline struct psr_mesh *meshes_sphere(uint32_t n, const double center[3], double radius)
{
	struct psr_mesh *mesh = meshes_grid(2 * n, n);

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		double a = 3.14159265358979323846 * (i % (2 * n + 1) % (2 * n)) / n;
		double b = 3.14159265358979323846 * ((double)(i / (2 * n + 1)) / n - 0.5);
		double p[3] = { cos(b) * cos(a), sin(b), -cos(b) * sin(a) };

		for (int k = 0; k < 3; k++) {
			mesh->position[i][k] = center[k] + radius * p[k];
			mesh->normal[i][k] = (float)p[k];
		}
	}
	return mesh;
}

/* One image of the given texels on the only material. */
static inline void meshes_texture(struct psr_mesh *mesh, uint32_t width, uint32_t height, const uint8_t *rgba)
{
	mesh->n_images = 1;
	mesh->image = calloc(1, sizeof *mesh->image);
	mesh->image->width = width;
	mesh->image->height = height;
	mesh->image->rgba = malloc((size_t)4 * width * height);
	memcpy(mesh->image->rgba, rgba, (size_t)4 * width * height);
	mesh->material->base_texture.image = 0;
}

/* xorshift64*, 0 <= x < 1 */
static inline double meshes_random(uint64_t *state)
{
	*state ^= *state >> 12;
	*state ^= *state << 25;
	*state ^= *state >> 27;
	return (double)(*state * UINT64_C(2685821657736338717) >> 11) * 0x1p-53;
}

#endif
