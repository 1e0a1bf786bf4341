#include <stdlib.h>
#include <string.h>
#include "report.h"
#include "scene.h"

/* Arrays of one level, as psr_model_create() wants them. */
struct level {
	struct psr_blocks blocks;
	struct psr_projection *projection;
	struct psr_cluster *cluster;
	int16_t *sphere[3], *col, *row;
	uint16_t *radius, *block_projection, *depth;
	uint8_t *level, *flags, *cone_sine;
	int8_t *cone[3];
	float *bias, *step;
	uint64_t *mask, *attr, (*visibility)[2];
	uint32_t *attr_first;
};

static uint32_t n_samples_of(const struct psr_blocks *from, uint32_t block)
{
	return (uint32_t)__builtin_popcountll(from->mask[block]);
}

static void count(struct level *to, const struct psr_blocks *from, unsigned level)
{
	for (uint32_t k = 0; k < from->n_clusters; k++) {
		const struct psr_cluster *c = &from->cluster[k];

		if (c->level != level)
			continue;
		to->blocks.n_clusters++;
		to->blocks.n_blocks += c->n_blocks;
		for (uint32_t b = c->first_block; b < c->first_block + c->n_blocks; b++)
			to->blocks.n_samples += n_samples_of(from, b);
	}
}

static void allocate(struct level *to, const struct psr_blocks *from)
{
	const size_t n = to->blocks.n_blocks, n_samples = to->blocks.n_samples;

	to->projection = report_alloc(from->n_projections, sizeof *to->projection);
	to->cluster = report_alloc(to->blocks.n_clusters, sizeof *to->cluster);
	for (int k = 0; k < 3; k++) {
		to->sphere[k] = report_alloc(n, sizeof *to->sphere[k]);
		to->cone[k] = report_alloc(n, sizeof *to->cone[k]);
	}
	to->col = report_alloc(n, sizeof *to->col);
	to->row = report_alloc(n, sizeof *to->row);
	to->radius = report_alloc(n, sizeof *to->radius);
	to->block_projection = report_alloc(n, sizeof *to->block_projection);
	to->level = report_alloc(n, sizeof *to->level);
	to->flags = report_alloc(n, sizeof *to->flags);
	to->cone_sine = report_alloc(n, sizeof *to->cone_sine);
	to->bias = report_alloc(n, sizeof *to->bias);
	to->step = report_alloc(n, sizeof *to->step);
	to->mask = report_alloc(n, sizeof *to->mask);
	to->visibility = report_alloc(n, sizeof *to->visibility);
	to->attr_first = report_alloc(n, sizeof *to->attr_first);
	to->depth = report_alloc(n_samples + PSR_BLOCK_SAMPLES, sizeof *to->depth);
	to->attr = report_alloc(n_samples, sizeof *to->attr);
}

static void copy_block(struct level *to, uint32_t j, uint32_t *n_samples, const struct psr_blocks *from, uint32_t b)
{
	const int16_t *sphere[3] = { from->sphere_x, from->sphere_y, from->sphere_z };
	const int8_t *cone[3] = { from->cone_x, from->cone_y, from->cone_z };
	const uint32_t first = from->attr_first[b], n = n_samples_of(from, b);

	for (int k = 0; k < 3; k++) {
		to->sphere[k][j] = sphere[k][b];
		to->cone[k][j] = cone[k] != NULL ? cone[k][b] : 0;
	}
	to->radius[j] = from->sphere_r[b];
	to->block_projection[j] = from->block_projection[b];
	to->col[j] = from->col[b];
	to->row[j] = from->row[b];
	to->flags[j] = from->flags[b];
	to->cone_sine[j] = from->cone_sine != NULL ? from->cone_sine[b] : 0;
	to->bias[j] = from->depth_bias[b];
	to->step[j] = from->depth_step[b];
	to->mask[j] = from->mask[b];
	if (from->visibility != NULL)
		memcpy(to->visibility[j], from->visibility[b], sizeof to->visibility[j]);
	to->attr_first[j] = *n_samples;
	memcpy(to->depth + *n_samples, from->depth + first, n * sizeof *to->depth);
	memcpy(to->attr + *n_samples, from->attr + first, n * sizeof *to->attr);
	*n_samples += n;
}

static void copy(struct level *to, const struct psr_blocks *from, unsigned level)
{
	uint32_t n_clusters = 0, n_blocks = 0, n_samples = 0;

	for (uint32_t p = 0; p < from->n_projections; p++) {
		to->projection[p] = from->projection[p];
		to->projection[p].spacing *= (float)(1u << level);
	}
	for (uint32_t k = 0; k < from->n_clusters; k++) {
		const struct psr_cluster *c = &from->cluster[k];

		if (c->level != level)
			continue;
		to->cluster[n_clusters] = *c;
		to->cluster[n_clusters].level = 0;
		to->cluster[n_clusters].first_block = n_blocks;
		to->cluster[n_clusters].group = n_clusters;
		n_clusters++;
		for (uint32_t b = c->first_block; b < c->first_block + c->n_blocks; b++)
			copy_block(to, n_blocks++, &n_samples, from, b);
	}
}

static void release(struct level *to)
{
	void *all[] = { to->projection, to->cluster, to->sphere[0], to->sphere[1], to->sphere[2], to->cone[0], to->cone[1],
		            to->cone[2], to->col, to->row, to->radius, to->block_projection, to->level, to->flags, to->cone_sine,
		            to->bias, to->step, to->mask, to->visibility, to->attr_first, to->depth, to->attr };

	for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
		free(all[i]);
}

struct psr_model *scene_level(const struct psr_model *model, unsigned level)
{
	const struct psr_blocks *from = psr_model_blocks(model);
	const int has_cones = from->cone_sine != NULL;
	struct psr_model_info info = *psr_model_info(model);
	struct psr_model *out;
	struct psr_error err;
	struct level to = { .blocks = { .n_projections = from->n_projections, .n_levels = 1 } };

	count(&to, from, level);
	allocate(&to, from);
	copy(&to, from, level);
	info.spacing *= 1u << level;
	info.resolution = info.resolution >> level > 0 ? info.resolution >> level : 1;
	to.blocks = (struct psr_blocks){
		.n_blocks = to.blocks.n_blocks, .n_projections = from->n_projections, .n_clusters = to.blocks.n_clusters,
		.n_levels = 1, .n_samples = to.blocks.n_samples, .projection = to.projection, .cluster = to.cluster,
		.sphere_x = to.sphere[0], .sphere_y = to.sphere[1], .sphere_z = to.sphere[2], .sphere_r = to.radius,
		.block_projection = to.block_projection, .col = to.col, .row = to.row, .level = to.level, .flags = to.flags,
		.depth_bias = to.bias, .depth_step = to.step, .mask = to.mask, .attr_first = to.attr_first, .depth = to.depth,
		.attr = to.attr, .cone_x = has_cones ? to.cone[0] : NULL, .cone_y = has_cones ? to.cone[1] : NULL,
		.cone_z = has_cones ? to.cone[2] : NULL, .cone_sine = has_cones ? to.cone_sine : NULL,
		.visibility = from->visibility != NULL ? (const uint64_t(*)[2])to.visibility : NULL,
	};
	if (psr_model_create(&out, &info, &to.blocks, NULL, &err) != PSR_OK)
		report_die("a single level", err.text);
	release(&to);
	return out;
}
