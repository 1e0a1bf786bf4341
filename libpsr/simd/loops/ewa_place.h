/* EWA splats: batches of leaves in the picture. Each step is a loop over a batch, which the compiler turns into
 * vectors; a batch is of one instance, and cubes fill it whatever their levels. */
#ifndef PSR_SIMD_LOOPS_EWA_PLACE_H
#define PSR_SIMD_LOOPS_EWA_PLACE_H

#include "base/maths.h"
#include "base/srgb.h"
#include "psr/render.h"
#include "simd/cube.h"

/* A splat's plane is followed in depth, a pixel's step by an edge at most: on a steeper one what a pixel holds does
 * not follow from its middle. */
#define EWA_STEEP 1.0f

#define EWA_BATCH 128  /* leaves; what a batch needs stays in L1 */
#define EWA_VECTOR 16  /* lanes of the widest vector: steps go on to a multiple, lists may be written so far beyond */
#define EWA_ROOM (EWA_BATCH + EWA_VECTOR)

enum ewa_kind { EWA_MIXED = 1, EWA_TURNS = 2 }; /* may face away; is seen from both sides */

struct ewa_leaves {
	uint32_t n;
	const struct warp_instance *in;
	/* Listed: places as those of warp_cubes.origin, normals 511 times as long or 0, the edge as drawn, inner units. */
	_Alignas(64) float at[3][EWA_ROOM];
	float normal[3][EWA_ROOM], edge[EWA_ROOM];
	uint32_t id[EWA_ROOM];
	int32_t kind[EWA_ROOM];
	/* Placed. */
	int32_t is_left[EWA_ROOM]; /* 1: may be drawn */
	float u[EWA_ROOM], v[EWA_ROOM];
	int32_t x[EWA_ROOM], y[EWA_ROOM]; /* the pixel of its middle */
	float z[EWA_ROOM], zx[EWA_ROOM], zy[EWA_ROOM], least[EWA_ROOM]; /* as of ewa_one */
	float same[EWA_ROOM];   /* EWA_SAME edges, along the view axis */
	float facing[EWA_ROOM]; /* below 0: faces the eye */
	float across[EWA_ROOM], aslant[EWA_ROOM], down[EWA_ROOM]; /* squares of an edge in it */
	int32_t size[EWA_ROOM];
	int32_t mask[EWA_ROOM]; /* shape and sector: of the masks of its size */
	int32_t is_flipped[EWA_ROOM]; /* the mask, up and down */
	/* Of those of size 0: the pixel, counted as words are, or UINT32_MAX outside of the tile, and its z'; of others
	 * that may be drawn 1, or with their middle in the tile 3. */
	uint32_t pixel[EWA_ROOM];
	float pixel_z[EWA_ROOM];
	int32_t has_mask[EWA_ROOM];
	int32_t turned[3][EWA_ROOM]; /* normals in camera space */
	_Alignas(64) uint32_t value[EWA_ROOM][EWA_LANES]; /* as of ewa_sum, of weight 1 */
};

static inline float ewa_dot(const float m[3], float x, float y, float z)
{
	return (m[0] * x + m[1] * y) + m[2] * z;
}

/* Lanes that a step covers. */
static inline uint32_t ewa_lanes(const struct ewa_leaves *l)
{
	return (l->n + EWA_VECTOR - 1) / EWA_VECTOR * EWA_VECTOR;
}

/* Lists a cube's leaves; the batch has room. */
typedef void ewa_list_fn(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry,
                         const struct warp_cube *cube);

/* What all leaves of a cube have in common. */
static inline int32_t ewa_kind_of(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const int turns = (in->blocks->flags[entry->slot - in->first_slot] & PSR_BLOCK_TWO_SIDED) != 0;

	return (entry->is_mixed ? EWA_MIXED : 0) | (turns ? EWA_TURNS : 0);
}

static inline float ewa_edge_of(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const unsigned width = psr_blocks_level(in->blocks, entry->slot - in->first_slot);

	return (float)(in->cubes->model->level[0].edge * (double)(1u << width));
}

static inline void ewa_list(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry,
                            const struct warp_cube *cube)
{
	const struct warp_octants *octants = cube->octants;
	const float edge = ewa_edge_of(t, entry);
	const int32_t kind = ewa_kind_of(t, entry);
	float row[3][8];
	uint32_t n = 0;

	for (int a = 0; a < 3; a++)
		for (int i = 0; i < 8; i++)
			row[a][i] = (float)(cube->origin[a] + octants->row[a][i]);
	for (uint64_t left = cube->mask; left; left &= left - 1, n++) {
		const uint32_t lane = (uint32_t)__builtin_ctzll(left), i = l->n + n;
		float normal[3] = { 0, 0, 0 };

		if (cube->normal != NULL)
			warp_normal(normal, t->direction[cube->normal[n]]);
		const float offset = cube->offset != NULL ? (float)(2 * cube->offset[n] - WARP_OFFSET_MIDDLE) : 0;
		for (int a = 0; a < 3; a++) {
			l->at[a][i] = (row[a][lane >> 3] + octants->col[a][lane & 7])
			              + ewa_dot(octants->along[a], normal[0], normal[1], normal[2]) * offset;
			l->normal[a][i] = normal[a];
		}
		l->edge[i] = edge;
		l->id[i] = cube->id + lane;
		l->kind[i] = kind;
	}
	l->n += n;
}

