#include "cloud_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "shape.h"

#define CHUNK 1024
#define MOST_WIDE 288        /* points of the widest polynomial */
#define RINGS 3              /* neighbours of neighbours, and so on, that a polynomial may take */
#define LEAST 6              /* points that a polynomial of six coefficients needs */
#define LEAST_COSINE 0.5     /* between the normal that a point came with, and that of its polynomial */
#define GROWTH 1.5           /* residuals that grow by more are no noise */
#define CREASE 3.5           /* 1 % of the neighbours' reach counts as 2 degrees */
#define SHARP 8              /* residuals at a crease over those beside it */
#define ROUNDS 3             /* of points that lean on a neighbour's polynomial, which may lean itself */
#define WIDEST_COSINE -0.866 /* of 150 degrees */

struct fitting {
	struct cloud_fit *fit;
	const struct dpoint_cloud *cloud;
	const struct dpoint_cover_options *cover;
	double delta;
	const uint8_t *is_fine; /* before this round */
};

static int compare(const void *a, const void *b)
{
	const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;

	return (x > y) - (x < y);
}

/* Adds the neighbours of all that are there: each once. */
static uint32_t widen(uint32_t list[MOST_WIDE], uint32_t n, const struct dpoint_cloud *cloud, uint32_t i)
{
	uint32_t all[MOST_WIDE * (DPOINT_MOST_NEAR + 1)], n_all = 0, kept = 0;

	for (uint32_t j = 0; j < n; j++) {
		all[n_all++] = list[j];
		for (uint32_t k = 0; k < cloud->k; k++)
			all[n_all++] = cloud->near[(size_t)list[j] * cloud->k + k];
	}
	qsort(all, n_all, sizeof *all, compare);
	for (uint32_t j = 0; j < n_all; j++) {
		if (all[j] == i || (j > 0 && all[j] == all[j - 1]))
			continue;
		if (kept == MOST_WIDE)
			return 0;
		list[kept++] = all[j];
	}
	return kept;
}

static void begin(struct cloud_fit *fit, const struct dpoint_cloud *cloud, uint32_t i)
{
	double normal[3];

	*fit = (struct cloud_fit){ .state = CLOUD_FLAT };
	memcpy(fit->local.at, cloud->at[i], sizeof fit->local.at);
	for (int k = 0; k < 3; k++)
		normal[k] = (double)cloud->normal[i][k];
	psr_direction_basis(normal, fit->local.axis);
}

/* Over a rectangle of half a side e a normal is off by e times the curvature's error. Of heights with errors of `off`,
 * n of them evenly within a circle of radius r, that is 8.5 off / (sqrt(n) r^2): x^2 has the variance 1/16 over the
 * unit circle, and -1/48 with y^2. What rounds a crease off is bent so much that this is little; its residuals are
 * not. */
static double turn_of(const struct fitting *f, const struct cloud_fit *fit, uint32_t n)
{
	const double *s = fit->local.shape, error = 8.5 * fit->off / (sqrt((double)n) * fit->reach * fit->reach);
	const double bend = sqrt(s[0] * s[0] + 2 * s[1] * s[1] + s[2] * s[2]);
	const double extent = bend * f->delta > (double)f->cover->sine ? (double)f->cover->sine / bend : f->delta;

	return fmax(error * extent, CREASE * fit->off / fit->reach);
}

static void try(struct cloud_fit *fit, const struct fitting *f, uint32_t i, const uint32_t *list, uint32_t n)
{
	const struct dpoint_cloud *cloud = f->cloud;
	struct dpoint_neighbour around[MOST_WIDE];
	double normal[3];

	begin(fit, cloud, i);
	memcpy(normal, fit->local.axis[2], sizeof normal);
	for (uint32_t j = 0; j < n; j++) {
		double away[3];

		memcpy(around[j].at, cloud->at[list[j]], sizeof around[j].at);
		memset(around[j].normal, 0, sizeof around[j].normal);
		v3d_sub(away, around[j].at, cloud->at[i]);
		fit->reach = fmax(fit->reach, v3d_dot(away, away));
	}
	fit->reach = sqrt(fit->reach);
	if (n < LEAST || !dpoint_shape_of_cloud(&fit->local, &fit->off, around, n) ||
	    !(v3d_dot(normal, fit->local.axis[2]) > LEAST_COSINE)) {
		begin(fit, cloud, i);
		return;
	}
	fit->turn = turn_of(f, fit, n);
	fit->state = fit->turn <= (double)f->cover->angle ? CLOUD_FINE : CLOUD_ROUGH;
}

