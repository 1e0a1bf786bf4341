#include <math.h>
#include <stdio.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "base/direction.h"
#include "shapes.h"
#include "model/blocks.h"

struct arrays {
	uint32_t n_blocks, n_samples;
	struct psr_run *run;
	int16_t *center[3];
	uint16_t *radius, *offset, *depth;
	int8_t *cone[3];
	uint8_t *projection, *flags, *cone_sine;
	uint64_t *mask, *attr;
};

struct sample {
	int valid;
	double depth, normal[3];
};

/* Twice as much at a time: sanitizers move what grows, each time. */
static void *grow(void *p, size_t n, size_t size)
{
	if (p && malloc_usable_size(p) >= n * size)
		return p;
	p = realloc(p, 2 * n * size);
	if (!p)
		abort();
	return p;
}

/* The shape along the projection's ray through (x, y); only where it faces the projection well. */
static struct sample trace(const double axis[3][3], double x, double y, double radius)
{
	struct sample s = { 0 };
	if (radius > 0) {
		double z2 = radius * radius - x * x - y * y;
		if (z2 <= 0)
			return s;
		s.depth = sqrt(z2);
		for (int k = 0; k < 3; k++)
			s.normal[k] = (x * axis[0][k] + y * axis[1][k] + s.depth * axis[2][k]) / radius;
		s.valid = s.depth / radius > 0.8; /* no normal is further than 32.4 degrees from the nearest projection */
		return s;
	}
	if (axis[2][2] < 0.8)
		return s;
	s.depth = -(x * axis[0][2] + y * axis[1][2]) / axis[2][2];
	double p[3];
	for (int k = 0; k < 3; k++)
		p[k] = x * axis[0][k] + y * axis[1][k] + s.depth * axis[2][k];
	s.valid = fabs(p[0]) <= 0.7 && fabs(p[1]) <= 0.7;
	return s;
}

static void add_block(struct arrays *a, const struct shape_options *o, const struct psr_projection *projection, int p,
                      const double axis[3][3], double dx, int col, int row, double radius)
{
	struct sample s[64];
	double low = INFINITY, high = -INFINITY;
	uint64_t mask = 0;
	for (int i = 0; i < 64; i++) {
		int r = 8 * row + i / 8, c = 8 * col + i % 8;
		s[i] = trace(axis, (c + (r & 1) * 0.5) * dx, r * dx * sqrt(0.75), radius);
		if (radius <= 0)
			v3d_set(s[i].normal, sin(o->tilt), 0, cos(o->tilt));
		if (!s[i].valid)
			continue;
		mask |= UINT64_C(1) << i;
		low = fmin(low, s[i].depth);
		high = fmax(high, s[i].depth);
	}
	if (!mask)
		return;
	uint32_t b = a->n_blocks++;
	for (int k = 0; k < 3; k++) {
		a->center[k] = grow(a->center[k], a->n_blocks, 2);
		a->cone[k] = grow(a->cone[k], a->n_blocks, 1);
	}
	a->radius = grow(a->radius, a->n_blocks, 2);
	a->cone_sine = grow(a->cone_sine, a->n_blocks, 1);
	a->projection = grow(a->projection, a->n_blocks, 1);
	a->flags = grow(a->flags, a->n_blocks, 1);
	a->mask = grow(a->mask, a->n_blocks, 8);
	a->offset = grow(a->offset, a->n_blocks, 2);
	a->run = grow(a->run, b / PSR_RUN_BLOCKS + 1, sizeof *a->run);
	a->attr = grow(a->attr, a->n_samples + 64, 8);
	a->depth = grow(a->depth, a->n_samples + 64, 2);

	double middle[3] = { (8 * col + 3.75) * dx, (8 * row + 3.5) * dx * sqrt(0.75), (low + high) / 2 }, center[3];
	m3d_apply_transposed(center, axis, middle);
	for (int k = 0; k < 3; k++)
		a->center[k][b] = (int16_t)rint(center[k] * 0x1p14);
	/* The center is off by half of 2^-14 along each axis. */
	a->radius[b] = (uint16_t)ceil((sqrt(3.75 * 3.75 + 3.04 * 3.04) * dx + (high - low) / 2 + dx + 0x1p-14) * 0x1p15);
	/* A cap that holds the normals: around their mean, rounded, a little wider than the furthest of them. */
	double mean[3] = { 0 }, least = 1, greatest = 0;
	for (int i = 0; i < 64; i++)
		if (s[i].valid)
			v3d_add(mean, mean, s[i].normal);
	for (int k = 0; k < 3; k++)
		greatest = fmax(greatest, fabs(mean[k]));
	for (int k = 0; k < 3; k++) {
		mean[k] = rint(mean[k] / greatest * 127);
		a->cone[k][b] = (int8_t)mean[k];
	}
	v3d_normalize(mean, mean);
	for (int i = 0; i < 64; i++)
		if (s[i].valid)
			least = fmin(least, v3d_dot(mean, s[i].normal));
	least = fmax(0, least - 1e-6);
	a->cone_sine[b] = (uint8_t)ceil(sqrt(1 - least * least) * 255);
	a->projection[b] = (uint8_t)p;
	a->flags[b] = 0;
	struct psr_place place;
	psr_blocks_place(&(struct psr_blocks){ .projection = projection, .sphere_x = a->center[0], .sphere_y = a->center[1],
	                                       .sphere_z = a->center[2], .block_projection = a->projection,
	                                       .flags = a->flags }, b, &place);
	unsigned shift = 29;
	while (fmax(high - place.z, place.z - low) * (double)(1u << shift) > 32767)
		shift--;
	a->flags[b] = (uint8_t)((shift - 14) << 3 | (o->two_sided ? PSR_BLOCK_TWO_SIDED : 0));
	a->mask[b] = mask;
	if (b % PSR_RUN_BLOCKS == 0)
		a->run[b / PSR_RUN_BLOCKS] = (struct psr_run){ .attr_first = a->n_samples };
	a->offset[b] = (uint16_t)(a->n_samples - a->run[b / PSR_RUN_BLOCKS].attr_first);
	for (int i = 0; i < 64; i++) {
		if (!s[i].valid)
			continue;
		a->depth[a->n_samples] = (uint16_t)((s[i].depth - place.z) * (double)(1u << shift) + 32768.5);
		float n[3] = { (float)s[i].normal[0], (float)s[i].normal[1], (float)s[i].normal[2] };
		a->attr[a->n_samples++] = psr_direction_encode(n) | (uint64_t)(o->unlit != 0) << 15 |
		                          (uint64_t)o->diffuse << 16 | (uint64_t)o->metallic << 40 |
		                          (uint64_t)o->reflectance << 45 | (uint64_t)o->shut << 50 |
		                          (uint64_t)o->roughness << 56;
	}
}

