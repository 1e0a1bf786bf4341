#include "trials.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/direction.h"
#include "base/random.h"
#include "ray/area.h"

#define PI 3.14159265358979323846
#define SEED UINT64_C(0x5053525354554459)
#define MOST_TRIES 1000 /* for each place that is wanted */
#define AWAY 4.0        /* rays begin this far from the place: outside of the unit sphere */
#define BACK 0.0125f    /* as the renderer's: a sample that faces away by less than the error of quantised normals still
                         * counts */
#define RUN 64
#define FARTHEST 4.0f   /* pixels before a place within which its surface may stand, at grazing angles */

struct trial {
	struct trials_seen seen;
	float cosine;
};

struct trial_view {
	float axis[3][3]; /* x and y along the pixels */
	int n;
	struct trial *trial;
};

struct trials {
	const struct psr_mesh *mesh;
	const struct ray_scene *scene;
	double *area; /* summed up to and with each triangle */
	uint64_t random;
	int n_views;
	struct trial_view *view;
};

static double next_real(struct trials *trials) /* 0 <= x < 1 */
{
	return random_in(&trials->random, 0, 1);
}

static void next_direction(struct trials *trials, double v[3])
{
	do
		for (int k = 0; k < 3; k++)
			v[k] = 2 * next_real(trials) - 1;
	while (v3d_dot(v, v) > 1 || v3d_dot(v, v) < 1e-4);
	v3d_normalize(v, v);
}