static void fit_one(const struct fitting *f, uint32_t i)
{
	const uint32_t k = f->cloud->k;
	struct cloud_fit *fit = &f->fit[i], wide;
	uint32_t list[MOST_WIDE], n = k;
	double off;

	memcpy(list, &f->cloud->near[(size_t)i * k], k * sizeof *list);
	try(fit, f, i, list, n);
	off = fit->state == CLOUD_FLAT ? INFINITY : fit->off;
	for (int ring = 0; ring < RINGS && fit->state != CLOUD_FINE; ring++) {
		n = widen(list, n, f->cloud, i);
		if (n == 0)
			return;
		try(&wide, f, i, list, n);
		if (wide.state == CLOUD_FLAT || (fit->state != CLOUD_FLAT && wide.turn >= fit->turn) || wide.off > GROWTH * off)
			return;
		if (fit->state == CLOUD_FLAT)
			off = wide.off;
		*fit = wide;
	}
}

/* The surface of `from` at x, y of its frame. */
static void follow(struct dpoint_local *to, const struct dpoint_local *from, double x, double y)
{
	const double *s = from->shape, p = s[0] * x + s[1] * y, q = s[1] * x + s[2] * y;
	const double height = 0.5 * (p * x + q * y), w = sqrt(1 + p * p + q * q), e = sqrt(1 + p * p);
	/* In lengths along two tangents at right angles: x alone, and what is left of y. */
	const double one[2] = { 1 / e, 0 }, two[2] = { -p * q / (e * w), e / w };
	const double frame[3][3] = { { one[0], 0, p * one[0] }, { two[0], two[1], p * two[0] + q * two[1] },
		                         { -p / w, -q / w, 1 / w } };

	for (int k = 0; k < 3; k++) {
		to->at[k] = from->at[k] + x * from->axis[0][k] + y * from->axis[1][k] + height * from->axis[2][k];
		for (int i = 0; i < 3; i++)
			to->axis[i][k] = frame[i][0] * from->axis[0][k] + frame[i][1] * from->axis[1][k] + frame[i][2] * from->axis[2][k];
	}
	to->shape[0] = s[0] * one[0] * one[0] / w;
	to->shape[1] = one[0] * (s[0] * two[0] + s[1] * two[1]) / w;
	to->shape[2] = (s[0] * two[0] * two[0] + 2 * s[1] * two[0] * two[1] + s[2] * two[1] * two[1]) / w;
}

/* The polynomial of the fine neighbour that the point is nearest to, if it is no further off than that one's own. */
static void lean(const struct fitting *f, uint32_t i)
{
	const struct dpoint_cloud *cloud = f->cloud;
	struct cloud_fit *fit = &f->fit[i];
	const struct cloud_fit *best = NULL;
	double least = INFINITY, at[2] = { 0, 0 };

	for (uint32_t j = 0; j < cloud->k; j++) {
		const uint32_t other = cloud->near[(size_t)i * cloud->k + j];
		const struct cloud_fit *o = &f->fit[other];
		double away[3], p[3], off;

		if (!f->is_fine[other])
			continue;
		v3d_sub(away, cloud->at[i], o->local.at);
		m3d_apply(p, (const double(*)[3])o->local.axis, away);
		off = fabs(p[2] - 0.5 * (o->local.shape[0] * p[0] * p[0] + o->local.shape[2] * p[1] * p[1]) -
		           o->local.shape[1] * p[0] * p[1]);
		if (off < least && off <= 3 * o->off + 0.02 * (double)cloud->radius[i] && SHARP * o->off < fit->off) {
			least = off;
			best = o;
			memcpy(at, p, sizeof at);
		}
	}
	if (best == NULL)
		return;
	follow(&fit->local, &best->local, at[0], at[1]);
	fit->off = best->off;
	fit->reach = best->reach;
	fit->state = CLOUD_FINE;
}

/* ---- borders ---- */

/* Grows with the angle of a direction, from 0 to 4. */
static double turn_around(const double d[2])
{
	const double t = d[1] / (fabs(d[0]) + fabs(d[1]));

	return d[0] >= 0 ? (d[1] >= 0 ? t : 4 + t) : 2 - t;
}

