#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/mem.h"
#include "../base/vec.h"
#include "sheet.h"

#define SIDE PSR_BLOCK_SIDE
#define MOST_LAYERS 24
#define MOST_HITS (PSR_BLOCK_SAMPLES * MOST_LAYERS)

/* Sheets of a lattice block share a patch while it is not deeper than this many steps: thrice as deep as it is wide. */
#define PATCH_STEPS 24

void sheets_ray(const struct psr_projection *projection, double x, double y, struct ray *ray)
{
	for (int k = 0; k < 3; k++) {
		ray->origin[k] = x * (double)projection->axis[0][k] + y * (double)projection->axis[1][k]
		                 + SHEET_START * (double)projection->axis[2][k];
		ray->direction[k] = -(double)projection->axis[2][k];
	}
}

/* ---- the hits of one lattice block, and the patches that they make ---- */

struct block_hit {
	float z;
	uint32_t surface;
	uint8_t at, two_sided, is_first;
	uint16_t parent; /* union-find: hits of a connected sheet have one root */
};

struct block_hits {
	struct block_hit hit[MOST_HITS];
	uint16_t first_of[PSR_BLOCK_SAMPLES + 1]; /* hits are by lattice point */
	int n;
};

static int root_of(struct block_hits *h, int i)
{
	while (h->hit[i].parent != i) {
		h->hit[i].parent = h->hit[h->hit[i].parent].parent;
		i = h->hit[i].parent;
	}
	return i;
}

/* Joins the hits of two neighbouring lattice points that may be one surface: each with the nearest in depth. */
static void join(struct block_hits *h, int a, int b, float reach)
{
	for (int i = h->first_of[a]; i < h->first_of[a + 1]; i++) {
		int nearest = -1;
		float least = reach;

		for (int k = h->first_of[b]; k < h->first_of[b + 1]; k++) {
			float d = fabsf(h->hit[k].z - h->hit[i].z);

			if (d <= least && h->hit[k].two_sided == h->hit[i].two_sided) {
				least = d;
				nearest = k;
			}
		}
		if (nearest >= 0) {
			int p = root_of(h, i), q = root_of(h, nearest);

			if (p < q)
				h->hit[q].parent = (uint16_t)p;
			else
				h->hit[p].parent = (uint16_t)q;
		}
	}
}

static void connect(struct block_hits *h, float reach)
{
	for (int r = 0; r < SIDE; r++) {
		for (int c = 0; c < SIDE; c++) {
			int s = SIDE * r + c, left = c - 1 + (r & 1);

			if (c + 1 < SIDE)
				join(h, s, s + 1, reach);
			if (r + 1 < SIDE && left >= 0)
				join(h, s, SIDE * (r + 1) + left, reach);
			if (r + 1 < SIDE && left + 1 < SIDE)
				join(h, s, SIDE * (r + 1) + left + 1, reach);
		}
	}
}

/* A row of lattice blocks, traced by one thread into arrays of its own. */
struct row {
	uint32_t n, capacity;
	uint64_t n_rays, n_hits;
	struct patch *patch;
	struct sheet_sample (*sample)[PSR_BLOCK_SAMPLES];
	int failed;
};

static int grow_row(struct row *row)
{
	uint32_t capacity = row->capacity != 0 ? 2 * row->capacity : 32;
	struct patch *patch = realloc(row->patch, capacity * sizeof *patch);
	void *sample;

	if (patch != NULL)
		row->patch = patch;
	sample = realloc(row->sample, capacity * sizeof *row->sample);
	if (sample != NULL)
		row->sample = sample;
	if (patch == NULL || sample == NULL)
		return PSR_ERR_MEMORY;
	row->capacity = capacity;
	return PSR_OK;
}

struct sheet {
	uint64_t mask;
	float low, high;
	uint16_t root;
	uint8_t two_sided;
};

