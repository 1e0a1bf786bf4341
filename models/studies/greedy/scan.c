#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "base/vec.h"
#include "parts.h"
#include "surface/surface.h"

#define START 2.0 /* rays begin outside of the unit sphere: z = START - t */
#define RUN 64    /* rays traced together */
#define STRIDE_SIDE 8

struct row {
	uint32_t n;
	struct greedy_sample *sample;
	int failed;
};

struct job {
	const struct greedy *greedy;
	const struct surface *surface;
	const struct psr_projection *projection;
	int reach, stride;
	struct row *row;
};

double greedy_row_pitch(enum greedy_lattice lattice)
{
	return lattice == GREEDY_EQUILATERAL ? 0.86602540378443864676 : 1;
}

double greedy_shift(enum greedy_lattice lattice, int row)
{
	return lattice == GREEDY_EQUILATERAL ? (row & 1) / 2.0 : 0;
}

static int is_left_out(int i, int stride)
{
	return stride > 1 && ((i + STRIDE_SIDE * 4096) / STRIDE_SIDE) % stride != 0;
}

static void take_hit(const struct job *job, struct greedy_sample *sample, const struct ray_hit *hit, double x, double y)
{
	const struct psr_projection *p = job->projection;
	const float *normal = ray_scene_normal(job->greedy->scene, hit->prim);
	const struct surface_place place = { .prim = hit->prim, .is_back = hit->is_back, .u = hit->u, .v = hit->v };
	double z = START - hit->t;

	for (int k = 0; k < 3; k++)
		sample->position[k] = (float)(x * (double)p->axis[0][k] + y * (double)p->axis[1][k]
		                              + z * (double)p->axis[2][k]);
	sample->z = (float)z;
	sample->cosine = fminf(fabsf(v3f_dot(normal, p->axis[2])), 1);
	sample->surface = hit->prim | (hit->is_back ? GREEDY_BACK : 0);
	sample->attr = surface_attr(job->surface, &place, job->greedy->ds * 1.4142135623730951, p->axis[2]);
	sample->two_sided = sample->is_kept = 0;
}

static void trace_run(struct row *row, const struct job *job, const int *col, int n, int lattice_row)
{
	const struct psr_projection *p = job->projection;
	const enum greedy_lattice lattice = job->greedy->options.lattice;
	double spacing = (double)p->spacing, x[RUN], y = lattice_row * greedy_row_pitch(lattice) * spacing;
	struct ray ray[RUN];
	struct ray_hit hit[RUN];

	if (n <= 0)
		return;
	for (int i = 0; i < n; i++) {
		x[i] = (col[i] + greedy_shift(lattice, lattice_row)) * spacing;
		for (int k = 0; k < 3; k++) {
			ray[i].origin[k] = x[i] * (double)p->axis[0][k] + y * (double)p->axis[1][k] + START * (double)p->axis[2][k];
			ray[i].direction[k] = -(double)p->axis[2][k];
		}
	}
	ray_scene_trace(job->greedy->scene, ray, n, 0, hit);
	for (int i = 0; i < n; i++) {
		struct greedy_sample *sample = &row->sample[row->n];

		if (hit[i].prim == RAY_NONE)
			continue;
		sample->col = (int16_t)col[i];
		sample->row = (int16_t)lattice_row;
		take_hit(job, sample, &hit[i], x[i], y);
		row->n++;
	}
}

static void trace_row(int i, void *userdata)
{
	struct job *job = userdata;
	const enum greedy_lattice lattice = job->greedy->options.lattice;
	struct row *row = &job->row[i];
	int lattice_row = i - job->reach, col[RUN], n = 0, most;
	double spacing = (double)job->projection->spacing, y = lattice_row * greedy_row_pitch(lattice) * spacing, half;

	if (y * y >= 1 || is_left_out(lattice_row, job->stride))
		return;
	half = sqrt(1 - y * y) / spacing;
	most = (int)ceil(half) + 1;
	row->sample = psr_alloc_array(2 * (size_t)most + 1, sizeof *row->sample);
	if (row->sample == NULL) {
		row->failed = 1;
		return;
	}
	for (int c = -most; c <= most; c++) {
		double x = c + greedy_shift(lattice, lattice_row);

		if (x * x > half * half || is_left_out(c, job->stride))
			continue;
		col[n++] = c;
		if (n == RUN) {
			trace_run(row, job, col, n, lattice_row);
			n = 0;
		}
	}
	trace_run(row, job, col, n, lattice_row);
}

