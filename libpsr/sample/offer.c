#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/vec.h"
#include "level.h"
#include "psr/error.h"

/* A kept sample within half a pixel is in every pixel that has the place in its middle. */
#define NEAR 0.5

/* [G] 4.3 wants sides of at most a pixel; a twentieth is forgiven, as the middle of such a triangle is 0.6 pixels from its
 * corners at most, and a pixel reaches 0.5 to 0.71. */
#define LONGEST_SIDE 1.05

/* A place is on such a triangle as far off its plane: surfaces are rough, but what is half a pixel off is another one. */
#define OFF_TRIANGLE 0.4

#define N_TRIES 10
#define LEAST_COSINE 0.3f
#define LEAST_ALIKE 0.6f
#define N_TRIANGLES 3
#define DEAD_PATCH 12 /* a new block costs as much as this many samples more in one that is there */

/* What offers cost at least, in samples: a single hit covers less than a triangle; a moved sample is off by up to half a
 * pixel. */
#define HIT 1.5f
#define SNAP 3
#define MOST_SNAP 0.55

struct tries {
	unsigned projection[N_TRIES];
	int n;
};

/* Projections by how well they face a spot. */
static void list_tries(const struct level *level, const struct surface_spot *spot, struct tries *tries)
{
	float smooth[3], score[N_TRIES];

	tries->n = 0;
	field_normal(&level->field, spot->p, spot->n, smooth);
	for (unsigned q = 0; q < level->n_projections; q++) {
		const float *axis = level->sheets[q].projection.axis[2];
		float g = v3f_dot(axis, smooth);
		int i = tries->n;

		if (v3f_dot(axis, spot->n) < LEAST_COSINE || (i == N_TRIES && g <= score[N_TRIES - 1]))
			continue;
		i = i < N_TRIES ? tries->n++ : N_TRIES - 1;
		for (; i > 0 && score[i - 1] < g; i--) {
			score[i] = score[i - 1];
			tries->projection[i] = tries->projection[i - 1];
		}
		score[i] = g;
		tries->projection[i] = q;
	}
}

struct corner {
	struct lattice_point at;
	struct sheet_ref ref;
	float position[3], distance2;
	int is_kept;
};

/* The corners of the lattice triangle of projection q around a spot; those without a hit of its surface have no patch. */
static void find_corners(const struct level *level, unsigned q, const struct surface_spot *spot, struct corner corner[3])
{
	const struct sheets *sheets = &level->sheets[q];
	struct lattice_point at[3];
	float projected[3];
	int is_thin = level_is_thin(level, spot->surface);

	level_project(&sheets->projection, spot->p, projected);
	sheets_triangle(sheets, (double)projected[0], (double)projected[1], at);
	for (int i = 0; i < 3; i++) {
		struct corner *c = &corner[i];
		float d[3], n[3];
		uint32_t surface;

		c->at = at[i];
		c->ref = sheets_find(sheets, at[i], projected[2], SHEET_STEPS * sheets->projection.spacing);
		if (c->ref.patch == SHEET_NONE)
			continue;
		surface = sheets->sample[c->ref.patch][c->ref.sample].surface;
		level_normal(level, surface, n);
		if (v3f_dot(n, spot->n) < LEAST_ALIKE && !(is_thin && level_is_thin(level, surface))) {
			c->ref.patch = SHEET_NONE;
			continue;
		}
		sheets_position(sheets, c->ref, c->position);
		v3f_sub(d, c->position, spot->p);
		c->distance2 = v3f_dot(d, d);
		c->is_kept = (int)(sheets->patch[c->ref.patch].kept >> c->ref.sample & 1);
	}
}