/* Finds u, v and z', and which leaves may be drawn. */
static inline void ewa_project(struct ewa_leaves *l, const struct warp_target *t)
{
	const struct warp_instance *in = l->in;
	const int perspective = t->perspective;
	const float far = 2.0f * PSR_MAX_SIDE, near_z = t->near_z;
	const uint32_t n = ewa_lanes(l);
	float du[3], dv[3], d0[3];

	memcpy(du, in->du, sizeof du);
	memcpy(dv, in->dv, sizeof dv);
	memcpy(d0, in->d0, sizeof d0);
	for (uint32_t i = 0; i < n; i++) {
		const float nx = l->normal[0][i], ny = l->normal[1][i], nz = l->normal[2][i], z = l->at[2][i];
		const float inverse = psr_choose(perspective, 1 / z, 1);
		const float u = l->at[0][i] * inverse, v = l->at[1][i] * inverse;
		const float dx = (u * du[0] + v * dv[0]) + d0[0], dy = (u * du[1] + v * dv[1]) + d0[1];
		const float dz = (u * du[2] + v * dv[2]) + d0[2];
		const float g = (nx * dx + ny * dy) + nz * dz, length2 = (dx * dx + dy * dy) + dz * dz;
		const float limit = (BACK_SINE * BACK_SINE * 511 * 511) * length2;
		const int32_t is_away = (g > 0) & (g * g > limit), is_near = (u > -far) & (u < far) & (v > -far) & (v < far);

		l->is_left[i] = (z > near_z) & is_near & ~(is_away & l->kind[i]);
		l->u[i] = u;
		l->v[i] = v;
		l->facing[i] = g;
	}
	for (uint32_t i = 0; i < n; i++) {
		l->u[i] = psr_where(l->is_left[i], l->u[i]);
		l->v[i] = psr_where(l->is_left[i], l->v[i]);
	}
	for (uint32_t i = 0; i < n; i++) {
		l->x[i] = psr_floor_int(l->u[i]);
		l->y[i] = psr_floor_int(l->v[i]);
	}
}

