/* EWA splats: the leaves of a cube in the picture. */
#ifndef PSR_SIMD_LOOPS_EWA_PLACE_H
#define PSR_SIMD_LOOPS_EWA_PLACE_H

#include "base/maths.h"
#include "base/srgb.h"
#include "psr/render.h"
#include "simd/cube.h"

/* A splat's plane is followed in depth, a pixel's step by an edge at most: on a steeper one what a pixel holds does
 * not follow from its middle. */
#define EWA_STEEP 1.0f

struct ewa_leaves {
	uint32_t n;
	float same; /* EWA_SAME edges, along the view axis */
	struct warp_cube cube;
	uint8_t lane[PSR_BLOCK_SAMPLES];
	uint32_t id[PSR_BLOCK_SAMPLES];
	int32_t is_left[PSR_BLOCK_SAMPLES]; /* 1: may be drawn */
	float u[PSR_BLOCK_SAMPLES], v[PSR_BLOCK_SAMPLES];
	int32_t x[PSR_BLOCK_SAMPLES], y[PSR_BLOCK_SAMPLES]; /* the pixel of its middle */
	float z[PSR_BLOCK_SAMPLES], zx[PSR_BLOCK_SAMPLES], zy[PSR_BLOCK_SAMPLES], least[PSR_BLOCK_SAMPLES]; /* as of ewa_one */
	float normal[3][PSR_BLOCK_SAMPLES];                 /* 511 times as long; 0 without */
	float facing[PSR_BLOCK_SAMPLES];                    /* below 0: faces the eye */
	float across[PSR_BLOCK_SAMPLES], aslant[PSR_BLOCK_SAMPLES], down[PSR_BLOCK_SAMPLES]; /* squares of an edge in it */
	int32_t size[PSR_BLOCK_SAMPLES], shape[PSR_BLOCK_SAMPLES], sector[PSR_BLOCK_SAMPLES];
	int32_t is_flipped[PSR_BLOCK_SAMPLES];              /* the mask, up and down */
	int32_t turned[3][PSR_BLOCK_SAMPLES], color[3][PSR_BLOCK_SAMPLES]; /* as of ewa_sum */
};

static inline float ewa_dot(const float m[3], float x, float y, float z)
{
	return (m[0] * x + m[1] * y) + m[2] * z;
}

/* Lists the leaves of a cube, with their normals. */
static inline void ewa_list(struct ewa_leaves *l, const struct warp_target *t, const struct warp_cube *cube)
{
	uint32_t n = 0;

	for (uint64_t left = cube->mask; left; left &= left - 1, n++) {
		l->lane[n] = (uint8_t)__builtin_ctzll(left);
		l->id[n] = cube->id + l->lane[n];
	}
	l->n = n;
	for (uint32_t i = 0; i < n; i++) {
		float normal[3] = { 0, 0, 0 };

		if (cube->normal != NULL)
			warp_normal(normal, t->direction[cube->normal[i]]);
		for (int k = 0; k < 3; k++)
			l->normal[k][i] = normal[k];
	}
}

/* Finds u, v and z', and which leaves may be drawn. */
static inline void ewa_project(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct warp_octants *octants = l->cube.octants;
	const int perspective = t->perspective, is_mixed = entry->is_mixed;
	const float far = 2.0f * PSR_MAX_SIDE, near_z = t->near_z;
	float row[3][8], offset[PSR_BLOCK_SAMPLES] = { 0 };

	for (int a = 0; a < 3; a++)
		for (int i = 0; i < 8; i++)
			row[a][i] = (float)(l->cube.origin[a] + octants->row[a][i]);
	for (uint32_t i = 0; l->cube.offset != NULL && i < l->n; i++)
		offset[i] = (float)(2 * l->cube.offset[i] - WARP_OFFSET_MIDDLE);
	for (uint32_t i = 0; i < l->n; i++) {
		const uint32_t lane = l->lane[i];
		const float nx = l->normal[0][i], ny = l->normal[1][i], nz = l->normal[2][i];
		float at[3];

		for (int a = 0; a < 3; a++)
			at[a] = (row[a][lane >> 3] + octants->col[a][lane & 7]) + ewa_dot(octants->along[a], nx, ny, nz) * offset[i];
		const float inverse = psr_choose(perspective, 1 / at[2], 1);
		const float u = at[0] * inverse, v = at[1] * inverse;
		const float dx = (u * in->du[0] + v * in->dv[0]) + in->d0[0], dy = (u * in->du[1] + v * in->dv[1]) + in->d0[1];
		const float dz = (u * in->du[2] + v * in->dv[2]) + in->d0[2];
		const float g = (nx * dx + ny * dy) + nz * dz, length2 = (dx * dx + dy * dy) + dz * dz;
		const int is_away = (g > 0) & (g * g > (BACK_SINE * BACK_SINE * 511 * 511) * length2) & is_mixed;

		l->is_left[i] = (at[2] > near_z) & (u > -far) & (u < far) & (v > -far) & (v < far) & !is_away;
		l->u[i] = psr_where(l->is_left[i], u);
		l->v[i] = psr_where(l->is_left[i], v);
		l->z[i] = at[2];
		l->facing[i] = g;
	}
}

