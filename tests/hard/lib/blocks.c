#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/random.h"
#include "base/vec.h"
#include "blocks.h"

#define ROW 0.86602540378443864676 /* of a lattice, in steps of a column */

void hard_direction(double d[3], uint64_t *seed)
{
	do
		for (int k = 0; k < 3; k++)
			d[k] = random_in(seed, -1, 1);
	while (!(v3d_dot(d, d) <= 1 && v3d_normalize(d, d) > 0.01));
}

/* What a model is made of, but for its counts. */
struct arrays {
	struct psr_cluster *cluster;
	struct psr_run *run;
	int16_t *center[3];
	uint16_t *radius, *offset, *depth;
	int8_t *cone[3];
	uint8_t *projection, *flags, *sine, *traits;
	uint64_t *mask, *attr;
};

static void *room(size_t n, size_t size)
{
	void *memory = calloc(n + 64, size);

	assert_non_null(memory);
	return memory;
}

static void arrays_init(struct arrays *a, uint32_t n)
{
	a->cluster = room(n, sizeof *a->cluster);
	a->run = room(n, sizeof *a->run);
	for (int k = 0; k < 3; k++) {
		a->center[k] = room(n, sizeof *a->center[k]);
		a->cone[k] = room(n, 1);
	}
	a->radius = room(n, sizeof *a->radius);
	a->offset = room(n, sizeof *a->offset);
	a->depth = room(64 * (size_t)n, sizeof *a->depth);
	a->projection = room(n, 1);
	a->flags = room(n, 1);
	a->sine = room(n, 1);
	a->traits = room(n, 1);
	a->mask = room(n, sizeof *a->mask);
	a->attr = room(64 * (size_t)n, sizeof *a->attr);
}

static void arrays_fini(struct arrays *a)
{
	for (int k = 0; k < 3; k++) {
		free(a->center[k]);
		free(a->cone[k]);
	}
	free(a->cluster);
	free(a->run);
	free(a->radius);
	free(a->offset);
	free(a->depth);
	free(a->projection);
	free(a->flags);
	free(a->sine);
	free(a->traits);
	free(a->mask);
	free(a->attr);
}

/* Places block b, whose samples begin at `first`. Returns how many it has. */
static uint32_t place_block(struct arrays *a, const struct psr_projection *projections, const struct hard_block *from,
                            uint32_t b, uint32_t first)
{
	const struct psr_projection *p = &projections[from->projection];
	const double dx = (double)p->spacing * (1 << from->level);
	double low = INFINITY, high = -INFINITY, center[3], axis[3][3];
	uint32_t n = 0;

	for (int i = 0; i < 64; i++) {
		if (!(from->mask >> i & 1))
			continue;
		low = fmin(low, from->depth[i]);
		high = fmax(high, from->depth[i]);
	}
	for (int i = 0; i < 9; i++)
		axis[i / 3][i % 3] = (double)p->axis[i / 3][i % 3];
	m3d_apply_transposed(center, (const double(*)[3])axis,
	                     (const double[3]){ (from->col + 3.75) * dx, (from->row + 3.5) * dx * ROW, (low + high) / 2 });
	for (int k = 0; k < 3; k++) {
		assert_true(fabs(center[k]) < 2);
		a->center[k][b] = (int16_t)rint(center[k] * 0x1p14);
		a->cone[k][b] = from->cone[k];
	}
	a->projection[b] = (uint8_t)from->projection;
	a->sine[b] = from->cone_sine;
	a->traits[b] = from->traits;
	a->mask[b] = from->mask;
	a->flags[b] = (uint8_t)(from->flags | from->level);

	/* The centre is off by half of 2^-14 along each axis. */
	const double reach = sqrt(3.75 * 3.75 + 3.5 * ROW * 3.5 * ROW) * dx + (high - low) / 2 + dx / 2 + 0x1p-14;
	assert_true(reach < 2);
	a->radius[b] = (uint16_t)fmin(65535, ceil(reach * 0x1p15));
	struct psr_place place;
	const struct psr_blocks blocks = { .projection = projections, .sphere_x = a->center[0], .sphere_y = a->center[1],
		                               .sphere_z = a->center[2], .block_projection = a->projection,
		                               .flags = a->flags };
	psr_blocks_place(&blocks, b, &place);
	assert_true(place.col == (double)from->col * (1 << from->level)
	            && place.row == (double)from->row * (1 << from->level));
	unsigned shift = 29;
	while (fmax(high - place.z, place.z - low) * (double)(1u << shift) > 32767)
		shift--;
	assert_true(shift >= 14);
	a->flags[b] |= (uint8_t)((shift - 14) << 3);
	for (int i = 0; i < 64; i++) {
		if (!(from->mask >> i & 1))
			continue;
		a->depth[first + n] = (uint16_t)((from->depth[i] - place.z) * (double)(1u << shift) + 32768.5);
		a->attr[first + n++] = from->attr[i];
	}
	return n;
}

