/* How much of a light reaches the samples of a strip, by shadow maps ([G] 7.3.1). */
#include <string.h>
#include "base/maths.h"
#include "simd/shadow.h"
#include "strip_parts.h"

#define GROUP STRIP_PADDING /* samples that are skipped or looked up together */

/* The samples of a strip as one map sees them; groups entirely outside of the map are left out. */
struct shadow_place {
	float *reaches; /* of the strip */
	uint32_t n_facing; /* samples that face the light */
	size_t n;
	uint8_t first[STRIP / GROUP];       /* of each group, in the strip */
	int32_t is_here[STRIP];             /* in the map, facing the light */
	float u[STRIP], v[STRIP], z[STRIP]; /* texels of level 0, and z' */
	float bias[STRIP];                  /* for a cell of one texel; proportional to the cell */
	float du[STRIP], dv[STRIP];         /* slope of the sample's plane: z' a texel */
	float cover[STRIP];
};

/* The plane of a sample at q with normal n holds all p with n.p = n.q. With p = (x z', y z', z') in perspective dz'/dx
 * = -z' n_x / (n.(x, y, 1)), which is z'^2 n_x / -(n.q); in orthographic maps it is n_x / -n_z. This sine, of 0.6
 * degrees, bounds the slope where light grazes a surface. */
#define GRAZING 0.01f

/* Stored normals err by up to BACK_SINE, slopes by that times 1 / cos^2 of the angle to the light; samples of a cell
 * are up to 1.5 cells away in both directions. */
#define NORMAL_BIAS (1.5f * 1.41421356f * BACK_SINE)

static inline float magnitude(float x)
{
	return psr_float_from_bits(psr_bits_from_float(x) & 0x7fffffff);
}

/* Places a group, and sets `reaches` to 1 for samples that face the light, else 0. Returns how many are in the map. */
static CONSTANT_FLAGS uint32_t locate_group(struct shadow_place *at, const struct strip *s, size_t first,
                                            const struct shadow_map *map, int perspective, int is_face)
{
	const struct shadow_map m = *map;
	float *const reaches = at->reaches;
	const float least = GRAZING * m.scale, unit = 1 / m.focal;
	uint32_t n_front = 0, n_here = 0;

	for (size_t i = 0; i < GROUP; i++) {
		const size_t from = first + i, to = at->n + i;
		const float px = s->px[from], py = s->py[from], pz = s->pz[from];
		const float nx = s->gx[from], ny = s->gy[from], nz = s->gz[from];
		const float x = ((m.turn[0][0] * px + m.turn[0][1] * py) + m.turn[0][2] * pz) + m.move[0];
		const float y = ((m.turn[1][0] * px + m.turn[1][1] * py) + m.turn[1][2] * pz) + m.move[1];
		const float z = ((m.turn[2][0] * px + m.turn[2][1] * py) + m.turn[2][2] * pz) + m.move[2];
		const float mx = (m.turn[0][0] * nx + m.turn[0][1] * ny) + m.turn[0][2] * nz;
		const float my = (m.turn[1][0] * nx + m.turn[1][1] * ny) + m.turn[1][2] * nz;
		const float mz = (m.turn[2][0] * nx + m.turn[2][1] * ny) + m.turn[2][2] * nz;
		const float facing = -(perspective ? (mx * x + my * y) + mz * z : mz);
		const int is_beyond = z > m.near_z;
		const int is_inside = is_face ? (z >= x) & (z >= -x) & (z >= y) & (z >= -y) : 1;
		const float w = perspective ? psr_choose(is_beyond, z, m.near_z) : 1;
		const float texel = w * unit, scale = m.focal / w, floor = least * w;
		const float steep = w / psr_choose(facing > floor, facing, floor), slope = texel * steep,
					secant = m.scale * steep;
		const int32_t is_here = (facing > 0) & is_beyond & is_inside;

		at->u[to] = x * scale + m.half_width;
		at->v[to] = y * scale + m.half_height;
		at->z[to] = z;
		at->du[to] = mx * slope;
		at->dv[to] = my * slope;
		at->bias[to] =
			(magnitude(at->du[to]) + magnitude(at->dv[to])) * m.slope_bias + texel * NORMAL_BIAS * secant * secant;
		at->cover[to] = 0;
		at->is_here[to] = is_here;
		reaches[from] = psr_where(facing > 0, 1);
		n_front += facing > 0;
		n_here += (uint32_t)is_here;
	}
	at->n_facing += n_front;
	return n_here;
}

