#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "import.h"

/* A model of 64 pixels has pixels of at least a 64th of the mesh's longest side: cells are at most half of one. */
#define CELLS 128
#define FEW_TRIANGLES (1u << 17) /* read and sampled as they are in less than a second */
#define FAR 2                    /* cells between two corners: the triangle and its corners stay */

#define NO_CELL UINT32_MAX
#define KEEPS UINT32_MAX /* in place of a cell's number */

struct place {
	double sum[3], n; /* of the cell's corners; then sum is their mean */
};

/* The mesh's cells, and where each puts its vertices. */
struct grid {
	double low[3], per_unit;
	uint32_t *cell;      /* of each vertex; NO_CELL: it is not finite */
	uint32_t *number;    /* by cell: 1 + that of its place, KEEPS if its vertices stay; 0: no triangle uses it */
	struct place *place; /* at most n_vertices */
	uint32_t n_places;
};

static void grid_fini(struct grid *grid)
{
	free(grid->cell);
	free(grid->number);
	free(grid->place);
}

static uint32_t cell_at(const struct grid *grid, const double p[3])
{
	uint32_t cell = 0;

	for (int k = 0; k < 3; k++) {
		const double at = (p[k] - grid->low[k]) * grid->per_unit;

		if (!isfinite(p[k]))
			return NO_CELL;
		cell = cell * CELLS + (uint32_t)(at > 0 ? at < CELLS - 1 ? at : CELLS - 1 : 0);
	}
	return cell;
}

/* Bounds what triangles use; other vertices may lie anywhere. */
static double find_size(struct grid *grid, const struct psr_mesh *mesh)
{
	double low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY }, size = 0;

	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			for (int k = 0; k < 3; k++) {
				const double x = mesh->position[mesh->triangle[t][c]][k];

				if (!isfinite(x))
					continue;
				low[k] = x < low[k] ? x : low[k];
				high[k] = x > high[k] ? x : high[k];
			}
	for (int k = 0; k < 3; k++) {
		grid->low[k] = low[k];
		size = fmax(size, high[k] - low[k]);
	}
	return size;
}

static int grid_init(struct grid *grid, const struct import_mesh *im, double size, struct psr_error *err)
{
	const struct psr_mesh *mesh = im->mesh;

	grid->per_unit = CELLS / size;
	grid->cell = malloc((size_t)mesh->n_vertices * sizeof *grid->cell);
	grid->number = calloc((size_t)CELLS * CELLS * CELLS, sizeof *grid->number);
	grid->place = malloc((size_t)mesh->n_vertices * sizeof *grid->place);
	if (grid->cell == NULL || grid->number == NULL || grid->place == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to merge %u triangles", im->path, mesh->n_triangles);
	for (uint32_t v = 0; v < mesh->n_vertices; v++)
		grid->cell[v] = cell_at(grid, mesh->position[v]);
	return PSR_OK;
}

static int are_near(uint32_t a, uint32_t b)
{
	for (; a != b; a /= CELLS, b /= CELLS)
		if (abs((int)(a % CELLS) - (int)(b % CELLS)) > FAR)
			return 0;
	return 1;
}

/* Whether the triangle's corners stay where they are: it is large, or broken. */
static int stays(const struct grid *grid, const uint32_t v[3])
{
	const uint32_t a = grid->cell[v[0]], b = grid->cell[v[1]], c = grid->cell[v[2]];

	return a == NO_CELL || b == NO_CELL || c == NO_CELL || !are_near(a, b) || !are_near(b, c) || !are_near(c, a);
}

/* By cell, not by vertex: vertices at one place decide alike, so that no crack opens. */
static void keep_cells(struct grid *grid, const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		const uint32_t *v = mesh->triangle[t];

		for (int c = 0; c < 3 && stays(grid, v); c++)
			if (grid->cell[v[c]] != NO_CELL)
				grid->number[grid->cell[v[c]]] = KEEPS;
	}
}

static struct place *place_of(const struct grid *grid, uint32_t v)
{
	const uint32_t number = grid->cell[v] != NO_CELL ? grid->number[grid->cell[v]] : KEEPS;

