#include "study_trials.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/vec.h"
#include "base/direction.h"
#include "base/random.h"
#include "ray/area.h"
#include "models/studies/greedy/parts.h"

#define PI 3.14159265358979323846
#define SEED UINT64_C(0x5053525354554459)
#define MOST_TRIES 1000 /* for each place that is wanted */
#define AWAY 4.0        /* rays begin this far from the place: outside of the unit sphere */
#define BACK 0.0125f    /* as the renderer's: what faces away by less than normals are quantised to still counts */
#define RUN 64
#define FARTHEST 4.0f   /* pixels before a place within which its surface may stand, at grazing angles */

struct trial {
	float x, y, z, cosine; /* in the frame of the view */
};

struct trial_view {
	float axis[3][3]; /* x and y along the pixels */
	int n;
	struct trial *trial;
};

struct study_trials {
	const struct psr_mesh *mesh;
	const struct ray_scene *scene;
	double *area; /* summed up to and with each triangle */
	uint64_t random;
	int n_views;
	struct trial_view *view;
};

static double next_real(struct study_trials *trials) /* 0 <= x < 1 */
{
	return random_in(&trials->random, 0, 1);
}

static void next_direction(struct study_trials *trials, double v[3])
{
	double square;

	do {
		for (int k = 0; k < 3; k++)
			v[k] = 2 * next_real(trials) - 1;
		square = v3d_dot(v, v);
	} while (square > 1 || square < 1e-4);
	v3d_normalize(v, v);
}

static uint32_t next_triangle(struct study_trials *trials)
{
	uint32_t n = trials->mesh->n_triangles;

	return area_find(trials->area, n, next_real(trials) * trials->area[n - 1]);
}

static void next_place(struct study_trials *trials, uint32_t *prim, double place[3])
{
	double u = next_real(trials), v = next_real(trials), corner[3][3];

	if (u + v > 1) {
		u = 1 - u;
		v = 1 - v;
	}
	*prim = next_triangle(trials);
	ray_scene_corners(trials->scene, *prim, corner);
	for (int k = 0; k < 3; k++)
		place[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
}

/* Adds those of RUN random places that are seen. */
static void try_places(struct study_trials *trials, struct trial_view *view, const double direction[3], int most)
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
		trial->x = v3f_dot(view->axis[0], p);
		trial->y = v3f_dot(view->axis[1], p);
		trial->z = v3f_dot(view->axis[2], p);
		trial->cosine = cosine;
		view->n++;
	}
}

static int make_view(struct study_trials *trials, struct trial_view *view, int n)
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

static int sum_areas(struct study_trials *trials)
{
	double sum = 0;

	trials->area = psr_alloc_array(trials->mesh->n_triangles, sizeof *trials->area);
	if (trials->area == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < trials->mesh->n_triangles; i++) {
		double corner[3][3], e1[3], e2[3], n[3];

		ray_scene_corners(trials->scene, i, corner);
		v3d_sub(e1, corner[1], corner[0]);
		v3d_sub(e2, corner[2], corner[0]);
		v3d_cross(n, e1, e2);
		sum += v3d_length(n) / 2;
		trials->area[i] = sum;
	}
	return PSR_OK;
}

int study_trials_create(struct study_trials **out, const struct psr_mesh *mesh, const struct ray_scene *scene,
                        int n_views, int n_a_view, struct psr_error *err)
{
	struct study_trials *trials;
	int rc;

	if (mesh->n_triangles == 0)
		return psr_fail(err, PSR_ERR_ARG, "a cloud of points has no area to try; give a mesh with faces");
	trials = calloc(1, sizeof *trials);
	if (trials == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for trials");
	*trials = (struct study_trials){ .mesh = mesh, .scene = scene, .random = SEED, .n_views = n_views };
	trials->view = calloc((size_t)n_views, sizeof *trials->view);
	rc = trials->view == NULL ? PSR_ERR_MEMORY : sum_areas(trials);
	for (int v = 0; rc == PSR_OK && v < n_views; v++)
		rc = make_view(trials, &trials->view[v], n_a_view);
	if (rc != PSR_OK) {
		study_trials_destroy(trials);
		return psr_fail(err, rc, "no memory for trials");
	}
	*out = trials;
	return PSR_OK;
}

void study_trials_destroy(struct study_trials *trials)
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

struct spot {
	float x, y, z;
};

struct run {
	const struct study_trials *trials;
	const struct greedy_point *point;
	size_t n_points;
	double ds;
	uint64_t n_trials, n_missing;
	int failed;
};

/* What a view sees of the points, sorted into cells of a pixel's size. */
struct field {
	uint32_t side, *first; /* side * side + 1 */
	struct spot *spot;
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
		for (size_t i = 0; i < run->n_points; i++) {
			const struct greedy_point *point = &run->point[i];
			struct spot spot;
			size_t cell;

			if (pass == 0)
				counts[i] = point->two_sided || v3f_dot(view->axis[2], normal[point->normal]) > -BACK;
			if (!counts[i])
				continue;
			spot = (struct spot){ v3f_dot(view->axis[0], point->position), v3f_dot(view->axis[1], point->position),
				                  v3f_dot(view->axis[2], point->position) };
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
	float half = (float)(ds / 2), least = trial->z - greedy_depth_tolerance(trial->cosine, ds);
	float most = trial->z + reach * (float)ds;
	uint32_t u = cell_of(trial->x, ds, field->side), v = cell_of(trial->y, ds, field->side);

	for (uint32_t row = v - 1; row <= v + 1; row++) {
		uint32_t from = field->first[row * field->side + u - 1], to = field->first[row * field->side + u + 2];

		for (uint32_t i = from; i < to; i++) {
			const struct spot *spot = &field->spot[i];

			if (fabsf(spot->x - trial->x) <= half && fabsf(spot->y - trial->y) <= half && spot->z >= least
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
	uint8_t *counts = psr_alloc_array(run->n_points, 1);
	uint64_t n_missing = 0;

	field.first = psr_alloc_array((size_t)field.side * field.side + 1, sizeof *field.first);
	field.spot = psr_alloc_array(run->n_points, sizeof *field.spot);
	if (field.first == NULL || field.spot == NULL || counts == NULL) {
		__atomic_store_n(&run->failed, 1, __ATOMIC_RELAXED);
	} else {
		field_make(&field, run, view, counts);
		for (int i = 0; i < view->n; i++)
			n_missing += !is_hit(&field, &view->trial[i], run->ds);
		__atomic_fetch_add(&run->n_missing, n_missing, __ATOMIC_RELAXED);
		__atomic_fetch_add(&run->n_trials, (uint64_t)view->n, __ATOMIC_RELAXED);
	}
	psr_free(field.first);
	psr_free(field.spot);
	psr_free(counts);
}

int study_trials_run(const struct study_trials *trials, const struct greedy_point *point, size_t n_points, double ds,
                     struct psr_pool *pool, uint64_t *n_trials, uint64_t *n_missing)
{
	struct run run = { .trials = trials, .point = point, .n_points = n_points, .ds = ds };

	psr_pool_for(pool, trials->n_views, run_view, &run);
	*n_trials = run.n_trials;
	*n_missing = run.n_missing;
	return run.failed ? PSR_ERR_MEMORY : PSR_OK;
}