static CONSTANT_FLAGS int locate_by(struct shadow_place *at, const struct strip *s, const struct shadow_map *map,
                                    int perspective, int is_face)
{
	at->n = at->n_facing = 0;
	for (size_t first = 0; first < s->n; first += GROUP) {
		at->first[at->n / GROUP] = (uint8_t)first;
		at->n += locate_group(at, s, first, map, perspective, is_face) ? GROUP : 0;
	}
	return at->n_facing != 0;
}

/* Returns whether any sample faces the light. */
static int shadow_locate(struct shadow_place *at, const struct strip *s, const struct shadow_map *map, int is_face)
{
	if (!map->perspective)
		return locate_by(at, s, map, 0, 0);
	return is_face ? locate_by(at, s, map, 1, 1) : locate_by(at, s, map, 1, 0);
}

static inline float clamp_cell(float x, float most)
{
	x = psr_choose(x > -1, x, -1); /* NaN becomes -1 */
	return psr_choose(x < most, x, most);
}

/* Two cells side by side. */
static inline uint32_t load_pair(const uint16_t *cells)
{
	uint32_t pair;

	memcpy(&pair, cells, sizeof pair);
	return pair;
}

static inline float cover_of(uint32_t cell, float step, float from, float z, float part)
{
	return psr_where(((float)(int32_t)cell * step + from < z) & (cell != SHADOW_EMPTY), part);
}

/* Finds the coverage of each place by cells of level k, bilinear among four of them ([G] 4.6). A cell, at the depth of
 * its nearest sample, covers a place whose plane lies behind it all over the cell: the plane's least depth there, half
 * a cell from the cell's centre in both directions, less a bias of a cell's width at the cell's depth. Loads have a
 * loop of their own, so that the compiler turns the arithmetic into vectors. */
static void shadow_cover(float *cover, const struct shadow_place *at, const struct shadow_map *map,
                         const uint16_t *cells, int k)
{
	const size_t n = at->n / GROUP * GROUP;
	const float size = (float)(1 << k), inverse = 1 / size, bias = size * map->texel_bias / map->focal;
	const float scale = map->perspective ? 1 + bias : 1, step = map->step * scale;
	const float from = (map->perspective ? 0 : bias) + map->slack + map->from * scale;
	const float most_x = map->level[k].most_x, most_y = map->level[k].most_y;
	const int32_t stride = (int32_t)map->level[k].stride;
	const uint16_t *upper = cells + stride + 1, *lower = upper + stride;
	float fx[STRIP], fy[STRIP];
	int32_t cell[STRIP];
	uint32_t pair[2][STRIP];

	for (size_t i = 0; i < n; i++) {
		const float x = clamp_cell(at->u[i] * inverse - 0.5f, most_x),
					y = clamp_cell(at->v[i] * inverse - 0.5f, most_y);
		const int32_t cx = psr_floor_int(x), cy = psr_floor_int(y);

		cell[i] = (cy * stride + cx) & -at->is_here[i]; /* the others read cell 0, which costs least */
		fx[i] = x - (float)cx;
		fy[i] = y - (float)cy;
	}
	for (size_t i = 0; i < n; i++) {
		pair[0][i] = load_pair(upper + cell[i]);
		pair[1][i] = load_pair(lower + cell[i]);
	}
	for (size_t i = 0; i < n; i++) {
		const float du = at->du[i] * size, dv = at->dv[i] * size, x = fx[i], y = fy[i];
		const float least = at->z[i] - at->bias[i] * size;
		const float z00 = least - (x * du + y * dv), z10 = z00 + du, z01 = z00 + dv, z11 = z10 + dv;
		const float c00 = cover_of(pair[0][i] & 0xffff, step, from, z00, (1 - x) * (1 - y)),
					c10 = cover_of(pair[0][i] >> 16, step, from, z10, x * (1 - y));
		const float c01 = cover_of(pair[1][i] & 0xffff, step, from, z01, (1 - x) * y),
					c11 = cover_of(pair[1][i] >> 16, step, from, z11, x * y);

		cover[i] = (c00 + c11) + (c10 + c01);
	}
}

