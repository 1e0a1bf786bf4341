#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/mem.h"
#include "lattice.h"

#define SIDE PSR_BLOCK_SIDE

void lattice_position(const struct psr_projection *projection, int col, int row, unsigned sample, double *x, double *y)
{
	double spacing = (double)projection->spacing;
	int r = SIDE * row + (int)(sample / SIDE), c = SIDE * col + (int)(sample % SIDE);

	*x = (c + (r & 1) / 2.0) * spacing;
	*y = r * (sqrt(3.0) / 2) * spacing;
}

void lattice_ray(const struct psr_projection *projection, double x, double y, struct ray *ray)
{
	for (int k = 0; k < 3; k++) {
		ray->origin[k] = x * (double)projection->axis[0][k] + y * (double)projection->axis[1][k]
		                 + LATTICE_START * (double)projection->axis[2][k];
		ray->direction[k] = -(double)projection->axis[2][k];
	}
}

/* Traces one block; returns its mask. */
static uint64_t trace_block(const struct ray_scene *scene, const struct psr_projection *projection, int col, int row,
                            struct lattice_sample *sample, uint64_t *n_rays)
{
	struct ray ray[PSR_BLOCK_SAMPLES];
	struct ray_hit hit[PSR_BLOCK_SAMPLES];
	unsigned which[PSR_BLOCK_SAMPLES];
	uint64_t mask = 0;
	int n = 0;

	for (unsigned s = 0; s < PSR_BLOCK_SAMPLES; s++) {
		double x, y;

		lattice_position(projection, col, row, s, &x, &y);
		if (x * x + y * y > 1)
			continue;
		lattice_ray(projection, x, y, &ray[n]);
		which[n++] = s;
	}
	if (n == 0)
		return 0;
	*n_rays += (uint64_t)n;
	memset(sample, 0, PSR_BLOCK_SAMPLES * sizeof *sample);
	ray_scene_trace(scene, ray, n, 0, hit);
	for (int i = 0; i < n; i++) {
		if (hit[i].prim == RAY_NONE)
			continue;
		sample[which[i]].z = (float)(LATTICE_START - hit[i].t);
		sample[which[i]].surface = hit[i].prim | (hit[i].is_back ? LATTICE_BACK : 0);
		mask |= UINT64_C(1) << which[i];
	}
	return mask;
}

/* A row of blocks, traced by one thread into arrays of its own. */
struct row {
	uint32_t n_blocks;
	uint64_t n_rays;
	int16_t *col;
	uint64_t *mask;
	struct lattice_sample (*sample)[PSR_BLOCK_SAMPLES];
	int failed;
};

struct job {
	const struct ray_scene *scene;
	const struct psr_projection *projection;
	int reach; /* blocks on each side of the origin, along rows and columns */
	int stride;
	struct row *row;
};

static int grow_row(struct row *row, uint32_t capacity)
{
	int16_t *col = realloc(row->col, capacity * sizeof *col);
	uint64_t *mask;
	void *sample;

	if (col != NULL)
		row->col = col;
	mask = realloc(row->mask, capacity * sizeof *mask);
	if (mask != NULL)
		row->mask = mask;
	sample = realloc(row->sample, capacity * sizeof *row->sample);
	if (sample != NULL)
		row->sample = sample;
	return col == NULL || mask == NULL || sample == NULL ? PSR_ERR_MEMORY : PSR_OK;
}

static void trace_row(int i, void *userdata)
{
	struct job *job = userdata;
	struct row *row = &job->row[i];
	uint32_t capacity = 0;

	if (i % job->stride != 0)
		return;
	for (int col = -job->reach; col < job->reach; col += job->stride) {
		if (row->n_blocks == capacity) {
			capacity = capacity != 0 ? 2 * capacity : 16;
			if (grow_row(row, capacity) != PSR_OK) {
				row->failed = 1;
				return;
			}
		}
		row->mask[row->n_blocks] = trace_block(job->scene, job->projection, col, i - job->reach,
		                                       row->sample[row->n_blocks], &row->n_rays);
		row->col[row->n_blocks] = (int16_t)col;
		row->n_blocks += row->mask[row->n_blocks] != 0;
	}
}

static int join_rows(struct lattice *lattice, const struct job *job)
{
	size_t n = 0;

	for (int i = 0; i < 2 * job->reach; i++) {
		if (job->row[i].failed)
			return PSR_ERR_MEMORY;
		n += job->row[i].n_blocks;
	}
	lattice->col = psr_alloc_array(n, sizeof *lattice->col);
	lattice->row = psr_alloc_array(n, sizeof *lattice->row);
	lattice->mask = psr_alloc_array(n, sizeof *lattice->mask);
	lattice->sample = psr_alloc_array(n, sizeof *lattice->sample);
	if (lattice->col == NULL || lattice->row == NULL || lattice->mask == NULL || lattice->sample == NULL)
		return PSR_ERR_MEMORY;
	for (int i = 0; i < 2 * job->reach; i++) {
		const struct row *row = &job->row[i];
		uint32_t first = lattice->n_blocks;

		for (uint32_t b = 0; b < row->n_blocks; b++) {
			lattice->col[first + b] = row->col[b];
			lattice->row[first + b] = (int16_t)(i - job->reach);
			lattice->mask[first + b] = row->mask[b];
			memcpy(lattice->sample[first + b], row->sample[b], sizeof *row->sample);
		}
		lattice->n_blocks += row->n_blocks;
		lattice->n_rays += row->n_rays;
	}
	return PSR_OK;
}

int lattice_trace(struct lattice *lattice, const struct ray_scene *scene, const struct psr_projection *projection,
                  int stride, struct psr_pool *pool)
{
	struct job job = { .scene = scene, .projection = projection, .stride = stride };
	double row_height = SIDE * sqrt(3.0) / 2 * (double)projection->spacing;
	int rc;

	/* Rows are the narrower ones, so their reach does for the columns too; half a step of shift is within the one. */
	job.reach = (int)ceil(1 / row_height) + 1;
	memset(lattice, 0, sizeof *lattice);
	lattice->projection = *projection;
	job.row = calloc((size_t)(2 * job.reach), sizeof *job.row);
	if (job.row == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(pool, 2 * job.reach, trace_row, &job);
	rc = join_rows(lattice, &job);
	for (int i = 0; i < 2 * job.reach; i++) {
		free(job.row[i].col);
		free(job.row[i].mask);
		free(job.row[i].sample);
	}
	free(job.row);
	if (rc != PSR_OK)
		lattice_fini(lattice);
	return rc;
}

void lattice_fini(struct lattice *lattice)
{
	psr_free(lattice->col);
	psr_free(lattice->row);
	psr_free(lattice->mask);
	psr_free(lattice->sample);
	memset(lattice, 0, sizeof *lattice);
}