static void list_sheets(struct block_hits *h, struct sheet *sheet, int *n_sheets)
{
	int16_t number[MOST_HITS];

	*n_sheets = 0;
	for (int i = 0; i < h->n; i++) {
		int root = root_of(h, i);
		const struct block_hit *hit = &h->hit[i];
		struct sheet *s;

		if (root == i) {
			number[i] = (int16_t)*n_sheets;
			sheet[(*n_sheets)++] = (struct sheet){ .low = hit->z, .high = hit->z, .root = (uint16_t)i,
				                                   .two_sided = hit->two_sided };
		}
		s = &sheet[number[root]];
		s->low = hit->z < s->low ? hit->z : s->low;
		s->high = hit->z > s->high ? hit->z : s->high;
		s->mask |= UINT64_C(1) << hit->at;
	}
}

static int compare_sheets(const void *a, const void *b)
{
	const struct sheet *x = a, *y = b;

	return x->low != y->low ? (x->low < y->low ? -1 : 1) : (int)x->root - (int)y->root;
}

/* A sheet may pass over a lattice point more than once (a spiral): hits that find their place taken start a patch of
 * their own. */
static int add_hit(struct row *row, uint32_t first, const struct block_hit *hit, uint32_t wanted)
{
	uint64_t bit = UINT64_C(1) << hit->at;
	uint32_t p = wanted;

	if ((row->patch[p].mask & bit) != 0)
		for (p = first; p < row->n && ((row->patch[p].mask & bit) != 0 || row->patch[p].two_sided != hit->two_sided); p++)
			;
	if (p == row->n) {
		if (row->n == row->capacity && grow_row(row) != PSR_OK)
			return PSR_ERR_MEMORY;
		row->patch[p] = row->patch[wanted];
		row->patch[p].mask = row->patch[p].first = 0;
		memset(row->sample[p], 0, sizeof row->sample[p]);
		row->n++;
	}
	row->patch[p].mask |= bit;
	row->patch[p].first |= hit->is_first ? bit : 0;
	row->sample[p][hit->at] = (struct sheet_sample){ hit->z, hit->surface };
	return PSR_OK;
}

static int add_patches(struct row *row, struct block_hits *h, int col, int block_row, float step)
{
	struct sheet sheet[MOST_HITS];
	float low[MOST_HITS], high[MOST_HITS];
	uint16_t patch_of[MOST_HITS];
	uint32_t first = row->n;
	int n_sheets;

	connect(h, SHEET_STEPS * step);
	list_sheets(h, sheet, &n_sheets);
	qsort(sheet, (size_t)n_sheets, sizeof *sheet, compare_sheets);
	for (int i = 0; i < n_sheets; i++) {
		uint32_t p = first;

		/* The first patch with room for all of it that stays shallow. */
		for (; p < row->n; p++) {
			float top = sheet[i].high > high[p - first] ? sheet[i].high : high[p - first];
			float bottom = sheet[i].low < low[p - first] ? sheet[i].low : low[p - first];

			if ((row->patch[p].mask & sheet[i].mask) == 0 && row->patch[p].two_sided == sheet[i].two_sided
			    && top - bottom <= PATCH_STEPS * step)
				break;
		}
		if (p == row->n) {
			if (row->n == row->capacity && grow_row(row) != PSR_OK)
				return PSR_ERR_MEMORY;
			memset(&row->patch[p], 0, sizeof row->patch[p]);
			memset(row->sample[p], 0, sizeof row->sample[p]);
			row->patch[p].col = (int16_t)col;
			row->patch[p].row = (int16_t)block_row;
			row->patch[p].two_sided = sheet[i].two_sided;
			low[p - first] = sheet[i].low;
			high[p - first] = sheet[i].high;
			row->n++;
		}
		low[p - first] = sheet[i].low < low[p - first] ? sheet[i].low : low[p - first];
		high[p - first] = sheet[i].high > high[p - first] ? sheet[i].high : high[p - first];
		/* Reserve the places, so that no later sheet takes them; the hits themselves follow. */
		row->patch[p].mask |= sheet[i].mask;
		patch_of[sheet[i].root] = (uint16_t)(p - first);
	}
	for (uint32_t p = first; p < row->n; p++)
		row->patch[p].mask = 0;
	for (int i = 0; i < h->n; i++)
		if (add_hit(row, first, &h->hit[i], first + patch_of[root_of(h, i)]) != PSR_OK)
			return PSR_ERR_MEMORY;
	return PSR_OK;
}

