/* Leaves of octrees as discs. */
#include <stddef.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "block.h"
#include "splat_disc.h"
#include "simd/cube.h"

/* No point of a surface is further than half a diagonal from the middle of the leaf that holds it, nor from that leaf's
 * sample on the surface. In edges. */
#define RADIUS ((float)(CUBES_DIAGONAL / 2))

/* Finds two unit vectors at right angles to each other and to n, which has length 1. */
static void find_tangents(float tangent[2][3], const float n[3])
{
	int least = 0;

	for (int k = 1; k < 3; k++)
		least = __builtin_fabsf(n[k]) < __builtin_fabsf(n[least]) ? k : least;
	const float axis[3] = { least == 0, least == 1, least == 2 };
	v3f_cross(tangent[0], n, axis);
	v3f_scale(tangent[0], tangent[0], 1 / __builtin_sqrtf(v3f_dot(tangent[0], tangent[0])));
	v3f_cross(tangent[1], n, tangent[0]);
}

/* Finds the radii of a disc in the picture. */
static void project_disc(struct discs *d, uint32_t lane, const float tangent[2][3], const float axis[3][3],
                         int perspective)
{
	const float u = d->at[0][lane], v = d->at[1][lane], inverse = perspective ? 1 / d->at[2][lane] : 1;

	for (int i = 0; i < 2; i++) {
		float h[3];

		for (int a = 0; a < 3; a++)
			h[a] = v3f_dot(axis[a], tangent[i]);
		d->radius[i][0][lane] = perspective ? (h[0] - u * h[2]) * inverse : h[0];
		d->radius[i][1][lane] = perspective ? (h[1] - v * h[2]) * inverse : h[1];
		d->radius[i][2][lane] = h[2];
	}
}

void splat_cube(const struct splat_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->plan->warp[entry->instance];
	const float(*normals)[3] = psr_direction_table();
	const uint32_t *tens = psr_direction_tens();
	const int perspective = t->plan->perspective;
	struct discs discs;
	struct warp_cube cube;
	uint32_t k = 0;

	warp_cube_make(&cube, in, entry->slot);
	const struct warp_octants *octants = cube.octants;
	const struct psr_cubes *cubes = in->cubes->model;
	const unsigned width = psr_blocks_level(&cubes->groups, entry->slot - in->first_slot);
	const float edge = (float)(cubes->level[0].edge * (double)(1u << width));
	float axis[3][3]; /* of a disc's radius */
	for (int a = 0; a < 3; a++)
		for (int c = 0; c < 3; c++)
			axis[a][c] = RADIUS * edge * (float)in->cubes->axis[a][c];
	memset(&discs, 0, offsetof(struct discs, share)); /* lanes without a leaf */
	discs.id = cube.id;
	discs.rim = RIM_DEPTH * edge * t->plan->instance[entry->instance].cull.scale;
	discs.most = (float)((1 << entry->level) + 2);
	for (uint64_t left = cube.mask; left; left &= left - 1, k++) {
		const uint32_t lane = (uint32_t)__builtin_ctzll(left);
		float p[3], d[3], sight[3], tangent[2][3];

		for (int a = 0; a < 3; a++)
			p[a] = (float)(cube.origin[a] + octants->row[a][lane >> 3]) + octants->col[a][lane & 7];
		if (cube.offset != NULL) {
			float n[3];

			warp_normal(n, tens[cube.normal[k]]);
			for (int a = 0; a < 3; a++)
				p[a] += warp_offset(octants, a, n, (float)(2 * cube.offset[k] - WARP_OFFSET_MIDDLE));
		}
		if (!(p[2] > t->plan->near_z))
			continue;
		const float inverse = perspective ? 1 / p[2] : 1;
		const float u = p[0] * inverse, v = p[1] * inverse;
		for (int c = 0; c < 3; c++)
			d[c] = (u * in->du[c] + v * in->dv[c]) + in->d0[c];
		v3f_scale(sight, d, 1 / __builtin_sqrtf(v3f_dot(d, d)));
		const float *n = cube.normal != NULL ? normals[cube.normal[k]] : sight;
		if (entry->is_mixed && faces_away(-v3f_dot(n, d), d))
			continue;
		find_tangents(tangent, n);
		discs.at[0][lane] = u;
		discs.at[1][lane] = v;
		discs.at[2][lane] = p[2];
		project_disc(&discs, lane, (const float(*)[3])tangent, (const float(*)[3])axis, perspective);
		discs.mask |= UINT64_C(1) << lane;
	}
	t->simd->discs_place(&discs, t->tile);
	splat_words(t, &discs, discs.mask, entry->level);
}