/* Finds the edge's ellipses: of a disc that has an edge as its radius. */
static inline void ewa_shape(struct ewa_leaves *l, const struct ewa_view *view, float edge, int perspective)
{
	const float xx = view->square[0][0], yy = view->square[1][1], zz = view->square[2][2];
	const float xy = view->square[0][1], xz = view->square[0][2], yz = view->square[1][2];

	for (uint32_t i = 0; i < l->n; i++) {
		const float u = psr_where(perspective, l->u[i]), v = psr_where(perspective, l->v[i]);
		const float scale = psr_choose(perspective, edge / l->z[i], edge), square = scale * scale;
		const float nx = l->normal[0][i] * (1 / 511.0f), ny = l->normal[1][i] * (1 / 511.0f);
		const float nz = l->normal[2][i] * (1 / 511.0f), along = ewa_dot(view->axis[2], nx, ny, nz);
		const float p = ewa_dot(view->axis[0], nx, ny, nz) - u * along, q = ewa_dot(view->axis[1], nx, ny, nz) - v * along;
		const float across = ((xx - 2 * u * xz) + u * u * zz) - p * p, down = ((yy - 2 * v * yz) + v * v * zz) - q * q;

		l->across[i] = square * psr_where(across > 0, across);
		l->down[i] = square * psr_where(down > 0, down);
		l->aslant[i] = square * ((((xy - v * xz) - u * yz) + u * v * zz) - p * q);
	}
}

static inline int32_t ewa_cell(float at)
{
	const int32_t cell = (int32_t)at;

	return cell < 7 ? cell : 7;
}

/* Finds sizes, shapes and sectors. */
static inline void ewa_quantise(struct ewa_leaves *l)
{
	for (uint32_t i = 0; i < l->n; i++) {
		const float across = l->across[i], down = l->down[i], aslant = l->aslant[i], half = 0.5f * (across - down);
		const float wide = 0.5f * (across + down) + __builtin_sqrtf(half * half + aslant * aslant);
		const float inverse = 1 / psr_choose(wide > 1e-30f, wide, 1e-30f);
		const float x2 = 1 - across * inverse, y2 = 1 - down * inverse;
		const float x = __builtin_sqrtf(psr_where(x2 > 0, x2)), y = __builtin_sqrtf(psr_where(y2 > 0, y2));
		const float z2 = (1 - x * x) - y * y, z = __builtin_sqrtf(psr_where(z2 > 0, z2)), unit = 8 / ((x + y) + z);
		const float column = x * unit, row = y * unit;
		const int32_t c = ewa_cell(column), r = ewa_cell(row);
		const int is_upper = (column - (float)c) + (row - (float)r) > 1;
		const int32_t pixel_u = psr_floor_int(l->u[i]), pixel_v = psr_floor_int(l->v[i]);
		const int is_flipped = aslant > 0;
		int32_t size = 0;

		for (int k = 0; k < EWA_SIZES; k++)
			size += wide > ewa_size[k].edge * ewa_size[k].edge;
		l->size[i] = size;
		l->shape[i] = 8 * (is_upper ? 7 - r : r) + (is_upper ? 7 - c : c);
		l->sector[i] = (l->u[i] - (float)pixel_u >= 0.5f) | ((l->v[i] - (float)pixel_v >= 0.5f) ^ is_flipped) << 1;
		l->is_flipped[i] = is_flipped;
		l->x[i] = pixel_u;
		l->y[i] = pixel_v;
	}
}

