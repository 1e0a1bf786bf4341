#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/mem.h"
#include "base/vec.h"
#include "sheet_patch.h"

#define SIDE PSR_BLOCK_SIDE
#define BATCH 64

/* Hits of the rays through a row of lattice blocks. */
struct strip {
	int n_columns;
	uint64_t n_rays;
	size_t *first; /* by lattice point of eight rows, and the end */
	size_t n, capacity;
	struct strip_hit {
		float z;
		uint32_t surface;
		uint8_t two_sided, is_first;
	} *hit;
};

struct job {
	struct sheets *sheets[2]; /* the second one's lattice is the first one's, seen from behind: column c of row r is
	                           * column -c - (r & 1) there; NULL if the caller does not want it */
	const struct sampling *sampling;
	struct patch_row *row[2];
};

static int strip_init(struct strip *strip, int n_columns)
{
	*strip = (struct strip){ .n_columns = n_columns };
	strip->first = psr_alloc_array((size_t)(SIDE * n_columns) + 1, sizeof *strip->first);
	return strip->first != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

static void strip_fini(struct strip *strip)
{
	psr_free(strip->first);
	free(strip->hit);
}

/* Takes the hits of one ray that are not too steep. */
static int add_hits(const struct job *job, struct strip *strip, const struct ray_hit *ray_hit, int n_hits)
{
	const float *z_axis = job->sheets[0]->projection.axis[2];
	int is_first = 1;

	if (!ARRAY_ROOM(strip->hit, strip->n + (size_t)n_hits, strip->capacity))
		return PSR_ERR_MEMORY;
	for (int k = 0; k < n_hits; k++) {
		uint32_t prim = ray_hit[k].prim;
		const int was_first = is_first;

		is_first &= ray_scene_is_sheer(job->sampling->scene, prim, ray_hit[k].u, ray_hit[k].v);
		if (fabsf(v3f_dot(ray_scene_normal(job->sampling->scene, prim), z_axis)) < SHEET_LEAST_COSINE)
			continue;
		strip->hit[strip->n++] = (struct strip_hit){ .z = (float)(SHEET_START - ray_hit[k].t),
			                                         .surface = prim | (ray_hit[k].is_back ? SURFACE_BACK : 0),
			                                         .two_sided = (uint8_t)sampling_is_sheet(job->sampling, prim),
			                                         .is_first = was_first != 0 };
	}
	return PSR_OK;
}

struct batch {
	struct ray ray[BATCH];
	struct ray_hit hit[2][BATCH * SHEET_LAYERS];
	int n_hits[2][BATCH];
};

/* Columns first <= c < end of a row, within the unit sphere's disc. */
static int trace_columns(const struct job *job, struct strip strip[2], int row, int first, int end)
{
	static _Thread_local struct batch batch;
	struct ray_hits hits[2];
	int n = 0, is_of[BATCH], rc = PSR_OK;

	for (int i = 0; i < end - first; i++) {
		double x, y;

		sheets_point(job->sheets[0], row, first + i, &x, &y);
		is_of[i] = x * x + y * y <= 1 ? n : -1;
		if (is_of[i] >= 0)
			sheets_ray(&job->sheets[0]->projection, x, y, &batch.ray[n++]);
	}
	strip->n_rays += (uint64_t)n;
	for (int k = 0; k < 2; k++)
		hits[k] = (struct ray_hits){ SHEET_LAYERS, batch.hit[k], batch.n_hits[k] };
	ray_scene_trace_ends(job->sampling->scene, batch.ray, n, 2 * SHEET_START, &hits[0],
	                     job->sheets[1] != NULL ? &hits[1] : NULL);
	for (int end_of_ray = 0; end_of_ray < 2 && job->sheets[end_of_ray] != NULL; end_of_ray++) {
		struct strip *s = &strip[end_of_ray];

		for (int i = 0; rc == PSR_OK && i < end - first; i++) {
			s->first[(row & (SIDE - 1)) * s->n_columns + first + i + s->n_columns / 2] = s->n;
			if (is_of[i] >= 0)
				rc = add_hits(job, s, &batch.hit[end_of_ray][is_of[i] * SHEET_LAYERS],
				              batch.n_hits[end_of_ray][is_of[i]]);
		}
	}
	return rc;
}

static int trace_strip(const struct job *job, struct strip strip[2], int block_row)
{
	int reach = SIDE * job->sheets[0]->reach, rc = PSR_OK;

	for (int r = SIDE * block_row; r < SIDE * (block_row + 1); r++)
		for (int c = -reach; rc == PSR_OK && c < reach; c += BATCH)
			rc = trace_columns(job, strip, r, c, c + BATCH < reach ? c + BATCH : reach);
	for (int i = 0; i < 2; i++)
		if (strip[i].first != NULL)
			strip[i].first[SIDE * strip[i].n_columns] = strip[i].n;
	return rc;
}

/* Makes the patches of a lattice block, of the rays' projection or the one behind. */
static int make_block(const struct strip *strip, struct patch_row *row, int col, int block_row, int is_behind,
                      float step)
{
	struct block_hits h = { .n = 0 };

	for (unsigned s = 0; s < PSR_BLOCK_SAMPLES; s++) {
		int r = (int)(s / SIDE), c = SIDE * col + (int)(s % SIDE);
		int at = (is_behind ? -c - (r & 1) : c) + strip->n_columns / 2;
		size_t point = (size_t)(r * strip->n_columns + at);

		h.first_of[s] = (uint16_t)h.n;
		for (size_t k = strip->first[point]; at >= 0 && at < strip->n_columns && k < strip->first[point + 1]; k++) {
			const struct strip_hit *hit = &strip->hit[k];

			h.hit[h.n] = (struct block_hit){ .z = hit->z, .surface = hit->surface, .at = (uint8_t)s,
				                             .two_sided = hit->two_sided, .is_first = hit->is_first,
				                             .parent = (uint16_t)h.n };
			h.n++;
		}
	}
	h.first_of[PSR_BLOCK_SAMPLES] = (uint16_t)h.n;
	row->n_hits += (uint64_t)h.n;
	return h.n != 0 ? patch_row_add(row, &h, col, block_row, step) : PSR_OK;
}

static void trace_row(int i, void *userdata)
{
	struct job *job = userdata;
	int reach = job->sheets[0]->reach, rc = PSR_OK;
	struct strip strip[2] = { { .n = 0 }, { .n = 0 } };

	for (int k = 0; rc == PSR_OK && k < 2 && job->sheets[k] != NULL; k++)
		rc = strip_init(&strip[k], 2 * SIDE * reach);
	if (rc == PSR_OK)
		rc = trace_strip(job, strip, i - reach);
	for (int k = 0; k < 2 && job->sheets[k] != NULL; k++) {
		struct patch_row *row = &job->row[k][i];

		for (int col = -reach; rc == PSR_OK && col < reach; col++)
			rc = make_block(&strip[k], row, col, i - reach, k, job->sheets[k]->projection.spacing);
		row->n_rays = strip[k].n_rays;
		row->failed = rc != PSR_OK;
		strip_fini(&strip[k]);
	}
}

static int join_rows(struct sheets *sheets, const struct patch_row *rows)
{
	size_t n_heads = 4 * (size_t)sheets->reach * (size_t)sheets->reach, n = 0;

	for (int i = 0; i < 2 * sheets->reach; i++) {
		if (rows[i].failed)
			return PSR_ERR_MEMORY;
		n += rows[i].n;
	}
	sheets->capacity = (uint32_t)n;
	sheets->head = malloc(n_heads * sizeof *sheets->head);
	sheets->patch = malloc((n != 0 ? n : 1) * sizeof *sheets->patch);
	sheets->sample = malloc((n != 0 ? n : 1) * sizeof *sheets->sample);
	if (sheets->head == NULL || sheets->patch == NULL || sheets->sample == NULL)
		return PSR_ERR_MEMORY;
	for (size_t i = 0; i < n_heads; i++)
		sheets->head[i] = SHEET_NONE;
	for (int i = 0; i < 2 * sheets->reach; i++) {
		const struct patch_row *row = &rows[i];

		if (row->n != 0) {
			memcpy(sheets->patch + sheets->n_patches, row->patch, row->n * sizeof *row->patch);
			memcpy(sheets->sample + sheets->n_patches, row->sample, row->n * sizeof *row->sample);
		}
		for (uint32_t p = sheets->n_patches; p < sheets->n_patches + row->n; p++)
			sheets_link(sheets, p);
		sheets->n_patches += row->n;
		sheets->n_rays += row->n_rays;
		sheets->n_hits += row->n_hits;
	}
	return PSR_OK;
}

static int start(struct sheets *sheets, struct patch_row **row, const struct psr_projection *projection)
{
	double row_height = SIDE * sqrt(3.0) / 2 * (double)projection->spacing;

	memset(sheets, 0, sizeof *sheets);
	sheets->projection = *projection;
	/* Rows are narrower than columns, so their reach is enough for both; the one more holds the half step of shift. */
	sheets->reach = (int)ceil(1 / row_height) + 1;
	*row = calloc((size_t)(2 * sheets->reach), sizeof **row);
	return *row != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

static int finish(struct sheets *sheets, struct patch_row *row, int rc)
{
	if (rc == PSR_OK)
		rc = join_rows(sheets, row);
	for (int i = 0; row != NULL && i < 2 * sheets->reach; i++) {
		free(row[i].patch);
		free(row[i].sample);
	}
	free(row);
	return rc;
}

int sheets_trace(struct sheets *sheets, struct sheets *behind, const struct sampling *sampling,
                 const struct psr_projection *projection)
{
	struct job job = { .sheets = { sheets, behind }, .sampling = sampling };
	struct psr_projection turned = *projection;
	int rc = start(sheets, &job.row[0], projection), rc_behind = PSR_OK;

	for (int k = 0; k < 3; k++) {
		turned.axis[0][k] = -turned.axis[0][k];
		turned.axis[2][k] = -turned.axis[2][k];
	}
	if (behind != NULL)
		rc_behind = start(behind, &job.row[1], &turned);
	rc = rc != PSR_OK ? rc : rc_behind;
	if (rc == PSR_OK)
		psr_pool_for(sampling->pool, 2 * sheets->reach, trace_row, &job);
	rc_behind = behind != NULL ? finish(behind, job.row[1], rc) : PSR_OK;
	rc = finish(sheets, job.row[0], rc);
	if (rc == PSR_OK && rc_behind == PSR_OK)
		return PSR_OK;
	sheets_fini(sheets);
	if (behind != NULL)
		sheets_fini(behind);
	return PSR_ERR_MEMORY;
}
