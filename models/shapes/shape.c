#include "shape.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"

const double shape_straight[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };

#define MAX_ROOM (1u << 26) /* elements; no generator comes near it */

void shape_init(struct shape *shape)
{
	memset(shape, 0, sizeof *shape);
	shape->n_parts = 1;
}

void shape_fini(struct shape *shape)
{
	free(shape->position);
	free(shape->normal);
	free(shape->uv);
	free(shape->triangle);
	free(shape->triangle_material);
	free(shape->triangle_part);
	free(shape->material);
	free(shape->instance);
	for (uint32_t i = 0; i < shape->n_images; i++)
		free(shape->image[i].rgb);
	shape_init(shape);
}

int shape_check(const struct shape *shape, struct psr_error *err)
{
	if (shape->failed)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the mesh");
	return PSR_OK;
}

/* Grows *array to `room` elements; on failure the old one stays valid. */
static int grow(struct shape *shape, void *array, uint32_t room, size_t size)
{
	void *old, *new;

	memcpy(&old, array, sizeof old);
	new = room > MAX_ROOM ? NULL : realloc(old, room * size);
	if (new == NULL) {
		shape->failed = 1;
		return 0;
	}
	memcpy(array, &new, sizeof new);
	return 1;
}

uint32_t shape_material(struct shape *shape, const struct shape_material *material)
{
	if (shape->n_materials == shape->material_room) {
		uint32_t room = shape->material_room * 2 + 8;

		if (shape->failed || !grow(shape, &shape->material, room, sizeof *shape->material))
			return 0;
		shape->material_room = room;
	}
	shape->material[shape->n_materials] = *material;
	shape->current = shape->n_materials;
	return shape->n_materials++;
}

void shape_materials(struct shape *shape, const struct shape_material *material, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++)
		shape_material(shape, &material[i]);
}

void shape_image(struct shape *shape, uint32_t material, uint32_t size, uint8_t *rgb)
{
	assert(shape->n_images < SHAPE_MAX_IMAGES);
	if (rgb == NULL)
		shape->failed = 1;
	else
		shape->image[shape->n_images++] = (struct shape_image){ material, size, rgb };
}

uint32_t shape_part(struct shape *shape)
{
	shape->current_part = shape->n_parts;
	return shape->n_parts++;
}

static double rounded(double x)
{
	return floor(x * 1e6 + 0.5) / 1e6 + 0.0;
}

void shape_place(struct shape *shape, uint32_t part, const double m[3][3], const double move[3])
{
	struct shape_instance *instance;

	assert(part < shape->n_parts);
	if (shape->n_instances == shape->instance_room) {
		uint32_t room = shape->instance_room * 2 + 64;

		if (shape->failed || !grow(shape, &shape->instance, room, sizeof *shape->instance))
			return;
		shape->instance_room = room;
	}
	instance = &shape->instance[shape->n_instances++];
	instance->part = part;
	for (int k = 0; k < 3; k++) {
		v3d_set(instance->m[k], rounded(m[k][0]), rounded(m[k][1]), rounded(m[k][2]));
		instance->move[k] = rounded(move[k]);
	}
}

static void set_vertex(struct shape *shape, uint32_t i, const double p[3], const double n[3])
{
	double unit[3];

	v3d_normalize(unit, n);
	for (int k = 0; k < 3; k++) {
		/* + 0 turns -0 into 0, so that equal places have equal bytes */
		shape->position[i][k] = (float)p[k] + 0.0f;
		shape->normal[i][k] = (float)unit[k] + 0.0f;
	}
}

uint32_t shape_vertex(struct shape *shape, const struct shape_vertex *vertex)
{
	if (shape->n_vertices == shape->vertex_room) {
		uint32_t room = shape->vertex_room * 2 + 1024;

		if (shape->failed || !grow(shape, &shape->position, room, sizeof *shape->position) ||
		    !grow(shape, &shape->normal, room, sizeof *shape->normal) ||
		    !grow(shape, &shape->uv, room, sizeof *shape->uv))
			return 0;
		shape->vertex_room = room;
	}
	set_vertex(shape, shape->n_vertices, vertex->p, vertex->n);
	shape->uv[shape->n_vertices][0] = shape->uv[shape->n_vertices][1] = 0;
	return shape->n_vertices++;
}

