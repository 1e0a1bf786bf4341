/* Triangle meshes under construction: the generators fill them, and glb.c writes them.
 *
 * Object space is right-handed, +Y up. Triangles are counter-clockwise seen from outside. Everything is computed in
 * doubles with + - * / and sqrt alone and rounded once, to float, when a vertex is added: the same bytes everywhere. A
 * failed allocation is remembered in `failed`, and all later additions are dropped, so that a generator need not look
 * at every call; glb_write and shape_check report it. */
#ifndef MODELS_SHAPE_H
#define MODELS_SHAPE_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

/* glTF's metallic-roughness. The name belongs to the generator. Metals of the standard set are only half metallic:
 * under a few lights, without surroundings to mirror, a full one is black but for its highlights. */
struct shape_material {
	const char *name;
	uint32_t color; /* 0xRRGGBB, sRGB-coded */
	double metallic, roughness;
	int two_sided;  /* for sheets; 0 for the surface of a solid */
};

struct shape_vertex {
	double p[3], n[3]; /* n of any length but 0 */
};

/* The picture of a material, size x size, which repeats; the material's colour multiplies it. */
struct shape_image {
	uint32_t material, size;
	uint8_t *rgb; /* 3 size size, sRGB-coded, top-down */
};

/* One more copy of a part: x -> m x + move, det m > 0. */
struct shape_instance {
	uint32_t part;
	double m[3][3], move[3];
};

#define SHAPE_MAX_IMAGES 8

/* Part 0 is drawn as it is. The others are drawn once an instance, and not at all without one. */
struct shape {
	uint32_t n_vertices, n_triangles, n_materials, n_parts, n_instances, n_images;
	float (*position)[3], (*normal)[3]; /* n_vertices; normals are of unit length */
	float (*uv)[2];                     /* n_vertices; 0 where nothing else was said */
	uint32_t (*triangle)[3];            /* n_triangles */
	uint32_t *triangle_material;        /* n_triangles, < n_materials */
	uint32_t *triangle_part;            /* n_triangles, < n_parts */
	struct shape_material *material;
	struct shape_instance *instance;
	struct shape_image image[SHAPE_MAX_IMAGES];
	uint32_t current;                   /* the material that triangles get from now on */
	uint32_t current_part;              /* and the part */
	uint32_t vertex_room, triangle_room, material_room, instance_room;
	int failed;
};

void shape_init(struct shape *shape);
void shape_fini(struct shape *shape);

/* PSR_ERR_MEMORY if anything could not be added, PSR_OK otherwise. */
int shape_check(const struct shape *shape, struct psr_error *err);

/* Returns the index of the new material and makes it current. */
uint32_t shape_material(struct shape *shape, const struct shape_material *material);

void shape_materials(struct shape *shape, const struct shape_material *material, uint32_t n);

/* The material's picture, which the shape owns from now on (NULL: none could be had). At most SHAPE_MAX_IMAGES. */
void shape_image(struct shape *shape, uint32_t material, uint32_t size, uint8_t *rgb);

/* Returns the index of the new part and makes it current; `current_part` = 0 leads back. */
uint32_t shape_part(struct shape *shape);

/* Draws `part` once more, under m x + move; det m > 0. The numbers are rounded to multiples of 10^-6. */
void shape_place(struct shape *shape, uint32_t part, const double m[3][3], const double move[3]);

/* Returns the index of the new vertex. */
uint32_t shape_vertex(struct shape *shape, const struct shape_vertex *vertex);

/* Triangles with two corners at the same place (the poles of a surface) are left out. */
void shape_triangle(struct shape *shape, uint32_t a, uint32_t b, uint32_t c);

/* Zeroed vertices of a grid, to be freed; NULL, and `failed` is set, without memory. */
struct shape_vertex *shape_grid_alloc(struct shape *shape, uint32_t rows, uint32_t cols);

/* A grid of n_rows x n_cols vertices, row after row. Outside is where (next column - this) x (next row - this) points.
 * `wrap_rows`, `wrap_cols`: the last one is joined to the first. */
void shape_grid(struct shape *shape, const struct shape_vertex *grid, uint32_t n_rows, uint32_t n_cols, int wrap_rows,
                int wrap_cols);

/* A fan around `center` whose rim has n vertices, counter-clockwise seen from where `normal` points to. */
void shape_fan(struct shape *shape, const double center[3], const double normal[3], const double (*rim)[3], uint32_t n);

/* Turns (rows of an orthonormal matrix of determinant 1) and then moves the vertices from `first` on. */
void shape_move(struct shape *shape, uint32_t first, const double turn[3][3], const double move[3]);

void shape_shift(struct shape *shape, uint32_t first, const double move[3]); /* without a turn */
extern const double shape_straight[3][3];                                    /* no turn */

/* shape_move() for any m with det m > 0; the normals become those of the moved surface. */
void shape_transform(struct shape *shape, uint32_t first, const double m[3][3], const double move[3]);

/* Sets where the vertices from `first` on lie in their picture, v downwards: u . (x, y, z, 1) and v . (x, y, z, 1). */
void shape_map(struct shape *shape, uint32_t first, const double u[4], const double v[4]);

#endif
