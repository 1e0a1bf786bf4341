#include <math.h>
#include "base/vec.h"
#include "candidates.h"
#include "psr/error.h"

/* A kept sample within half a pixel is in every pixel that has the place in its middle. */
#define NEAR 0.5

/* [G] 4.3 wants sides of at most a pixel; a twentieth is forgiven, as the middle of such a triangle is 0.6 pixels from
 * its corners at most, and a pixel reaches 0.5 to 0.71. */
#define LONGEST_SIDE 1.05

/* A place is on such a triangle as far off its plane: surfaces are rough, but what is half a pixel off is another
 * one. */
#define OFF_TRIANGLE 0.4

#define LEAST_COSINE 0.3f
#define LEAST_ALIKE 0.6f

/* What offers cost at least, in samples: a single hit covers less than a triangle; a moved sample is off by up to half
 * a pixel. */
#define HIT 1.5f
#define SNAP 3
#define MOST_SNAP 0.55

/* What a new block costs; and what a moved sample costs more in a projection that faces the place worse than three
 * others: many of these would show in colors and distances. At coarser levels moving comes before new blocks. */
#define NEW_BLOCK 12
#define NEW_COARSE_BLOCK 16
#define WANTED 4.0f /* and up to this more, the fewer places want it */
#define SNAP_ASIDE 4

struct tries {
	unsigned projection[OFFER_TRIES];
	int n;
};