struct psr_model *hard_model(const struct hard_model *options, const struct hard_block *block, uint32_t n)
{
	struct arrays a;
	struct psr_blocks blocks = { .n_blocks = n, .n_projections = options->n_projections,
		                         .projection = options->projection };
	struct psr_model_info info = { .scale = options->scale > 0 ? options->scale : 1, .spacing = options->spacing,
		                           .tolerance = 0.4, .resolution = 1024, .up = { 0, 1, 0 }, .builder = "test" };
	struct psr_model *model;
	struct psr_error err;

	arrays_init(&a, n);
	for (uint32_t b = 0; b < n; b++) {
		const struct hard_block *from = &block[b];

		if (b % PSR_RUN_BLOCKS == 0)
			a.run[b / PSR_RUN_BLOCKS].attr_first = (uint32_t)blocks.n_samples;
		a.offset[b] = (uint16_t)(blocks.n_samples - a.run[b / PSR_RUN_BLOCKS].attr_first);
		blocks.n_samples += place_block(&a, options->projection, from, b, (uint32_t)blocks.n_samples);
		if (b == 0 || from->group != block[b - 1].group || from->level != block[b - 1].level)
			a.cluster[blocks.n_clusters++] = (struct psr_cluster){ .first_block = b, .group = from->group,
				                                                   .level = (uint8_t)from->level };
		a.cluster[blocks.n_clusters - 1].n_blocks++;
		blocks.n_levels = from->level >= blocks.n_levels ? from->level + 1 : blocks.n_levels;
		if (from->traits)
			blocks.traits = a.traits;
	}
	blocks.cluster = a.cluster;
	blocks.run = a.run;
	blocks.sphere_x = a.center[0];
	blocks.sphere_y = a.center[1];
	blocks.sphere_z = a.center[2];
	blocks.sphere_r = a.radius;
	blocks.block_projection = a.projection;
	blocks.flags = a.flags;
	blocks.mask = a.mask;
	blocks.attr_offset = a.offset;
	blocks.depth = a.depth;
	blocks.attr = a.attr;
	if (options->with_cones) {
		blocks.cone_x = a.cone[0];
		blocks.cone_y = a.cone[1];
		blocks.cone_z = a.cone[2];
		blocks.cone_sine = a.sine;
	}
	/* Spheres about a cluster's first block, wide enough for all. */
	for (uint32_t i = 0; i < blocks.n_clusters; i++) {
		struct psr_cluster *k = &a.cluster[i];
		float center[3], c[3], r, reach = 0;

		psr_blocks_sphere(&blocks, k->first_block, center, &r);
		for (uint32_t b = k->first_block; b < k->first_block + k->n_blocks; b++) {
			psr_blocks_sphere(&blocks, b, c, &r);
			v3f_sub(c, c, center);
			reach = fmaxf(reach, (v3f_length(c) + r) * 1.00001f);
		}
		memcpy(k->center, center, sizeof center);
		k->radius = reach;
	}
	for (int k = 0; k < 3; k++) {
		info.origin[k] = options->origin[k];
		info.box_min[k] = info.origin[k] - info.scale;
		info.box_max[k] = info.origin[k] + info.scale;
	}
	for (uint32_t p = 0; p < options->n_projections && !(options->spacing > 0); p++)
		info.spacing = fmax(info.spacing, (double)options->projection[p].spacing * info.scale);
	if (psr_model_create(&model, &info, &blocks, NULL, &err))
		fail_msg("%s", err.text);
	arrays_fini(&a);
	return model;
}