struct job {
	struct sheets *sheets;
	const struct ray_scene *scene;
	const struct psr_mesh *mesh;
	struct row *row;
};

static void gather_hits(const struct job *job, const struct ray_hit *ray_hit, int n_hits, unsigned at,
                        struct block_hits *h)
{
	const float *z_axis = job->sheets->projection.axis[2];

	for (int k = 0; k < n_hits; k++) {
		const struct psr_mesh *mesh = job->mesh;
		uint32_t prim = ray_hit[k].prim;
		float cosine = v3f_dot(ray_scene_normal(job->scene, prim), z_axis);
		uint32_t material = prim < mesh->n_triangles ? mesh->triangle_material[prim]
		                                             : mesh->point_material[prim - mesh->n_triangles];
		struct block_hit *hit = &h->hit[h->n];

		if ((ray_hit[k].is_back ? -cosine : cosine) < SHEET_LEAST_COSINE)
			continue;
		hit->z = (float)(SHEET_START - ray_hit[k].t);
		hit->surface = prim | (ray_hit[k].is_back ? SHEET_BACK : 0);
		hit->at = (uint8_t)at;
		hit->two_sided = mesh->material[material].two_sided != 0;
		hit->is_first = k == 0;
		hit->parent = (uint16_t)h->n;
		h->n++;
	}
}

static int trace_block(const struct job *job, struct row *row, int col, int block_row)
{
	static _Thread_local struct ray_hit ray_hit[MOST_HITS];
	struct ray ray[PSR_BLOCK_SAMPLES];
	int n_hits[PSR_BLOCK_SAMPLES], n = 0, at_ray[PSR_BLOCK_SAMPLES];
	struct block_hits h;

	for (unsigned s = 0; s < PSR_BLOCK_SAMPLES; s++) {
		double x, y;

		at_ray[s] = -1;
		sheets_point(job->sheets, SIDE * block_row + (int)(s / SIDE), SIDE * col + (int)(s % SIDE), &x, &y);
		if (x * x + y * y > 1)
			continue;
		sheets_ray(&job->sheets->projection, x, y, &ray[n]);
		at_ray[s] = n++;
	}
	if (n == 0)
		return PSR_OK;
	row->n_rays += (uint64_t)n;
	ray_scene_trace_all(job->scene, ray, n, MOST_LAYERS, ray_hit, n_hits);
	h.n = 0;
	for (unsigned s = 0; s < PSR_BLOCK_SAMPLES; s++) {
		h.first_of[s] = (uint16_t)h.n;
		if (at_ray[s] >= 0)
			gather_hits(job, &ray_hit[at_ray[s] * MOST_LAYERS], n_hits[at_ray[s]], s, &h);
	}
	h.first_of[PSR_BLOCK_SAMPLES] = (uint16_t)h.n;
	row->n_hits += (uint64_t)h.n;
	return h.n != 0 ? add_patches(row, &h, col, block_row, job->sheets->projection.spacing) : PSR_OK;
}

static void trace_row(int i, void *userdata)
{
	struct job *job = userdata;
	struct row *row = &job->row[i];

	for (int col = -job->sheets->reach; col < job->sheets->reach; col++) {
		if (trace_block(job, row, col, i - job->sheets->reach) != PSR_OK) {
			row->failed = 1;
			return;
		}
	}
}

