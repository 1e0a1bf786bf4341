#include <assert.h>
#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "cone.h"
#include "pack_block.h"

/* Spheres are made from rounded positions; this much more holds the exact ones (a few roundings of 2^-24 each). */
#define SLACK 0x1p-21

void pack_box(const struct draft *draft, const struct draft_block *block, double min[3], double max[3])
{
	v3d_set(min, INFINITY, INFINITY, INFINITY);
	v3d_set(max, -INFINITY, -INFINITY, -INFINITY);
	for (uint64_t left = block->part; left != 0; left &= left - 1) {
		double p[3];

		draft_project(draft, block, (unsigned)__builtin_ctzll(left), p);
		for (int k = 0; k < 3; k++) {
			min[k] = p[k] < min[k] ? p[k] : min[k];
			max[k] = p[k] > max[k] ? p[k] : max[k];
		}
	}
}

static void place_of(const struct pack *pack, uint32_t i, struct psr_place *place)
{
	const struct psr_blocks blocks = { .projection = pack->draft->projection, .sphere_x = pack->center[0],
		                               .sphere_y = pack->center[1], .sphere_z = pack->center[2],
		                               .block_projection = pack->block_projection, .flags = pack->flags };

	psr_blocks_place(&blocks, i, place);
}

static double clamp(double x, double middle, double reach)
{
	return x < middle - reach ? middle - reach : x > middle + reach ? middle + reach : x;
}

/* The sphere's center: the middle of the box, half a column or a row off the middle of the block's window at most,
 * less as much as rounding may move it: 0.87 of 2^-14, and 2^-20 for axes of single precision. */
static void center_block(struct pack *pack, uint32_t i, const struct draft_block *block, const double min[3],
                         const double max[3])
{
	const double spacing = draft_spacing(pack->draft, block), off = 0.87 * 0x1p-14 + 0x1p-20;
	const double pitch = 0.86602540378443864676 * spacing;
	const double x = clamp((min[0] + max[0]) / 2, (block->col + 3.75) * spacing, spacing / 2 - off);
	const double y = clamp((min[1] + max[1]) / 2, (block->row + 3.5) * pitch, pitch - off);
	double center[3];
	struct psr_place place;

	projection_inner(&pack->draft->projection[block->projection], x, y, (min[2] + max[2]) / 2, center);
	for (int k = 0; k < 3; k++) {
		double rounded = rint(center[k] * 0x1p14);

		assert(fabs(rounded) <= INT16_MAX);
		pack->center[k][i] = (int16_t)rounded;
	}
	place_of(pack, i, &place);
	assert(place.col == (double)block->col * (1u << block->level));
	assert(place.row == (double)block->row * (1u << block->level));
}

/* Quantises depths to 16 bits, in the least step, a power of two, that reaches all of them from the center's. */
static void quantise(struct pack *pack, uint32_t i, uint32_t at, const struct draft_block *block, double min,
                     double max)
{
	unsigned shift = 14 + (PSR_BLOCK_DEPTH >> 3);
	struct psr_place place;
	double middle, range;

	place_of(pack, i, &place);
	middle = place.z;
	range = max - middle > middle - min ? max - middle : middle - min;
	while (range * (double)(1u << shift) > INT16_MAX)
		shift--;
	assert(shift >= 14);
	for (uint64_t left = block->part; left != 0; left &= left - 1, at++) {
		const struct draft_sample *sample = draft_sample(pack->draft, block, (unsigned)__builtin_ctzll(left));

		pack->depth[at] = (uint16_t)rint(((double)sample->z - middle) * (double)(1u << shift) + 32768);
		pack->attr[at] = sample->attr;
	}
	pack->flags[i] |= (uint8_t)((shift - 14) << 3);
}

/* Holds the samples as they will be read back, and half a step more. Center and radius fit: a pixel ds is at most 1/4
 * (at resolution 8), and a sample stands on the surface, which is within the unit sphere, or was moved by up to 0.55
 * ds: within 1.1375. So along each axis of the projection the middle is, which makes 1.1375 sqrt(3) = 1.97 < 2 at
 * most. Half of the box is at most 3.75 by 3.04 steps of at most ds, and 1.1375 deep: with half a step more, 1.79 < 2.
 * */
static void bound_block(struct pack *pack, uint32_t i, uint32_t at, const struct draft_block *block)
{
	const struct psr_projection *projection = &pack->draft->projection[block->projection];
	struct psr_place place;
	double radius = 0;

	place_of(pack, i, &place);
	for (uint64_t left = block->part; left != 0; left &= left - 1, at++) {
		double p[3], position[3], squared = 0;

		draft_project(pack->draft, block, (unsigned)__builtin_ctzll(left), p);
		projection_inner(projection, p[0], p[1], (double)psr_place_depth(&place, pack->depth[at]), position);
		for (int k = 0; k < 3; k++) {
			double d = position[k] - pack->center[k][i] * 0x1p-14;

			squared += d * d;
			if (block->level != 0)
				continue;
			pack->box_min[k] = position[k] < pack->box_min[k] ? position[k] : pack->box_min[k];
			pack->box_max[k] = position[k] > pack->box_max[k] ? position[k] : pack->box_max[k];
		}
		radius = squared > radius ? squared : radius;
	}
	radius = ceil(((sqrt(radius) + draft_spacing(pack->draft, block) / 2) * (1 + SLACK) + SLACK) * 0x1p15);
	assert(radius <= UINT16_MAX);
	pack->radius[i] = (uint16_t)radius;
}