/* Finds the edge's ellipses: of a disc that has an edge as its radius. */
static inline void ewa_shape(struct ewa_leaves *l, int perspective)
{
	const struct ewa_view *view = &l->in->cubes->ewa;
	const float xx = view->square[0][0], yy = view->square[1][1], zz = view->square[2][2];
	const float xy = view->square[0][1], xz = view->square[0][2], yz = view->square[1][2];
	const uint32_t n = ewa_lanes(l);

	for (uint32_t i = 0; i < n; i++) {
		const float u = psr_where(perspective, l->u[i]), v = psr_where(perspective, l->v[i]), edge = l->edge[i];
		const float scale = psr_choose(perspective, edge / l->at[2][i], edge), square = scale * scale;
		const float nx = l->normal[0][i] * (1 / 511.0f), ny = l->normal[1][i] * (1 / 511.0f);
		const float nz = l->normal[2][i] * (1 / 511.0f), along = ewa_dot(view->axis[2], nx, ny, nz);
		const float p = ewa_dot(view->axis[0], nx, ny, nz) - u * along;
		const float q = ewa_dot(view->axis[1], nx, ny, nz) - v * along;
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
	const uint32_t n = ewa_lanes(l);

	for (uint32_t i = 0; i < n; i++) {
		const float across = l->across[i], down = l->down[i], aslant = l->aslant[i], half = 0.5f * (across - down);
		const float wide = 0.5f * (across + down) + __builtin_sqrtf(half * half + aslant * aslant);
		const float inverse = 1 / psr_choose(wide > 1e-30f, wide, 1e-30f);
		const float x2 = 1 - across * inverse, y2 = 1 - down * inverse;
		const float x = __builtin_sqrtf(psr_where(x2 > 0, x2)), y = __builtin_sqrtf(psr_where(y2 > 0, y2));
		const float z2 = (1 - x * x) - y * y, z = __builtin_sqrtf(psr_where(z2 > 0, z2)), unit = 8 / ((x + y) + z);
		const float column = x * unit, row = y * unit;
		const int32_t c = ewa_cell(column), r = ewa_cell(row);
		const int32_t is_upper = (column - (float)c) + (row - (float)r) > 1, turn = -is_upper & 7;
		const int32_t is_flipped = aslant > 0, is_right = l->u[i] - (float)l->x[i] >= 0.5f;
		const int32_t is_low = (l->v[i] - (float)l->y[i] >= 0.5f) ^ is_flipped;
		int32_t size = 0;

		for (int k = 0; k < EWA_SIZES; k++)
			size += wide > ewa_size[k].edge * ewa_size[k].edge;
		l->size[i] = size;
		l->mask[i] = (8 * (r ^ turn) + (c ^ turn)) * EWA_SECTORS + (is_right | is_low << 1);
		l->is_flipped[i] = is_flipped;
	}
}

/* Finds how depth changes over a splat's plane. */
static inline void ewa_slope(struct ewa_leaves *l, int perspective)
{
	const struct ewa_view *view = &l->in->cubes->ewa;
	const uint32_t n = ewa_lanes(l);

	for (uint32_t i = 0; i < n; i++) {
		const float nx = l->normal[0][i], ny = l->normal[1][i], nz = l->normal[2][i], z = l->at[2][i];
		const float depth = l->edge[i] * view->depth, steep = EWA_STEEP * depth;
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
		l->least[i] = z - (float)(CUBES_DIAGONAL / 2) * depth;
		l->z[i] = z + (dx * zx + dy * zy);
		l->same[i] = EWA_SAME * l->edge[i] * view->depth;
	}
}

/* Finds the pixels of splats of size 0, which have one each, and which leaves have masks of more. */
static inline void ewa_find_pixels(struct ewa_leaves *l, const struct warp_target *t)
{
	const uint32_t w = (uint32_t)(t->x1 - t->x0), h = (uint32_t)(t->y1 - t->y0), n = ewa_lanes(l), stride = t->stride;
	const int32_t x0 = t->x0, y0 = t->y0;

	for (uint32_t i = 0; i < n; i++) {
		const uint32_t x = (uint32_t)(l->x[i] - x0), y = (uint32_t)(l->y[i] - y0);
		const int is_inside = (x < w) & (y < h), is_drawn = l->is_left[i] & (l->size[i] == 0) & is_inside;
		const float z = psr_choose(l->z[i] > l->least[i], l->z[i], l->least[i]);

		l->pixel[i] = (y * stride + x) | (0u - (uint32_t)!is_drawn);
		l->pixel_z[i] = z;
		l->has_mask[i] = -(l->is_left[i] & (l->size[i] > 0)) & (1 + 2 * is_inside);
	}
}

/* Finds all that a batch's splats need but their looks. */
static inline void ewa_place(struct ewa_leaves *l, const struct warp_target *t)
{
	for (uint32_t i = l->n; i < ewa_lanes(l); i++) { /* nothing is computed of what memory held */
		for (int k = 0; k < 3; k++)
			l->at[k][i] = l->normal[k][i] = 0;
		l->edge[i] = 0;
		l->kind[i] = 0;
	}
	ewa_project(l, t);
	ewa_shape(l, t->perspective);
	ewa_quantise(l);
	ewa_slope(l, t->perspective);
	ewa_find_pixels(l, t);
}

static inline int32_t ewa_round(float x)
{
	return psr_floor_int(x + 0.5f);
}

/* Puts the colours of the n leaves that a cube has added to the batch into their values, which end with them. */
static inline void ewa_put_colors(struct ewa_leaves *l, const struct warp_cube *cube, uint32_t n)
{
	const uint32_t gray = (uint32_t)(int32_t)(psr_srgb_to_linear[CUBES_GRAY & 0xff] * EWA_COLOR_ONE + 0.5f);
	const uint32_t plain[EWA_LANES - EWA_COLOR] = { gray, gray, gray, 0 };
	uint32_t (*value)[EWA_LANES] = l->value + (l->n - n);

	for (uint32_t i = 0; i < n; i++) {
		memcpy(value[i] + EWA_COLOR, plain, sizeof plain);
		for (int k = 0; cube->color != NULL && k < 3; k++)
			value[i][EWA_COLOR + k] =
				(uint32_t)(int32_t)(psr_srgb_to_linear[cube->color[i][k]] * EWA_COLOR_ONE + 0.5f);
	}
}

/* Finds normals in camera space. */
static inline void ewa_turn(struct ewa_leaves *l)
{
	const uint32_t n = ewa_lanes(l);
	float turn[3][3];

	memcpy(turn, l->in->turn, sizeof turn);
	for (uint32_t i = 0; i < n; i++) {
		const float side = psr_choose(((l->kind[i] & EWA_TURNS) != 0) & (l->facing[i] > 0), -1, 1);
		const float nx = side * l->normal[0][i], ny = side * l->normal[1][i], nz = side * l->normal[2][i];

		for (int k = 0; k < 3; k++)
			l->turned[k][i] = ewa_round(ewa_dot(turn[k], nx, ny, nz));
	}
}

/* Puts a weight of 1 and normals into the values of a batch, which begin with them. */
typedef void ewa_put_normals_fn(struct ewa_leaves *l);

static inline void ewa_put_normals(struct ewa_leaves *l)
{
	for (uint32_t i = 0; i < l->n; i++) {
		l->value[i][EWA_WEIGHT] = 1;
		for (int k = 0; k < 3; k++)
			l->value[i][EWA_NORMAL + k] = (uint32_t)l->turned[k][i];
	}
}

#endif