static int same_place(const float a[3], const float b[3])
{
	return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

void shape_triangle(struct shape *shape, uint32_t a, uint32_t b, uint32_t c)
{
	uint32_t i = shape->n_triangles;

	if (shape->failed)
		return;
	assert(a < shape->n_vertices && b < shape->n_vertices && c < shape->n_vertices);
	assert(shape->current < shape->n_materials);
	if (same_place(shape->position[a], shape->position[b]) || same_place(shape->position[b], shape->position[c]) ||
	    same_place(shape->position[c], shape->position[a]))
		return;
	if (i == shape->triangle_room) {
		uint32_t room = shape->triangle_room * 2 + 1024;

		if (!grow(shape, &shape->triangle, room, sizeof *shape->triangle) ||
		    !grow(shape, &shape->triangle_material, room, sizeof *shape->triangle_material) ||
		    !grow(shape, &shape->triangle_part, room, sizeof *shape->triangle_part))
			return;
		shape->triangle_room = room;
	}
	shape->triangle[i][0] = a;
	shape->triangle[i][1] = b;
	shape->triangle[i][2] = c;
	shape->triangle_material[i] = shape->current;
	shape->triangle_part[i] = shape->current_part;
	shape->n_triangles++;
}

struct shape_vertex *shape_grid_alloc(struct shape *shape, uint32_t rows, uint32_t cols)
{
	struct shape_vertex *grid = calloc((size_t)rows * cols, sizeof *grid);

	shape->failed |= grid == NULL;
	return grid;
}

void shape_grid(struct shape *shape, const struct shape_vertex *grid, uint32_t n_rows, uint32_t n_cols, int wrap_rows,
                int wrap_cols)
{
	uint32_t first = shape->n_vertices;
	uint32_t quad_rows = wrap_rows ? n_rows : n_rows - 1;
	uint32_t quad_cols = wrap_cols ? n_cols : n_cols - 1;

	for (uint32_t i = 0; i < n_rows * n_cols; i++)
		shape_vertex(shape, &grid[i]);
	for (uint32_t row = 0; row < quad_rows; row++) {
		uint32_t low = first + row * n_cols;
		uint32_t high = first + (row + 1) % n_rows * n_cols;

		for (uint32_t col = 0; col < quad_cols; col++) {
			uint32_t next = (col + 1) % n_cols;

			shape_triangle(shape, low + col, low + next, high + next);
			shape_triangle(shape, low + col, high + next, high + col);
		}
	}
}

void shape_fan(struct shape *shape, const double center[3], const double normal[3], const double (*rim)[3], uint32_t n)
{
	struct shape_vertex v;
	uint32_t hub, first;

	memcpy(v.n, normal, sizeof v.n);
	memcpy(v.p, center, sizeof v.p);
	hub = shape_vertex(shape, &v);
	first = shape->n_vertices;
	for (uint32_t i = 0; i < n; i++) {
		memcpy(v.p, rim[i], sizeof v.p);
		shape_vertex(shape, &v);
	}
	for (uint32_t i = 0; i < n; i++)
		shape_triangle(shape, hub, first + i, first + (i + 1) % n);
}

static void get_vertex(const struct shape *shape, uint32_t i, double p[3], double n[3])
{
	for (int k = 0; k < 3; k++) {
		p[k] = shape->position[i][k];
		n[k] = shape->normal[i][k];
	}
}

/* Positions by m, then moved; normals by `normals`. */
static void apply(struct shape *shape, uint32_t first, const double m[3][3], const double normals[3][3],
                  const double move[3])
{
	double p[3], n[3];

	for (uint32_t i = first; i < shape->n_vertices; i++) {
		get_vertex(shape, i, p, n);
		m3d_apply(p, m, p);
		v3d_add(p, p, move);
		m3d_apply(n, normals, n);
		set_vertex(shape, i, p, n);
	}
}

void shape_move(struct shape *shape, uint32_t first, const double turn[3][3], const double move[3])
{
	apply(shape, first, turn, turn, move);
}

void shape_shift(struct shape *shape, uint32_t first, const double move[3])
{
	shape_move(shape, first, shape_straight, move);
}

void shape_transform(struct shape *shape, uint32_t first, const double m[3][3], const double move[3])
{
	double cofactor[3][3];

	for (int k = 0; k < 3; k++)
		v3d_cross(cofactor[k], m[(k + 1) % 3], m[(k + 2) % 3]);
	apply(shape, first, m, (const double(*)[3])cofactor, move);
}

void shape_map(struct shape *shape, uint32_t first, const double u[4], const double v[4])
{
	double p[3], n[3];

	for (uint32_t i = first; i < shape->n_vertices; i++) {
		get_vertex(shape, i, p, n);
		shape->uv[i][0] = (float)(v3d_dot(u, p) + u[3]);
		shape->uv[i][1] = (float)(v3d_dot(v, p) + v[3]);
	}
}