/* Whether the corners make a triangle that is small enough, and the spot is on it, not on something beside it. */
static int is_triangle(const struct level *level, const struct surface_spot *spot, const struct corner corner[3])
{
	const float most = (float)(LONGEST_SIDE * LONGEST_SIDE * level->ds * level->ds);
	float d[3][3], n[3], off[3], away;

	for (int i = 0; i < 3; i++)
		if (corner[i].ref.patch == SHEET_NONE)
			return 0;
	for (int i = 0; i < 3; i++) {
		v3f_sub(d[i], corner[i].position, corner[(i + 1) % 3].position);
		if (v3f_dot(d[i], d[i]) > most)
			return 0;
	}
	v3f_cross(n, d[0], d[1]);
	v3f_sub(off, spot->p, corner[0].position);
	away = v3f_dot(off, n);
	return away * away <= (float)(OFF_TRIANGLE * OFF_TRIANGLE * level->ds * level->ds) * v3f_dot(n, n);
}

int offer_is_covered(const struct level *level, const struct surface_spot *spot)
{
	struct tries tries;

	if (cover_is_near(&level->cover, spot->p, spot->n, NEAR * level->ds))
		return 1;
	list_tries(level, spot, &tries);
	for (int i = 0; i < tries.n && i < N_TRIANGLES; i++) {
		struct corner corner[3];

		find_corners(level, tries.projection[i], spot, corner);
		if (is_triangle(level, spot, corner) && corner[0].is_kept && corner[1].is_kept && corner[2].is_kept)
			return 1;
	}
	return 0;
}

static int keep_corner(struct level *level, unsigned projection, const struct corner *corner)
{
	return keep_sample(level, (struct level_ref){ projection, corner->ref });
}

/* A patch of which nothing is kept yet costs a block, shared by all places that could use it. */
static float opening_cost(const struct level *level, unsigned projection, const struct corner *corner)
{
	const struct patch *patch = &level->sheets[projection].patch[corner->ref.patch];

	return patch->is_alive ? 0 : DEAD_PATCH + 4.0f / (float)(1 + patch->n_wanted);
}

/* What would cover a spot, and what it costs in samples. */
struct offer {
	unsigned projection;
	struct corner corner[3];
	int n; /* corners to keep */
	int is_snap; /* the one corner is to be made, with the third of `position` for its depth */
	float cost;
};

/* The lattice triangle that lacks least. */
static void offer_triangle(const struct level *level, const struct surface_spot *spot, const struct tries *tries,
                           struct offer *best)
{
	for (int i = 0; i < tries->n && i < N_TRIANGLES && (float)i / 2 < best->cost; i++) {
		struct corner corner[3];
		float cost = (float)i / 2, opening = 0;

		find_corners(level, tries->projection[i], spot, corner);
		if (!is_triangle(level, spot, corner))
			continue;
		for (int k = 0; k < 3; k++) {
			cost += corner[k].is_kept ? 0 : 0.5f;
			opening = fmaxf(opening, opening_cost(level, tries->projection[i], &corner[k]));
		}
		cost += opening;
		if (cost < best->cost) {
			*best = (struct offer){ .projection = tries->projection[i], .n = 3, .cost = cost };
			memcpy(best->corner, corner, sizeof corner);
		}
	}
}

/* The nearest hit of any projection. It covers less than a triangle does. */
static void offer_nearest(const struct level *level, const struct surface_spot *spot, const struct tries *tries,
                          struct offer *best)
{
	for (int i = 0; i < tries->n && HIT + (float)i / 2 < best->cost; i++) {
		struct corner corner[3];

		find_corners(level, tries->projection[i], spot, corner);
		for (int k = 0; k < 3; k++) {
			float distance = (float)(sqrt((double)corner[k].distance2) / level->ds), cost;

			if (corner[k].ref.patch == SHEET_NONE || distance > (float)NEAR)
				continue;
			cost = HIT + distance / 4 + (float)i / 2 + opening_cost(level, tries->projection[i], &corner[k]);
			if (cost < best->cost)
				*best = (struct offer){ .projection = tries->projection[i], .n = 1, .cost = cost,
					                    .corner = { corner[k] } };
		}
	}
}

