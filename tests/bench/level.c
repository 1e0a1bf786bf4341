#include <stdlib.h>
#include <string.h>
#include "report.h"
#include "scene.h"
#include "model/blocks.h"

#define RUN_MASKS 256

/* Arrays of one level, as psr_model_create() wants them. */
struct level {
	struct psr_blocks blocks;
	struct psr_projection *projection;
	struct psr_cluster *cluster;
	struct psr_run *run;
	int16_t *sphere[3];
	uint16_t *radius, *attr_offset, *depth;
	uint8_t *block_projection, *flags,  *cone_sine, *visibility;
	int8_t *cone[3];
	uint64_t *mask, *attr, (*visible)[2];
};

static uint32_t n_samples_of(const struct psr_blocks *from, uint32_t block)
{
	return (uint32_t)__builtin_popcountll(from->mask[block]);
}

static void count(struct psr_blocks *to, const struct psr_blocks *from, unsigned level)
{
	for (uint32_t k = 0; k < from->n_clusters; k++) {
		const struct psr_cluster *c = &from->cluster[k];

		if (c->level != level)
			continue;
		to->n_clusters++;
		to->n_blocks += c->n_blocks;
		for (uint32_t b = c->first_block; b < c->first_block + c->n_blocks; b++)
			to->n_samples += n_samples_of(from, b);
	}
}

static void allocate(struct level *to, const struct psr_blocks *room)
{
	const size_t n = room->n_blocks;

	to->projection = report_alloc(room->n_projections, sizeof *to->projection);
	to->cluster = report_alloc(room->n_clusters, sizeof *to->cluster);
	to->run = report_alloc(psr_blocks_runs(room), sizeof *to->run);
	for (int k = 0; k < 3; k++) {
		to->sphere[k] = report_alloc(n, sizeof *to->sphere[k]);
		to->cone[k] = report_alloc(n, sizeof *to->cone[k]);
	}
	to->radius = report_alloc(n, sizeof *to->radius);
	to->attr_offset = report_alloc(n, sizeof *to->attr_offset);
	to->block_projection = report_alloc(n, 1);
	to->flags = report_alloc(n, 1);
	to->cone_sine = report_alloc(n, 1);
	to->visibility = report_alloc(n, 1);
	to->mask = report_alloc(n, sizeof *to->mask);
	to->visible = report_alloc(n, sizeof *to->visible);
	to->depth = report_alloc(room->n_samples + PSR_BLOCK_SAMPLES, sizeof *to->depth);
	to->attr = report_alloc(room->n_samples, sizeof *to->attr);
}

/* The mask's number within the run; the last that a run has room for is one that is seen from everywhere. */
static uint8_t share_mask(struct level *to, const struct psr_run *run, const uint64_t mask[2])
{
	const uint32_t n = to->blocks.n_masks - run->visibility_first;
	uint64_t (*all)[2] = to->visible + run->visibility_first;

	for (uint32_t i = n; i-- > 0;)
		if (memcmp(all[i], mask, sizeof *all) == 0)
			return (uint8_t)i;
	if (n == RUN_MASKS)
		return RUN_MASKS - 1;
	if (n == RUN_MASKS - 1)
		memset(all[n], 0xff, sizeof *all);
	else
		memcpy(all[n], mask, sizeof *all);
	to->blocks.n_masks++;
	return (uint8_t)n;
}