struct psr_projection hard_projection(double x, double y, double z, double spacing)
{
	struct psr_projection projection = { .spacing = (float)spacing };
	double dir[3] = { x, y, z }, axis[3][3];

	v3d_normalize(dir, dir);
	psr_direction_basis(dir, axis);
	for (int i = 0; i < 9; i++)
		projection.axis[i / 3][i % 3] = (float)axis[i / 3][i % 3];
	return projection;
}

uint64_t hard_attr(const double normal[3], uint32_t specular, uint32_t exponent)
{
	const float n[3] = { (float)normal[0], (float)normal[1], (float)normal[2] };

	return psr_direction_encode(n) | (uint64_t)0xffffff << 16 | (uint64_t)specular << 40 | (uint64_t)exponent << 56;
}

struct psr_model *hard_random_model(uint64_t *seed, uint32_t n_blocks, double spacing, double deep)
{
	struct psr_projection projection[16];
	struct hard_block *block = room(n_blocks, sizeof *block);
	const struct hard_model options = { .projection = projection, .n_projections = 16 };
	struct psr_model *model;

	for (int p = 0; p < 16; p++) {
		const double x = random_in(seed, -1, 1), y = random_in(seed, -1, 1), z = random_in(seed, 0.01, 1);

		projection[p] = hard_projection(x, y, z, spacing);
	}
	for (uint32_t b = 0; b < n_blocks; b++) {
		const int32_t most = (int32_t)(0.5 / spacing);
		const double z = random_in(seed, -0.5, 0.5);

		block[b].projection = random_below(seed, 16);
		block[b].col = (int)random_below(seed, 2 * (uint32_t)most) - most;
		block[b].row = 2 * ((int)random_below(seed, (uint32_t)most) - most / 2);
		block[b].mask = random_below(seed, 4) ? UINT64_MAX : random_next(seed) | 1;
		block[b].flags = PSR_BLOCK_TWO_SIDED;
		for (int i = 0; i < 64; i++) {
			block[b].depth[i] = z + random_in(seed, 0, deep);
			block[b].attr[i] = hard_attr((const double[3]){ 0, 0, 1 }, 0, 0);
		}
	}
	model = hard_model(&options, block, n_blocks);
	free(block);
	return model;
}

struct psr_model *hard_sheet(const struct hard_sheet *sheet)
{
	const struct psr_projection projection = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, (float)sheet->spacing };
	const struct hard_model options = { .projection = &projection, .n_projections = 1 };
	const unsigned top = sheet->levels - 1;
	uint32_t n = 0, n_of_group = 0;

	for (unsigned l = 0; l <= top; l++)
		n_of_group += 1u << 2 * (top - l);
	struct hard_block *block = room((size_t)(sheet->groups * sheet->groups) * n_of_group, sizeof *block);
	for (int g = 0; g < sheet->groups * sheet->groups; g++)
		for (unsigned l = 0; l <= top; l++)
			for (int i = 0; i < 1 << 2 * (top - l); i++) {
				const int side = 1 << (top - l), x = g % sheet->groups * side + i % side,
						  y = g / sheet->groups * side + i / side;
				struct hard_block *b = &block[n++];

				b->level = l;
				b->group = (uint32_t)g;
				b->col = 8 * x - 4 * sheet->groups * side;
				b->row = 8 * y - 4 * sheet->groups * side;
				b->mask = UINT64_MAX;
				b->flags = PSR_BLOCK_TWO_SIDED;
				for (int s = 0; s < 64; s++) {
					b->depth[s] = sheet->z;
					b->attr[s] = sheet->attr;
				}
			}
	struct psr_model *model = hard_model(&options, block, n);
	free(block);
	return model;
}