/* Projections by how well they face a spot. */
static void list_tries(const struct level *level, const struct surface_spot *spot, struct tries *tries)
{
	float smooth[3], score[OFFER_TRIES];

	tries->n = 0;
	field_normal(&level->field, spot->p, spot->n, smooth);
	for (unsigned q = 0; q < level->n_projections; q++) {
		const float *axis = level->sheets[q].projection.axis[2];
		float g = v3f_dot(axis, smooth);
		int i = tries->n;

		if (v3f_dot(axis, spot->n) < LEAST_COSINE || (i == OFFER_TRIES && g <= score[OFFER_TRIES - 1]))
			continue;
		i = i < OFFER_TRIES ? tries->n++ : OFFER_TRIES - 1;
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

/* The corners of the lattice triangle of projection q around a spot; those without a hit of its surface have no
 * patch. */
static void find_corners(const struct level *level, unsigned q, const struct surface_spot *spot,
                         struct corner corner[3], float projected[3])
{
	const struct sheets *sheets = &level->sheets[q];
	struct lattice_point at[3];
	struct sheet_ref ref[3];
	int is_thin = level_is_thin(level, spot->surface);

	level_project(&sheets->projection, spot->p, projected);
	sheets_triangle(sheets, (double)projected[0], (double)projected[1], at);
	sheets_find_corners(sheets, at, projected[2], SHEET_STEPS * sheets->projection.spacing, ref);
	for (int i = 0; i < 3; i++) {
		struct corner *c = &corner[i];
		float d[3], n[3];
		uint32_t surface;

		c->at = at[i];
		c->ref = ref[i];
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

/* What was found out about a spot: of each try the corners around it, and it in the space of that projection. */
struct look {
	struct tries tries;
	int n; /* tries of which this is known */
	struct corner corner[OFFER_TRIES][3];
	float projected[OFFER_TRIES][3];
};

static void look_next(const struct level *level, const struct surface_spot *spot, struct look *look)
{
	find_corners(level, look->tries.projection[look->n], spot, look->corner[look->n], look->projected[look->n]);
	look->n++;
}

/* Whether a spot is on a triangle of kept samples. */
static int is_on_kept(const struct level *level, const struct surface_spot *spot, struct look *look)
{
	list_tries(level, spot, &look->tries);
	look->n = 0;
	while (look->n < look->tries.n && look->n < OFFER_TRIANGLES) {
		const struct corner *corner = look->corner[look->n];

		look_next(level, spot, look);
		if (is_triangle(level, spot, corner) && corner[0].is_kept && corner[1].is_kept && corner[2].is_kept)
			return 1;
	}
	return 0;
}

int offer_is_covered(const struct level *level, const struct surface_spot *spot)
{
	struct look look;

	return cover_is_near(&level->cover, spot->p, spot->n, NEAR * level->ds) || is_on_kept(level, spot, &look);
}

/* Moved to the corners that try i found. */
static void find_snaps(const struct level *level, int i, const struct surface_spot *spot, const struct look *look,
                       struct offers *offers)
{
	const struct corner *corner = look->corner[i];
	const unsigned q = look->tries.projection[i];
	const struct sheets *sheets = &level->sheets[q];
	const float *p = look->projected[i];
	const float aside = level->finer == NULL && i >= OFFER_TRIANGLES ? SNAP_ASIDE : 0;
	float n[3];

	level_project(&sheets->projection, spot->n, n);
	for (int k = 0; k < 3; k++) {
		double x, y, dx, dy, dz, distance2;

		sheets_point(sheets, corner[k].at.row, corner[k].at.col, &x, &y);
		dx = x - (double)p[0];
		dy = y - (double)p[1];
		dz = -(dx * (double)n[0] + dy * (double)n[1]) / (double)n[2];
		distance2 = (dx * dx + dy * dy + dz * dz) / (level->ds * level->ds);
		if (distance2 <= MOST_SNAP * MOST_SNAP)
			offers->snap[offers->n_snaps++] = (struct offer_snap){ q, SNAP + aside + 24 * sqrtf((float)distance2),
				                                                   p[2] + (float)dz, corner[k].at };
	}
}

static const struct patch *patch_of(const struct level *level, unsigned projection, struct sheet_ref ref)
{
	return &level->sheets[projection].patch[ref.patch];
}

static void find(const struct level *level, const struct surface_spot *spot, struct look *look, struct offers *offers)
{
	float least = INFINITY;

	offers->n_triangles = offers->n_hits = offers->n_snaps = 0;
	/* Offers of others cannot cost less than a hit in a block that is there, and such hits stay. */
	for (int i = 0; i < look->tries.n && (i < OFFER_TRIANGLES || HIT + (float)i / 2 < least); i++) {
		unsigned q = look->tries.projection[i];
		const struct corner *corner = look->corner[i];

		if (i == look->n)
			look_next(level, spot, look);
		if (i < OFFER_TRIANGLES && is_triangle(level, spot, corner))
			offers->triangle[offers->n_triangles++] =
				(struct offer){ q, (float)i / 2, { corner[0].ref, corner[1].ref, corner[2].ref } };
		for (int k = 0; k < 3; k++) {
			float distance, cost;

			if (corner[k].ref.patch == SHEET_NONE)
				continue;
			distance = (float)(sqrt((double)corner[k].distance2) / level->ds);
			cost = HIT + distance / 4 + (float)i / 2;
			if (distance > (float)NEAR)
				continue;
			offers->hit[offers->n_hits++] = (struct offer){ q, cost, { corner[k].ref } };
			if (cost < least && patch_of(level, q, corner[k].ref)->is_alive)
				least = cost;
		}
		find_snaps(level, i, spot, look, offers);
	}
}

int offer_look(const struct level *level, const struct surface_spot *spot, struct offers *offers)
{
	struct look look;

	if (cover_is_near(&level->cover, spot->p, spot->n, NEAR * level->ds) || is_on_kept(level, spot, &look))
		return 1;
	find(level, spot, &look, offers);
	return 0;
}

void offer_find(const struct level *level, const struct surface_spot *spot, struct offers *offers)
{
	struct look look = { .n = 0 };

	list_tries(level, spot, &look.tries);
	find(level, spot, &look, offers);
}

static int is_kept(const struct level *level, const struct offer *offer, int corner)
{
	return (int)(patch_of(level, offer->projection, offer->ref[corner])->kept >> offer->ref[corner].sample & 1);
}

int offer_is_superfluous(const struct level *level, const struct surface_spot *spot, const struct offers *offers)
{
	if (cover_is_near(&level->cover, spot->p, spot->n, NEAR * level->ds))
		return 1;
	for (int i = 0; i < offers->n_triangles; i++) {
		const struct offer *offer = &offers->triangle[i];

		if (is_kept(level, offer, 0) && is_kept(level, offer, 1) && is_kept(level, offer, 2))
			return 1;
	}
	return 0;
}

static float block_cost(const struct level *level)
{
	return level->finer == NULL ? NEW_BLOCK : NEW_COARSE_BLOCK;
}

/* A patch of which nothing is kept yet costs a block, shared by all places that could use it. */
static float opening_cost(const struct level *level, unsigned projection, struct sheet_ref ref)
{
	const struct patch *patch = patch_of(level, projection, ref);

	return patch->is_alive ? 0 : block_cost(level) + WANTED / (float)(1 + patch->n_wanted);
}

/* The triangle that lacks least. */
static const struct offer *best_triangle(const struct level *level, const struct offers *offers, float *least)
{
	const struct offer *best = NULL;

	for (int i = 0; i < offers->n_triangles; i++) {
		const struct offer *offer = &offers->triangle[i];
		float cost = offer->cost, opening = 0;

		for (int k = 0; k < 3; k++) {
			cost += is_kept(level, offer, k) ? 0 : 0.5f;
			opening = fmaxf(opening, opening_cost(level, offer->projection, offer->ref[k]));
		}
		if (cost + opening < *least) {
			*least = cost + opening;
			best = offer;
		}
	}
	return best;
}

static const struct offer *best_hit(const struct level *level, const struct offers *offers, float *least)
{
	const struct offer *best = NULL;

	for (int i = 0; i < offers->n_hits; i++) {
		const struct offer *offer = &offers->hit[i];
		float cost = offer->cost;

		if (cost < *least)
			cost += opening_cost(level, offer->projection, offer->ref[0]);
		if (cost < *least) {
			*least = cost;
			best = offer;
		}
	}
	return best;
}

/* A place by a face's edge, or on something too thin for any lattice, can be moved to a lattice point: along the face,
 * by what a sample may be off at most. */
static const struct offer_snap *best_snap(const struct level *level, const struct surface_spot *spot,
                                          const struct offers *offers, float *least)
{
	const struct offer_snap *best = NULL;
	int is_sheet = level_is_sheet(level, spot->surface);

	for (int i = 0; i < offers->n_snaps; i++) {
		const struct offer_snap *snap = &offers->snap[i];
		float cost = snap->cost;

		if (cost < *least
		    && sheets_room(&level->sheets[snap->projection], snap->at, snap->z, is_sheet).patch == SHEET_NONE)
			cost += block_cost(level) + WANTED;
		if (cost < *least) {
			*least = cost;
			best = snap;
		}
	}
	return best;
}

static int keep_snapped(struct level *level, const struct surface_spot *spot, const struct offer_snap *snap)
{
	struct level_ref ref = { .projection = snap->projection };
	int rc = sheets_add(&level->sheets[snap->projection], snap->at, snap->z, spot->surface,
	                    level_is_sheet(level, spot->surface), &ref.at);

	if (rc != PSR_OK || ref.at.patch == SHEET_NONE)
		return rc;
	return keep_sample(level, ref);
}

int offer_take(struct level *level, const struct surface_spot *spot, const struct offers *offers, float most,
               int *is_left)
{
	float least = INFINITY;
	const struct offer *triangle = best_triangle(level, offers, &least), *hit = best_hit(level, offers, &least);
	const struct offer_snap *snap = best_snap(level, spot, offers, &least);
	int rc = PSR_OK;

	*is_left = least < INFINITY && least > most;
	if (least > most || least == INFINITY)
		return PSR_OK;
	if (snap != NULL)
		return keep_snapped(level, spot, snap);
	if (hit != NULL)
		return keep_sample(level, (struct level_ref){ hit->projection, hit->ref[0] });
	for (int k = 0; rc == PSR_OK && k < 3; k++)
		rc = keep_sample(level, (struct level_ref){ triangle->projection, triangle->ref[k] });
	return rc;
}

void offer_ask(struct level *level, const struct offers *offers)
{
	const struct patch *last = NULL;

	for (int i = 0; i < offers->n_hits; i++) {
		const struct offer *offer = &offers->hit[i];
		struct patch *patch = &level->sheets[offer->projection].patch[offer->ref[0].patch];

		if (patch != last && patch->n_wanted != UINT16_MAX)
			patch->n_wanted++;
		last = patch;
	}
}