/* Whether no neighbour is within 150 degrees, and where. */
static void find_border(const struct fitting *f, uint32_t i)
{
	const struct dpoint_cloud *cloud = f->cloud;
	struct cloud_fit *fit = &f->fit[i];
	double direction[DPOINT_MOST_NEAR][2];
	uint32_t n = 0;

	for (uint32_t j = 0; j < cloud->k; j++) {
		double away[3], d[2], length;
		uint32_t to;

		v3d_sub(away, cloud->at[cloud->near[(size_t)i * cloud->k + j]], cloud->at[i]);
		d[0] = v3d_dot(away, fit->local.axis[0]);
		d[1] = v3d_dot(away, fit->local.axis[1]);
		length = sqrt(d[0] * d[0] + d[1] * d[1]);
		if (!(length > 0))
			continue;
		for (to = n++; to > 0 && turn_around(direction[to - 1]) > turn_around(d); to--)
			memcpy(direction[to], direction[to - 1], sizeof d);
		direction[to][0] = d[0] / length;
		direction[to][1] = d[1] / length;
	}
	for (uint32_t j = 0; j < n; j++) {
		const double *a = direction[j], *b = direction[(j + 1) % n];
		const double cross = a[0] * b[1] - a[1] * b[0], dot = a[0] * b[0] + a[1] * b[1];
		double out[2] = { b[1] - a[1], a[0] - b[0] }, length = sqrt(out[0] * out[0] + out[1] * out[1]);

		if (cross >= 0 && dot >= WIDEST_COSINE && n > 1)
			continue;
		fit->has_border = 1;
		fit->border[0] = (float)(length > 0 ? out[0] / length : -a[0]);
		fit->border[1] = (float)(length > 0 ? out[1] / length : -a[1]);
		return;
	}
}

/* Along the normal at most so far from where the point was. */
static void hold(const struct fitting *f, uint32_t i)
{
	const double error = (double)f->cover->error, r = (double)f->cloud->radius[i];
	const double most = error > 0 ? fmin(0.5 * error, 0.5 * r) : 0.5 * r;
	double away[3], length;

	v3d_sub(away, f->fit[i].local.at, f->cloud->at[i]);
	length = v3d_length(away);
	if (length > most)
		for (int k = 0; k < 3; k++)
			f->fit[i].local.at[k] = f->cloud->at[i][k] + away[k] * most / length;
}

/* ---- all of them ---- */

static void each(int chunk, const struct fitting *f, void (*fn)(const struct fitting *f, uint32_t i))
{
	const uint64_t first = (uint64_t)chunk * CHUNK, end = first + CHUNK < f->cloud->n ? first + CHUNK : f->cloud->n;

	for (uint64_t i = first; i < end; i++)
		fn(f, (uint32_t)i);
}

static void lean_if_rough(const struct fitting *f, uint32_t i)
{
	if (f->fit[i].state == CLOUD_ROUGH)
		lean(f, i);
}

static void finish(const struct fitting *f, uint32_t i)
{
	hold(f, i);
	if (f->fit[i].state != CLOUD_FLAT)
		find_border(f, i);
}

static void fit_chunk(int chunk, void *userdata)
{
	each(chunk, userdata, fit_one);
}

static void lean_chunk(int chunk, void *userdata)
{
	each(chunk, userdata, lean_if_rough);
}

static void finish_chunk(int chunk, void *userdata)
{
	each(chunk, userdata, finish);
}

int cloud_fit_all(struct cloud_fit *fit, const struct dpoint_cloud *cloud, const struct dpoint_cover_options *cover,
                  float delta, struct psr_pool *pool)
{
	const int n_chunks = (int)((cloud->n + CHUNK - 1) / CHUNK);
	uint8_t *is_fine = malloc((size_t)cloud->n + 1);
	struct fitting f = { .fit = fit, .cloud = cloud, .cover = cover, .delta = (double)delta, .is_fine = is_fine };

	if (is_fine == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(pool, n_chunks, fit_chunk, &f);
	for (int round = 0; round < ROUNDS; round++) {
		for (uint32_t i = 0; i < cloud->n; i++)
			is_fine[i] = fit[i].state == CLOUD_FINE;
		psr_pool_for(pool, n_chunks, lean_chunk, &f);
	}
	psr_pool_for(pool, n_chunks, finish_chunk, &f);
	free(is_fine);
	return PSR_OK;
}