static uint32_t *head_of(const struct sheets *sheets, int col, int row)
{
	int side = 2 * sheets->reach;

	col += sheets->reach;
	row += sheets->reach;
	return col < 0 || row < 0 || col >= side || row >= side ? NULL : &sheets->head[(size_t)row * (size_t)side + (size_t)col];
}

static void link_patch(struct sheets *sheets, uint32_t p)
{
	struct patch *patch = &sheets->patch[p];
	uint32_t *at = head_of(sheets, patch->col, patch->row);

	while (*at != SHEET_NONE)
		at = &sheets->patch[*at].next;
	*at = p;
	patch->next = SHEET_NONE;
}

static int join_rows(struct sheets *sheets, const struct job *job)
{
	size_t n_heads = 4 * (size_t)sheets->reach * (size_t)sheets->reach, n = 0;

	for (int i = 0; i < 2 * sheets->reach; i++) {
		if (job->row[i].failed)
			return PSR_ERR_MEMORY;
		n += job->row[i].n;
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
		const struct row *row = &job->row[i];

		if (row->n != 0) {
			memcpy(sheets->patch + sheets->n_patches, row->patch, row->n * sizeof *row->patch);
			memcpy(sheets->sample + sheets->n_patches, row->sample, row->n * sizeof *row->sample);
		}
		for (uint32_t p = sheets->n_patches; p < sheets->n_patches + row->n; p++)
			link_patch(sheets, p);
		sheets->n_patches += row->n;
		sheets->n_rays += row->n_rays;
		sheets->n_hits += row->n_hits;
	}
	return PSR_OK;
}