void hard_position(double at[3], const struct psr_blocks *b, uint32_t block, uint32_t sample)
{
	const struct psr_projection *p = &b->projection[b->block_projection[block]];
	const double dx = (double)p->spacing, level = 1u << psr_blocks_level(b, block);
	const uint64_t below = b->mask[block] & ((UINT64_C(1) << sample) - 1);
	const uint16_t depth = b->depth[psr_blocks_attr_first(b, block) + (uint32_t)__builtin_popcountll(below)];
	struct psr_place place;

	psr_blocks_place(b, block, &place);
	const double x = (place.col + level * ((sample & 7) + (sample >> 3 & 1) * 0.5)) * dx;
	const double y = (place.row + level * (sample >> 3)) * dx * ROW, z = place.z + (double)place.step * (depth - 32768);
	for (int k = 0; k < 3; k++)
		at[k] = x * (double)p->axis[0][k] + y * (double)p->axis[1][k] + z * (double)p->axis[2][k];
}

struct psr_instance hard_place(const struct psr_model *model)
{
	return (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
}

static void check_frame(const struct psr_frame *frame)
{
	const size_t n = (size_t)frame->width * frame->height;

	for (size_t i = 0; i < n; i++)
		if (!(frame->depth[i] > 0))
			fail_msg("pixel %zu has the depth %g", i, (double)frame->depth[i]);
	for (size_t i = 0; i < n && frame->words != NULL; i++)
		if (frame->words[i] != PSR_WORD_EMPTY && frame->words[i] >> 32 >= 0x7f800000)
			fail_msg("pixel %zu has the word %#llx", i, (unsigned long long)frame->words[i]);
	assert_true(frame->report.error_px >= 0 && isfinite(frame->report.error_px));
}

struct psr_renderer *hard_renderer(void)
{
	static struct psr_renderer *renderer;

	if (renderer == NULL)
		assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	return renderer;
}

static void end(const struct psr_frame *frame, int rc, const struct psr_error *err)
{
	if (rc)
		fail_msg("%s", err->text);
	check_frame(frame);
}

void hard_draw_with(struct psr_frame *frame, const struct psr_scene *scene, const struct render_settings *settings)
{
	struct psr_error err;

	assert_int_equal(psr_frame_alloc(frame, settings->width, settings->height, HARD_ALL_PLANES, NULL), PSR_OK);
	end(frame, renderer_draw(hard_renderer(), scene, settings, NULL, frame, &err), &err);
}

void hard_draw(struct psr_frame *frame, const struct psr_scene *scene, uint32_t width, uint32_t height)
{
	struct render_settings settings;

	render_settings_default(&settings, width, height);
	hard_draw_with(frame, scene, &settings);
}

void hard_draw_pass(struct psr_frame *frame, const struct psr_scene *scene, const struct psr_settings *settings)
{
	const unsigned planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH;
	struct psr_error err;

	assert_int_equal(psr_frame_alloc(frame, settings->width, settings->height, planes, NULL), PSR_OK);
	end(frame, psr_render(hard_renderer(), scene, settings, NULL, frame, &err), &err);
}

void hard_same_planes(const struct psr_frame *a, const struct psr_frame *b, unsigned planes)
{
	for (unsigned p = 0; p < PSR_N_PLANES; p++)
		if (planes >> p & 1)
			assert_memory_equal(psr_frame_plane(a, p), psr_frame_plane(b, p),
			                    psr_plane_bytes(p) * a->width * a->height);
}