/* Raises the coverage of each place to that by one level. Where a surface passes from blocks of one level to blocks of
 * the next, neither level covers it whole ([G] 9.1.2): where the coarser one covers a part, coverage is by the coarser
 * cells that either level fills. */
static void shadow_raise(struct shadow_place *at, const struct shadow_map *map, int k)
{
	const size_t n = at->n / GROUP * GROUP;
	float cover[STRIP], seam[STRIP];
	uint32_t n_partial = 0;

	shadow_cover(cover, at, map, map->level[k].z, k);
	if (map->level[k].seam) {
		for (size_t i = 0; i < n; i++)
			n_partial += (cover[i] > 0) & (cover[i] < 1);
		if (n_partial) {
			shadow_cover(seam, at, map, map->level[k].seam, k);
			for (size_t i = 0; i < n; i++)
				cover[i] = psr_choose((cover[i] > 0) & (seam[i] > cover[i]), seam[i], cover[i]);
		}
	}
	for (size_t i = 0; i < n; i++)
		at->cover[i] = psr_choose(cover[i] > at->cover[i], cover[i], at->cover[i]);
}

static int strip_shadow(const struct strip *strip, const struct shadow_light *shadow, float *reaches)
{
	struct shadow_place at;
	float others[STRIP]; /* every map of a light finds the same samples facing it: the first one's result counts */
	int is_lit = 0;

	for (uint32_t f = 0; f < shadow->n_maps; f++) {
		const struct shadow_map *map = &shadow->map[f];

		at.reaches = f ? others : reaches;
		is_lit |= shadow_locate(&at, strip, map, shadow->n_maps > 1);
		if (!is_lit)
			return 0;
		for (int k = 0; at.n && k <= PSR_MAX_DEPTH_LEVEL; k++)
			if (map->levels >> k & 1)
				shadow_raise(&at, map, k);
		for (size_t g = 0; g < at.n; g += GROUP)
			for (size_t i = 0; i < GROUP; i++) {
				/* Cells crossed by an edge count as covered whole; doubling the rest halves that error. */
				const float left = 2 - 2 * at.cover[g + i], light = psr_where(left > 0, psr_choose(left < 1, left, 1));
				float *to = reaches + at.first[g / GROUP] + i;
				*to = psr_choose(at.is_here[g + i], light, *to);
			}
	}
	return is_lit;
}

static inline float steady(float before, float here, float after)
{
	const float a = here - before, b = after - here, fall = magnitude(a), next = magnitude(b);

	return psr_where((a > 0) == (b > 0), psr_choose(fall < next, fall, next));
}

static inline uint16_t cell_of(float z, float from, float per_step)
{
	const float steps = (z - from) * per_step, least = psr_where(steps > 0, steps);
	const int32_t up = (int32_t)psr_choose(least < SHADOW_EMPTY - 2, least, SHADOW_EMPTY - 2) + 1;

	return (uint16_t)(z < __builtin_inff() ? up : SHADOW_EMPTY);
}

static void shadow_sink(uint16_t *restrict to, const struct shadow_rows *rows, uint32_t n, float from, float step)
{
	const float *above = rows->above, *own = rows->own, *below = rows->below;
	const float per_step = 1 / step;

	to[0] = cell_of(own[0], from, per_step);
	for (uint32_t i = 1; i < n - 1; i++) {
		const float here = own[i];
		const float fall = steady(own[i - 1], here, own[i + 1]) + steady(above[i], here, below[i]);

		to[i] = cell_of(psr_choose(here < __builtin_inff(), here + fall, here), from, per_step);
	}
	to[n - 1] = cell_of(own[n - 1], from, per_step);
}