struct psr_model *shape_build(const struct shape_options *o, double radius)
{
	struct arrays a;
	struct psr_projection projection[PSR_PROJECTIONS];
	double ds = 2.0 / o->resolution, dx = ds * cos(25 * 3.14159265358979 / 180);
	int reach = (int)(1.2 / (8 * dx)) + 2;
	memset(&a, 0, sizeof a);
	for (int p = 0; p < PSR_PROJECTIONS; p++) {
		double dir[3], axis[3][3];
		psr_direction_center(1, (unsigned)p, dir);
		psr_direction_basis(dir, axis);
		for (int i = 0; i < 9; i++)
			projection[p].axis[i / 3][i % 3] = (float)axis[i / 3][i % 3];
		projection[p].spacing = (float)dx;
		for (int row = -reach; row < reach; row++)
			for (int col = -reach; col < reach; col++)
				add_block(&a, o, projection, p, (const double(*)[3])axis, dx, col, row, radius);
	}
	struct psr_cluster cluster = { .center = { 0, 0, 0 }, .radius = 1.5f, .n_blocks = a.n_blocks };
	struct psr_blocks blocks = {
		.n_blocks = a.n_blocks, .n_projections = PSR_PROJECTIONS, .n_clusters = 1, .n_levels = 1,
		.n_samples = a.n_samples, .projection = projection, .cluster = &cluster, .run = a.run,
		.sphere_x = a.center[0], .sphere_y = a.center[1], .sphere_z = a.center[2], .sphere_r = a.radius,
		.block_projection = a.projection, .flags = a.flags, .mask = a.mask,
		.attr_offset = a.offset, .depth = a.depth, .attr = a.attr,
	};
	if (o->cones) {
		blocks.cone_x = a.cone[0];
		blocks.cone_y = a.cone[1];
		blocks.cone_z = a.cone[2];
		blocks.cone_sine = a.cone_sine;
	}
	struct psr_model_info info = { .scale = o->scale,
		                           .spacing = ds * o->scale,
		                           .tolerance = 25 * 3.14159265358979 / 180,
		                           .resolution = o->resolution,
		                           .builder = "test" };
	for (int k = 0; k < 3; k++) {
		info.origin[k] = o->origin[k];
		info.box_min[k] = o->origin[k] - o->scale;
		info.box_max[k] = o->origin[k] + o->scale;
	}
	struct psr_model *model;
	struct psr_error err;
	if (psr_model_create(&model, &info, &blocks, NULL, &err)) {
		fprintf(stderr, "%s\n", err.text);
		abort();
	}
	for (int k = 0; k < 3; k++) {
		free(a.center[k]);
		free(a.cone[k]);
	}
	free(a.radius);
	free(a.cone_sine);
	free(a.projection); free(a.depth);
	free(a.run); free(a.flags); free(a.mask); free(a.offset); free(a.attr);
	return model;
}