static int join_rows(struct greedy_view *view, const struct job *job)
{
	size_t n = 0;

	for (int i = 0; i <= 2 * job->reach; i++) {
		if (job->row[i].failed)
			return PSR_ERR_MEMORY;
		n += job->row[i].n;
	}
	view->sample = psr_alloc_array(n, sizeof *view->sample);
	if (view->sample == NULL)
		return PSR_ERR_MEMORY;
	for (int i = 0; i <= 2 * job->reach; i++) {
		if (job->row[i].n != 0)
			memcpy(view->sample + view->n_samples, job->row[i].sample, job->row[i].n * sizeof *view->sample);
		view->n_samples += job->row[i].n;
	}
	return PSR_OK;
}

static void mark_sides(const struct greedy *greedy, struct greedy_view *view)
{
	for (uint32_t i = 0; i < view->n_samples; i++)
		view->sample[i].two_sided = greedy->is_two_sided[view->sample[i].surface & ~GREEDY_BACK];
}

int greedy_trace(struct greedy *greedy, int view, int stride)
{
	struct surface surface;
	struct job job = { .greedy = greedy, .surface = &surface, .stride = stride,
		               .projection = &greedy->view[view].projection };
	int rc = surface_init(&surface, greedy->mesh, greedy->scale);

	job.reach = (int)ceil(1 / (greedy_row_pitch(greedy->options.lattice) * (double)job.projection->spacing));
	job.row = calloc(2 * (size_t)job.reach + 1, sizeof *job.row);
	if (job.row == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK) {
		psr_pool_for(greedy->pool, 2 * job.reach + 1, trace_row, &job);
		rc = join_rows(&greedy->view[view], &job);
	}
	for (int i = 0; job.row != NULL && i <= 2 * job.reach; i++)
		psr_free(job.row[i].sample);
	free(job.row);
	surface_fini(&surface);
	if (rc == PSR_OK && greedy->is_two_sided != NULL)
		mark_sides(greedy, &greedy->view[view]);
	return rc;
}

void greedy_forget(struct greedy_view *view)
{
	psr_free(view->sample);
	psr_free(view->block);
	view->sample = NULL;
	view->block = NULL;
	view->n_samples = view->n_blocks = 0;
}

static int note_sides(struct greedy *greedy)
{
	enum { FRONT = 1, BACK = 2 };
	size_t n = (size_t)greedy->mesh->n_triangles + greedy->mesh->n_points;
	uint8_t *seen = psr_alloc_array(n, 1);

	if (seen == NULL)
		return PSR_ERR_MEMORY;
	memset(seen, 0, n);
	for (int v = 0; v < greedy->n_views; v++) {
		for (uint32_t i = 0; i < greedy->view[v].n_samples; i++) {
			uint32_t surface = greedy->view[v].sample[i].surface;

			seen[surface & ~GREEDY_BACK] |= (surface & GREEDY_BACK) != 0 ? BACK : FRONT;
		}
	}
	for (size_t i = 0; i < n; i++)
		seen[i] = seen[i] == (FRONT | BACK);
	greedy->is_two_sided = seen;
	for (int v = 0; v < greedy->n_views; v++)
		mark_sides(greedy, &greedy->view[v]);
	return PSR_OK;
}

int greedy_create(struct greedy **out, const struct study_model *model, const struct greedy_scan_options *options,
                  struct psr_pool *pool, struct psr_error *err)
{
	struct greedy *greedy = calloc(1, sizeof *greedy);
	double started = clock_seconds();
	int rc = PSR_OK;

	if (greedy == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a sampling");
	*greedy = (struct greedy){ .mesh = model->mesh, .scene = model->scene, .pool = pool, .options = *options,
		                       .scale = model->scale, .ds = 2.0 / options->resolution };
	greedy_make_views(greedy);
	for (int v = 0; rc == PSR_OK && v < greedy->n_views - greedy->n_scouts; v++)
		rc = greedy_trace(greedy, v, 1);
	if (rc == PSR_OK)
		rc = note_sides(greedy);
	greedy->seconds_scan = clock_seconds() - started;
	if (rc != PSR_OK) {
		greedy_destroy(greedy);
		return psr_fail(err, rc, "no memory for the samples of all projections at resolution %u; use a lower one",
		                options->resolution);
	}
	*out = greedy;
	return PSR_OK;
}

void greedy_destroy(struct greedy *greedy)
{
	if (greedy == NULL)
		return;
	for (int v = 0; v < greedy->n_views; v++)
		greedy_forget(&greedy->view[v]);
	psr_free(greedy->is_two_sided);
	free(greedy);
}