/* The cone holds the normals of the faces, and the samples' own, by which the renderer draws, unless the block is bent.
 * A block that is seen from both sides needs a cone only if it is bent: the renderer leaves out no single sample of a
 * bent block. */
static void bound_normals(struct pack *pack, uint32_t i, const struct draft_block *block)
{
	const float (*direction)[3] = psr_direction_table();
	float normal[2 * PSR_BLOCK_SAMPLES][3];
	const int is_bent = block->traits & PSR_BLOCK_BENT;
	int8_t axis[3];
	int n = 0;

	for (uint64_t left = block->two_sided && !is_bent ? 0 : block->part; left != 0; left &= left - 1) {
		const struct draft_sample *sample = draft_sample(pack->draft, block, (unsigned)__builtin_ctzll(left));
		const float *front = ray_scene_normal(pack->scene, sample->surface & ~SURFACE_BACK);

		v3f_scale(normal[n++], front, (sample->surface & SURFACE_BACK) != 0 ? -1 : 1);
		if (!is_bent)
			memcpy(normal[n++], direction[PSR_ATTR_NORMAL(sample->attr)], sizeof *normal);
	}
	cone_pack((const float(*)[3])normal, n, axis, &pack->cone_sine[i]);
	for (int k = 0; k < 3; k++)
		pack->cone[k][i] = axis[k];
}

/* The opacity of glass at a sample, filtered as its attributes are. */
static uint8_t find_opacity(const struct pack *pack, const struct draft_block *block, unsigned s)
{
	uint32_t surface = draft_sample(pack->draft, block, s)->surface;
	struct surface_place place = { .prim = surface & ~SURFACE_BACK, .is_back = (surface & SURFACE_BACK) != 0 };
	double p[3], pixel = pack->draft->ds * (double)(1u << block->level);
	struct ray ray;

	draft_project(pack->draft, block, s, p);
	sheets_ray(&pack->draft->projection[block->projection], p[0], p[1], &ray);
	ray_locate(pack->scene, &ray, place.prim, &place.u, &place.v);
	return (uint8_t)(surface_opacity(pack->surface, &place, 1.4142135623730951 * pixel) * 255 + 0.5f);
}

static void find_opacities(struct pack *pack, uint32_t at, const struct draft_block *block)
{
	const int is_glass = (block->traits & (PSR_BLOCK_SHEER | PSR_BLOCK_THIN)) == PSR_BLOCK_SHEER;

	for (uint64_t left = block->part; left != 0; left &= left - 1, at++) {
		const unsigned s = (unsigned)__builtin_ctzll(left);

		pack->opacity[at] = is_glass ? find_opacity(pack, block, s) : draft_sample(pack->draft, block, s)->opacity;
	}
}

static void place_block(struct pack *pack, uint32_t i, const struct draft_block *block)
{
	if (i % PSR_RUN_BLOCKS == 0)
		pack->run[i / PSR_RUN_BLOCKS] = (struct psr_run){ .attr_first = pack->n_samples };
	pack->block_projection[i] = block->projection;
	pack->flags[i] = (uint8_t)(block->level | (block->two_sided ? PSR_BLOCK_TWO_SIDED : 0));
	pack->traits[i] = block->traits;
	pack->mask[i] = block->part;
	pack->attr_offset[i] = (uint16_t)(pack->n_samples - pack->run[i / PSR_RUN_BLOCKS].attr_first);
}

void pack_block(struct pack *pack, uint32_t i, const struct draft_block *block)
{
	double min[3], max[3];

	place_block(pack, i, block);
	pack_box(pack->draft, block, min, max);
	center_block(pack, i, block, min, max);
	quantise(pack, i, pack->n_samples, block, min[2], max[2]);
	bound_block(pack, i, pack->n_samples, block);
	bound_normals(pack, i, block);
	find_opacities(pack, pack->n_samples, block);
	pack->n_samples += (uint32_t)__builtin_popcountll(block->part);
}

void pack_bound_cluster(const struct psr_blocks *blocks, struct psr_cluster *cluster)
{
	float min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };

	for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
		float c[3], r;

		psr_blocks_sphere(blocks, i, c, &r);
		for (int k = 0; k < 3; k++) {
			min[k] = c[k] - r < min[k] ? c[k] - r : min[k];
			max[k] = c[k] + r > max[k] ? c[k] + r : max[k];
		}
	}
	for (int k = 0; k < 3; k++)
		cluster->center[k] = (min[k] + max[k]) / 2;
	for (uint32_t i = cluster->first_block; i < cluster->first_block + cluster->n_blocks; i++) {
		float d[3], r, reach;

		psr_blocks_sphere(blocks, i, d, &r);
		v3f_sub(d, d, cluster->center);
		reach = (v3f_length(d) + r) * (1 + (float)SLACK) + (float)SLACK;
		cluster->radius = reach > cluster->radius ? reach : cluster->radius;
	}
}