static void next_place(struct trials *trials, uint32_t *prim, double place[3])
{
	const uint32_t n = trials->mesh->n_triangles;
	double u = next_real(trials), v = next_real(trials), corner[3][3];

	if (u + v > 1) {
		u = 1 - u;
		v = 1 - v;
	}
	*prim = area_find(trials->area, n, next_real(trials) * trials->area[n - 1]);
	ray_scene_corners(trials->scene, *prim, corner);
	for (int k = 0; k < 3; k++)
		place[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
}

/* Adds the places that are seen, of RUN random ones. */
static void try_places(struct trials *trials, struct trial_view *view, const double direction[3], int most)
{
	double place[RUN][3];
	uint32_t prim[RUN];
	struct ray ray[RUN];
	struct ray_hit hit[RUN];

	for (int i = 0; i < RUN; i++) {
		next_place(trials, &prim[i], place[i]);
		v3d_add_scaled(ray[i].origin, place[i], AWAY, direction);
		v3d_scale(ray[i].direction, direction, -1);
	}
	ray_scene_trace(trials->scene, ray, RUN, 0, hit);
	for (int i = 0; i < RUN && view->n < most; i++) {
		struct trial *trial = &view->trial[view->n];
		float p[3] = { (float)place[i][0], (float)place[i][1], (float)place[i][2] };
		float cosine = fminf(fabsf(v3f_dot(view->axis[2], ray_scene_normal(trials->scene, prim[i]))), 1);

		if (next_real(trials) > (double)cosine || hit[i].prim == RAY_NONE
		    || (hit[i].prim != prim[i] && fabs(hit[i].t - AWAY) > 1e-6))
			continue;
		trial->seen = trials_project(view->axis, p);
		trial->cosine = cosine;
		view->n++;
	}
}

static int make_view(struct trials *trials, struct trial_view *view, int n)
{
	double direction[3], frame[3][3], sine, cosine;

	view->trial = psr_alloc_array((size_t)n, sizeof *view->trial);
	if (view->trial == NULL)
		return PSR_ERR_MEMORY;
	next_direction(trials, direction);
	psr_direction_basis(direction, frame);
	psr_sincos(next_real(trials) * PI, &sine, &cosine);
	for (int k = 0; k < 3; k++) {
		view->axis[0][k] = (float)(cosine * frame[0][k] + sine * frame[1][k]);
		view->axis[1][k] = (float)(cosine * frame[1][k] - sine * frame[0][k]);
		view->axis[2][k] = (float)frame[2][k];
	}
	for (int tries = 0; tries < MOST_TRIES * (n / RUN + 1) && view->n < n; tries++)
		try_places(trials, view, direction, n);
	return PSR_OK;
}

int trials_create(struct trials **out, const struct psr_mesh *mesh, const struct ray_scene *scene, int n_views,
                  int n_a_view, struct psr_error *err)
{
	struct trials *trials;
	int rc;

	if (mesh->n_triangles == 0)
		return psr_fail(err, PSR_ERR_ARG, "a cloud of points has no area to try; give a mesh with faces");
	trials = calloc(1, sizeof *trials);
	if (trials == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for trials");
	*trials = (struct trials){ .mesh = mesh, .scene = scene, .random = SEED, .n_views = n_views };
	trials->view = calloc((size_t)n_views, sizeof *trials->view);
	trials->area = psr_alloc_array((size_t)mesh->n_triangles + mesh->n_points, sizeof *trials->area);
	rc = trials->view == NULL || trials->area == NULL ? PSR_ERR_MEMORY : PSR_OK;
	if (rc == PSR_OK)
		area_sum(scene, mesh, 1, trials->area); /* only triangles are tried: their sums need no scale */
	for (int v = 0; rc == PSR_OK && v < n_views; v++)
		rc = make_view(trials, &trials->view[v], n_a_view);
	if (rc != PSR_OK) {
		trials_destroy(trials);
		return psr_fail(err, rc, "no memory for trials");
	}
	*out = trials;
	return PSR_OK;
}

void trials_destroy(struct trials *trials)
{
	if (trials == NULL)
		return;
	for (int v = 0; trials->view != NULL && v < trials->n_views; v++)
		psr_free(trials->view[v].trial);
	free(trials->view);
	psr_free(trials->area);
	free(trials);
}

/* ---- running them ---- */

float trials_depth_tolerance(float cosine, double ds)
{
	float c = cosine > 0.03f ? cosine : 0.03f;

	return (float)ds * (1 + 1.5f * sqrtf(1 - c * c) / c);
}

struct run {
	const struct trials *trials;
	const struct trials_sample *sample;
	size_t n_samples;
	double ds;
	struct trials_count *count;
	int failed;
};

/* The points that a view sees, sorted into cells of a pixel's size. */
struct field {
	uint32_t side, *first; /* side * side + 1 */
	struct trials_seen *spot;
};

static uint32_t cell_of(float x, double ds, uint32_t side)
{
	double cell = floor((double)x / ds) + side / 2;

	return cell < 1 ? 1 : cell > side - 2 ? side - 2 : (uint32_t)cell;
}

static void field_make(struct field *field, const struct run *run, const struct trial_view *view, uint8_t *counts)
{
	const float (*normal)[3] = psr_direction_table();
	size_t n = 0;

	memset(field->first, 0, ((size_t)field->side * field->side + 1) * sizeof *field->first);
	for (int pass = 0; pass < 2; pass++) {
		for (size_t i = 0; i < run->n_samples; i++) {
			const struct trials_sample *sample = &run->sample[i];
			struct trials_seen spot;
			size_t cell;

			if (pass == 0)
				counts[i] = sample->two_sided || v3f_dot(view->axis[2], normal[sample->normal]) > -BACK;
			if (!counts[i])
				continue;
			spot = trials_project(view->axis, sample->position);
			cell = (size_t)cell_of(spot.y, run->ds, field->side) * field->side + cell_of(spot.x, run->ds, field->side);
			if (pass == 0)
				field->first[cell]++;
			else
				field->spot[--field->first[cell]] = spot;
		}
		for (size_t cell = 0; pass == 0 && cell <= (size_t)field->side * field->side; cell++)
			field->first[cell] = (uint32_t)(n += field->first[cell]);
	}
}

static int is_hit(const struct field *field, const struct trial *trial, double ds)
{
	float reach = fminf(0.75f / fmaxf(trial->cosine, 0.1f), FARTHEST);
	const struct trials_seen *seen = &trial->seen;
	float half = (float)(ds / 2), least = seen->z - trials_depth_tolerance(trial->cosine, ds);
	float most = seen->z + reach * (float)ds;
	uint32_t u = cell_of(seen->x, ds, field->side), v = cell_of(seen->y, ds, field->side);

	for (uint32_t row = v - 1; row <= v + 1; row++) {
		uint32_t from = field->first[row * field->side + u - 1], to = field->first[row * field->side + u + 2];

		for (uint32_t i = from; i < to; i++) {
			const struct trials_seen *spot = &field->spot[i];

			if (fabsf(spot->x - seen->x) <= half && fabsf(spot->y - seen->y) <= half && spot->z >= least
			    && spot->z <= most)
				return 1;
		}
	}
	return 0;
}

static void run_view(int v, void *userdata)
{
	struct run *run = userdata;
	const struct trial_view *view = &run->trials->view[v];
	struct field field = { .side = 2 * ((uint32_t)ceil(1.001 / run->ds) + 3) };
	uint8_t *counts = psr_alloc_array(run->n_samples, 1);
	uint64_t n_missing = 0;

	field.first = psr_alloc_array((size_t)field.side * field.side + 1, sizeof *field.first);
	field.spot = psr_alloc_array(run->n_samples, sizeof *field.spot);
	if (field.first == NULL || field.spot == NULL || counts == NULL) {
		__atomic_store_n(&run->failed, 1, __ATOMIC_RELAXED);
	} else {
		field_make(&field, run, view, counts);
		for (int i = 0; i < view->n; i++)
			n_missing += !is_hit(&field, &view->trial[i], run->ds);
		__atomic_fetch_add(&run->count->n_missing, n_missing, __ATOMIC_RELAXED);
		__atomic_fetch_add(&run->count->n_trials, (uint64_t)view->n, __ATOMIC_RELAXED);
	}
	psr_free(field.first);
	psr_free(field.spot);
	psr_free(counts);
}

int trials_run(struct trials_count *count, const struct trials *trials, const struct trials_sample *sample,
               size_t n_samples, double ds, struct psr_pool *pool)
{
	struct run run = { .trials = trials, .sample = sample, .n_samples = n_samples, .ds = ds, .count = count };

	*count = (struct trials_count){ 0, 0 };
	psr_pool_for(pool, trials->n_views, run_view, &run);
	return run.failed ? PSR_ERR_MEMORY : PSR_OK;
}