static void add_block(struct level *to, const struct psr_blocks *from, uint32_t b)
{
	const int16_t *sphere[3] = { from->sphere_x, from->sphere_y, from->sphere_z };
	const int8_t *cone[3] = { from->cone_x, from->cone_y, from->cone_z };
	const uint32_t first = psr_blocks_attr_first(from, b), n = n_samples_of(from, b), j = to->blocks.n_blocks++;
	struct psr_run *run = &to->run[j / PSR_RUN_BLOCKS];

	if (j % PSR_RUN_BLOCKS == 0)
		*run = (struct psr_run){ (uint32_t)to->blocks.n_samples, to->blocks.n_masks };
	for (int k = 0; k < 3; k++) {
		to->sphere[k][j] = sphere[k][b];
		to->cone[k][j] = cone[k] != NULL ? cone[k][b] : 0;
	}
	to->radius[j] = from->sphere_r[b];
	to->block_projection[j] = from->block_projection[b];
	to->flags[j] = from->flags[b] & (uint8_t)~PSR_BLOCK_LEVEL;
	to->cone_sine[j] = from->cone_sine != NULL ? from->cone_sine[b] : 0;
	to->mask[j] = from->mask[b];
	if (from->visibility_mask != NULL)
		to->visibility[j] = share_mask(to, run, from->visibility_mask[psr_blocks_visibility(from, b)]);
	to->attr_offset[j] = (uint16_t)(to->blocks.n_samples - run->attr_first);
	memcpy(to->depth + to->blocks.n_samples, from->depth + first, n * sizeof *to->depth);
	memcpy(to->attr + to->blocks.n_samples, from->attr + first, n * sizeof *to->attr);
	to->blocks.n_samples += n;
}

static void copy(struct level *to, const struct psr_blocks *from, unsigned level)
{
	for (uint32_t p = 0; p < from->n_projections; p++) {
		to->projection[p] = from->projection[p];
		to->projection[p].spacing *= (float)(1u << level);
	}
	for (uint32_t k = 0; k < from->n_clusters; k++) {
		const struct psr_cluster *c = &from->cluster[k];
		const uint32_t n = to->blocks.n_clusters;

		if (c->level != level)
			continue;
		to->cluster[n] = *c;
		to->cluster[n].level = 0;
		to->cluster[n].first_block = to->blocks.n_blocks;
		to->cluster[n].group = n;
		to->blocks.n_clusters++;
		for (uint32_t b = c->first_block; b < c->first_block + c->n_blocks; b++)
			add_block(to, from, b);
	}
}

static void attach(struct level *to, const struct psr_blocks *from)
{
	struct psr_blocks *b = &to->blocks;

	b->projection = to->projection;
	b->cluster = to->cluster;
	b->run = to->run;
	b->sphere_x = to->sphere[0];
	b->sphere_y = to->sphere[1];
	b->sphere_z = to->sphere[2];
	b->sphere_r = to->radius;
	b->block_projection = to->block_projection;
	b->flags = to->flags;
	b->mask = to->mask;
	b->attr_offset = to->attr_offset;
	b->depth = to->depth;
	b->attr = to->attr;
	if (from->cone_sine != NULL) {
		b->cone_x = to->cone[0];
		b->cone_y = to->cone[1];
		b->cone_z = to->cone[2];
		b->cone_sine = to->cone_sine;
	}
	if (from->visibility_mask != NULL) {
		b->visibility_index = to->visibility;
		b->visibility_mask = (const uint64_t(*)[2])to->visible;
	}
}

static void release(struct level *to)
{
	void *all[] = { to->projection, to->cluster, to->run, to->sphere[0], to->sphere[1], to->sphere[2], to->cone[0],
		            to->cone[1], to->cone[2], to->radius, to->attr_offset, to->block_projection, to->flags,
		            to->cone_sine, to->visibility, to->mask, to->visible, to->depth, to->attr };

	for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
		free(all[i]);
}

struct psr_model *scene_level(const struct psr_model *model, unsigned level)
{
	const struct psr_blocks *from = psr_model_blocks(model);
	struct psr_blocks room = { .n_projections = from->n_projections };
	struct psr_model_info info = *psr_model_info(model);
	struct level to = { .blocks = { .n_projections = from->n_projections, .n_levels = 1 } };
	struct psr_model *out;
	struct psr_error err;

	count(&room, from, level);
	allocate(&to, &room);
	copy(&to, from, level);
	attach(&to, from);
	info.spacing *= 1u << level;
	info.resolution = info.resolution >> level > 0 ? info.resolution >> level : 1;
	if (psr_model_create(&out, &info, &to.blocks, NULL, &err) != PSR_OK)
		report_die("a single level", err.text);
	release(&to);
	return out;
}