int sheets_trace(struct sheets *sheets, const struct ray_scene *scene, const struct psr_mesh *mesh,
                 const struct psr_projection *projection, struct psr_pool *pool)
{
	double row_height = SIDE * sqrt(3.0) / 2 * (double)projection->spacing;
	struct job job = { sheets, scene, mesh, NULL };
	int rc;

	memset(sheets, 0, sizeof *sheets);
	sheets->projection = *projection;
	/* Rows are the narrower ones, so their reach does for the columns too; half a step of shift is within the one. */
	sheets->reach = (int)ceil(1 / row_height) + 1;
	job.row = calloc((size_t)(2 * sheets->reach), sizeof *job.row);
	if (job.row == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(pool, 2 * sheets->reach, trace_row, &job);
	rc = join_rows(sheets, &job);
	for (int i = 0; i < 2 * sheets->reach; i++) {
		free(job.row[i].patch);
		free(job.row[i].sample);
	}
	free(job.row);
	if (rc != PSR_OK)
		sheets_fini(sheets);
	return rc;
}

void sheets_fini(struct sheets *sheets)
{
	free(sheets->head);
	free(sheets->patch);
	free(sheets->sample);
	memset(sheets, 0, sizeof *sheets);
}

/* ---- looking things up ---- */

void sheets_triangle(const struct sheets *sheets, double x, double y, struct lattice_point corner[3])
{
	double spacing = (double)sheets->projection.spacing;
	double v = y / (0.86602540378443864676 * spacing), u = x / spacing;
	int row = (int)floor(v), shift = row & 1;
	double f = v - row, a = u - shift / 2.0, b = u - (1 - shift) / 2.0;
	int ca = (int)floor(a), cb = (int)floor(b);
	double ta = a - ca;

	if (f <= 2 * (ta < 0.5 ? ta : 1 - ta)) {
		corner[0] = (struct lattice_point){ row, ca };
		corner[1] = (struct lattice_point){ row, ca + 1 };
		corner[2] = (struct lattice_point){ row + 1, ca + shift };
	} else {
		corner[0] = (struct lattice_point){ row + 1, cb };
		corner[1] = (struct lattice_point){ row + 1, cb + 1 };
		corner[2] = (struct lattice_point){ row, cb + 1 - shift };
	}
}

static unsigned sample_at(struct lattice_point at)
{
	return (unsigned)(SIDE * (at.row & (SIDE - 1)) + (at.col & (SIDE - 1)));
}

static const uint32_t *head_at(const struct sheets *sheets, struct lattice_point at)
{
	return head_of(sheets, at.col >> 3, at.row >> 3);
}

struct sheet_ref sheets_find(const struct sheets *sheets, struct lattice_point at, float z, float reach)
{
	const uint32_t *head = head_at(sheets, at);
	unsigned s = sample_at(at);
	struct sheet_ref found = { SHEET_NONE, s };

	for (uint32_t p = head != NULL ? *head : SHEET_NONE; p != SHEET_NONE; p = sheets->patch[p].next) {
		float d;

		if ((sheets->patch[p].mask >> s & 1) == 0)
			continue;
		d = fabsf(sheets->sample[p][s].z - z);
		if (d <= reach) {
			reach = d;
			found.patch = p;
		}
	}
	return found;
}

static int grow_sheets(struct sheets *sheets)
{
	uint32_t capacity = sheets->capacity + sheets->capacity / 4 + 16;
	struct patch *patch = realloc(sheets->patch, capacity * sizeof *patch);
	void *sample;

	if (patch == NULL)
		return PSR_ERR_MEMORY;
	sheets->patch = patch;
	sample = realloc(sheets->sample, capacity * sizeof *sheets->sample);
	if (sample == NULL)
		return PSR_ERR_MEMORY;
	sheets->sample = sample;
	sheets->capacity = capacity;
	return PSR_OK;
}

struct sheet_ref sheets_room(const struct sheets *sheets, struct lattice_point at, float z, int two_sided)
{
	const uint32_t *head = head_at(sheets, at);
	struct sheet_ref room = { head != NULL ? *head : SHEET_NONE, sample_at(at) };

	for (; room.patch != SHEET_NONE; room.patch = sheets->patch[room.patch].next) {
		const struct patch *patch = &sheets->patch[room.patch];

		if (patch->is_alive && (patch->mask >> room.sample & 1) == 0 && patch->two_sided == two_sided
		    && fabsf(sheets->sample[room.patch][__builtin_ctzll(patch->kept)].z - z)
		       < PATCH_STEPS / 2 * sheets->projection.spacing)
			break;
	}
	return room;
}

int sheets_add(struct sheets *sheets, struct lattice_point at, float z, uint32_t surface, int two_sided,
               struct sheet_ref *out)
{
	*out = sheets_room(sheets, at, z, two_sided);
	if (head_at(sheets, at) == NULL)
		return PSR_OK;
	if (out->patch == SHEET_NONE) {
		uint32_t p = sheets->n_patches;

		if (p == sheets->capacity && grow_sheets(sheets) != PSR_OK)
			return PSR_ERR_MEMORY;
		sheets->n_patches++;
		memset(&sheets->patch[p], 0, sizeof sheets->patch[p]);
		memset(sheets->sample[p], 0, sizeof sheets->sample[p]);
		sheets->patch[p].col = (int16_t)(at.col >> 3);
		sheets->patch[p].row = (int16_t)(at.row >> 3);
		sheets->patch[p].two_sided = (uint8_t)two_sided;
		link_patch(sheets, p);
		out->patch = p;
	}
	sheets->patch[out->patch].mask |= UINT64_C(1) << out->sample;
	sheets->sample[out->patch][out->sample] = (struct sheet_sample){ z, surface };
	return PSR_OK;
}

void sheets_position(const struct sheets *sheets, struct sheet_ref ref, float position[3])
{
	const struct patch *patch = &sheets->patch[ref.patch];
	double x, y, inner[3];

	sheets_point(sheets, SIDE * patch->row + (int)(ref.sample / SIDE), SIDE * patch->col + (int)(ref.sample % SIDE), &x, &y);
	sheets_inner(&sheets->projection, x, y, (double)sheets->sample[ref.patch][ref.sample].z, inner);
	v3f_set(position, (float)inner[0], (float)inner[1], (float)inner[2]);
}