	return number != KEEPS && number != 0 ? &grid->place[number - 1] : NULL;
}

static void add_corner(struct grid *grid, const struct psr_mesh *mesh, uint32_t v)
{
	struct place *place;

	if (grid->cell[v] != NO_CELL && grid->number[grid->cell[v]] == 0) {
		grid->place[grid->n_places] = (struct place){ .n = 0 };
		grid->number[grid->cell[v]] = ++grid->n_places;
	}
	place = place_of(grid, v);
	for (int k = 0; place != NULL && k < 3; k++)
		place->sum[k] += mesh->position[v][k] - grid->low[k];
	if (place != NULL)
		place->n++;
}

static void find_places(struct grid *grid, const struct psr_mesh *mesh)
{
	keep_cells(grid, mesh);
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			add_corner(grid, mesh, mesh->triangle[t][c]);
	for (uint32_t i = 0; i < grid->n_places; i++)
		for (int k = 0; k < 3; k++)
			grid->place[i].sum[k] = grid->low[k] + grid->place[i].sum[k] / grid->place[i].n;
}

static const double *target_of(const struct grid *grid, const struct psr_mesh *mesh, uint32_t v)
{
	const struct place *place = place_of(grid, v);

	return place != NULL ? place->sum : mesh->position[v];
}

static void move_vertices(const struct grid *grid, struct psr_mesh *mesh)
{
	for (uint32_t v = 0; v < mesh->n_vertices; v++)
		memmove(mesh->position[v], target_of(grid, mesh, v), sizeof mesh->position[v]);
}

/* Whether the triangle's front will still be one. Where a surface folds, two others cover what a reversed one does, and
 * it would show its back. */
static int keeps_side(const struct grid *grid, const struct psr_mesh *mesh, const uint32_t v[3])
{
	const double *p = mesh->position[v[0]], *q = target_of(grid, mesh, v[0]);
	double e[3], f[3], before[3], after[3];

	v3d_sub(e, mesh->position[v[1]], p);
	v3d_sub(f, mesh->position[v[2]], p);
	v3d_cross(before, e, f);
	v3d_sub(e, target_of(grid, mesh, v[1]), q);
	v3d_sub(f, target_of(grid, mesh, v[2]), q);
	v3d_cross(after, e, f);
	return v3d_dot(before, after) > 0;
}

static void drop_triangles(const struct grid *grid, struct psr_mesh *mesh)
{
	uint32_t kept = 0;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		const uint32_t *v = mesh->triangle[t];
		const int moves = place_of(grid, v[0]) != NULL || place_of(grid, v[1]) != NULL || place_of(grid, v[2]) != NULL;

		if (moves && !keeps_side(grid, mesh, v))
			continue;
		import_mesh_move_triangle(mesh, kept++, t);
	}
	mesh->n_triangles = kept;
}

/* Vertex clustering (J. Rossignac and P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes",
 * 1993), with the mean for the place of a cell's vertices. */
int import_mesh_merge(struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	const uint32_t n_before = mesh->n_triangles;
	struct grid grid = { .per_unit = 0 };
	uint32_t n_doubles;
	double size;
	int rc;

	if (!im->options.is_preview || mesh->n_triangles <= FEW_TRIANGLES)
		return PSR_OK;
	rc = import_mesh_check_indices(im, err);
	if (rc != PSR_OK)
		return rc;
	size = find_size(&grid, mesh);
	if (!isnormal(size) || !isnormal(CELLS / size))
		return PSR_OK;
	rc = grid_init(&grid, im, size, err);
	if (rc == PSR_OK) {
		find_places(&grid, mesh);
		drop_triangles(&grid, mesh);
		move_vertices(&grid, mesh);
		import_mesh_warn(im, "triangles much smaller than a pixel were merged: %u became %u", n_before,
		                 mesh->n_triangles);
		rc = import_mesh_drop_vertices(im, err);
	}
	grid_fini(&grid);
	return rc == PSR_OK ? import_mesh_drop_duplicates(&n_doubles, im, err) : rc;
}