/* A place by a face's edge, or on something too thin for any lattice, can be moved to a lattice point: along the face, by
 * what a sample may be off at most. */
static void offer_snap(const struct level *level, const struct surface_spot *spot, const struct tries *tries,
                       struct offer *best)
{
	int two_sided = level_is_sheet(level, spot->surface);

	for (int i = 0; i < tries->n && i < N_TRIANGLES && SNAP < best->cost; i++) {
		const struct sheets *sheets = &level->sheets[tries->projection[i]];
		struct lattice_point at[3];
		float p[3], n[3];

		level_project(&sheets->projection, spot->p, p);
		level_project(&sheets->projection, spot->n, n);
		sheets_triangle(sheets, (double)p[0], (double)p[1], at);
		for (int k = 0; k < 3; k++) {
			struct corner corner = { .at = at[k] };
			double x, y, dx, dy, dz, distance;
			float cost;

			sheets_point(sheets, at[k].row, at[k].col, &x, &y);
			dx = x - (double)p[0];
			dy = y - (double)p[1];
			dz = -(dx * (double)n[0] + dy * (double)n[1]) / (double)n[2];
			distance = sqrt(dx * dx + dy * dy + dz * dz) / level->ds;
			corner.position[2] = p[2] + (float)dz;
			corner.ref = sheets_room(sheets, at[k], corner.position[2], two_sided);
			cost = SNAP + 24.0f * (float)distance + (corner.ref.patch != SHEET_NONE ? 0 : DEAD_PATCH);
			if (distance <= MOST_SNAP && cost < best->cost)
				*best = (struct offer){ .projection = tries->projection[i], .n = 1, .is_snap = 1, .cost = cost,
					                    .corner = { corner } };
		}
	}
}

static int keep_snapped(struct level *level, const struct surface_spot *spot, const struct offer *offer)
{
	struct level_ref ref = { .projection = offer->projection };
	int two_sided = level_is_sheet(level, spot->surface);
	int rc = sheets_add(&level->sheets[offer->projection], offer->corner[0].at, offer->corner[0].position[2],
	                    spot->surface, two_sided, &ref.at);

	if (rc != PSR_OK || ref.at.patch == SHEET_NONE)
		return rc;
	return keep_sample(level, ref);
}

int offer_take(struct level *level, const struct surface_spot *spot, float most, int *is_left)
{
	struct offer best = { .cost = INFINITY };
	struct tries tries;
	int rc = PSR_OK;

	*is_left = 0;
	list_tries(level, spot, &tries);
	if (tries.n == 0)
		return PSR_OK;
	offer_triangle(level, spot, &tries, &best);
	offer_nearest(level, spot, &tries, &best);
	offer_snap(level, spot, &tries, &best);
	*is_left = best.cost > most;
	if (*is_left)
		return PSR_OK;
	if (best.is_snap)
		return keep_snapped(level, spot, &best);
	for (int k = 0; rc == PSR_OK && k < best.n; k++)
		rc = keep_corner(level, best.projection, &best.corner[k]);
	return rc;
}

void offer_ask(struct level *level, const struct surface_spot *spot)
{
	const float near2 = (float)(NEAR * NEAR * level->ds * level->ds);
	struct tries tries;

	list_tries(level, spot, &tries);
	for (int i = 0; i < tries.n; i++) {
		struct sheets *sheets = &level->sheets[tries.projection[i]];
		uint32_t last = SHEET_NONE;
		struct corner corner[3];

		find_corners(level, tries.projection[i], spot, corner);
		for (int k = 0; k < 3; k++) {
			uint32_t p = corner[k].ref.patch;

			if (p == SHEET_NONE || p == last || corner[k].distance2 > near2 || sheets->patch[p].n_wanted == UINT16_MAX)
				continue;
			sheets->patch[p].n_wanted++;
			last = p;
		}
	}
}