/* Finds how depth changes over a splat's plane. */
static inline void ewa_slope(struct ewa_leaves *l, const struct ewa_view *view, float depth, int perspective)
{
	const float steep = EWA_STEEP * depth, nearer = (float)(CUBES_DIAGONAL / 2) * depth;

	for (uint32_t i = 0; i < l->n; i++) {
		const float nx = l->normal[0][i], ny = l->normal[1][i], nz = l->normal[2][i], z = l->z[i];
		const float a = ewa_dot(view->dual[0], nx, ny, nz), b = ewa_dot(view->dual[1], nx, ny, nz);
		const float c = ewa_dot(view->dual[2], nx, ny, nz);
		const float through = psr_choose(perspective, (a * l->u[i] + b * l->v[i]) + c, c);
		const float length = psr_choose(perspective, z, 1), down = length * b, across = length * a;
		const float least = (__builtin_fabsf(across) + __builtin_fabsf(down)) / steep;
		const float size = __builtin_fabsf(through), most = psr_choose(size > least, size, least);
		const float below = psr_choose(through < 0, -most, most);
		const float unit = -1 / psr_choose(most > 0, below, 1);
		const float zx = across * unit, zy = down * unit;
		const float dx = (float)l->x[i] + 0.5f - l->u[i], dy = (float)l->y[i] + 0.5f - l->v[i];

		l->zx[i] = zx;
		l->zy[i] = zy;
		l->least[i] = z - nearer;
		l->z[i] = z + (dx * zx + dy * zy);
	}
}

/* Finds all that a cube's splats need but their looks. */
static inline void ewa_place(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct psr_cubes *cubes = in->cubes->model;
	const struct ewa_view *view = &in->cubes->ewa;

	warp_cube_make(&l->cube, in, entry->slot);
	const unsigned width = psr_blocks_level(&cubes->groups, entry->slot - in->first_slot);
	const float edge = (float)(cubes->level[0].edge * (double)(1u << width));
	l->same = EWA_SAME * edge * view->depth;
	ewa_list(l, t, &l->cube);
	ewa_project(l, t, entry);
	ewa_shape(l, view, edge, t->perspective);
	ewa_quantise(l);
	ewa_slope(l, view, edge * view->depth, t->perspective);
}

static inline int32_t ewa_round(float x)
{
	return psr_floor_int(x + 0.5f);
}

/* Finds normals in camera space and colours. */
static inline void ewa_look(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct psr_cubes *cubes = in->cubes->model;
	const uint32_t cube = entry->slot - in->first_slot;
	const struct psr_cube_level *level = psr_cubes_level(cubes, cube);
	const uint8_t(*color)[3] = (const uint8_t(*)[3])level->tree->color;
	const int turns = (cubes->groups.flags[cube] & PSR_BLOCK_TWO_SIDED) != 0;

	color += color != NULL ? psr_cubes_leaf(cubes, level, cube) : 0;

	for (uint32_t i = 0; i < l->n; i++) {
		const float side = psr_choose(turns & (l->facing[i] > 0), -1, 1);
		const float nx = side * l->normal[0][i], ny = side * l->normal[1][i], nz = side * l->normal[2][i];

		for (int k = 0; k < 3; k++)
			l->turned[k][i] = ewa_round(ewa_dot(in->turn[k], nx, ny, nz));
	}
	for (uint32_t i = 0; i < l->n; i++)
		for (int k = 0; k < 3; k++) {
			const uint32_t code = color != NULL ? color[i][k] : (uint32_t)(CUBES_GRAY >> 8 * k & 0xff);

			l->color[k][i] = (int32_t)(psr_srgb_to_linear[code] * EWA_COLOR_ONE + 0.5f);
		}
}

#endif
