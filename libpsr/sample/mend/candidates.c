#include <math.h>
#include "base/vec.h"
#include "candidates.h"
#include "psr/error.h"

/* [G] 4.3 wants sides of at most a pixel. A twentieth more is allowed: the middle of such a triangle is 0.6 pixels
 * from its corners, and a pixel reaches 0.5 to 0.71. */
#define LONGEST_SIDE 1.05

/* pixels off its plane: surfaces are rough, but half a pixel off is another surface */
#define OFF_TRIANGLE 0.4

#define MOST_AWAY 0.55 /* pixels from its place to where a sample is moved */

#define LEAST_COSINE 0.3f
#define LEAST_ALIKE 0.6f

/* The least costs of candidates, in samples: a single hit covers less than a triangle; a moved sample is away from its
 * place and often off the surface. Further off than PSR_SAMPLE_OFF it is the last resort: what has no other sample. */
#define HIT 1.5f
#define MOVE 3
#define MOVE_AWAY 12    /* a pixel from its place; as much off the surface */
#define MOVE_TEXTURE 24 /* a pixel from its place, on a texture: it may take its color from beyond an edge */
#define LAST_RESORT 1000

/* A new block costs so much, in samples: what places that want it share is nearly all of it, so that many open one, and
 * few move (decision 0157). A moved sample costs more in a projection that faces the place worse than three others: many
 * of these would show in colors and distances. */
#define NEW_BLOCK 3
#define WANTED 90.0f
#define MOVE_ASIDE 4

struct tries {
	unsigned projection[CANDIDATE_TRIES];
	int n;
};

/* Projections by how well they face a place. */
static void list_tries(const struct keeper *keeper, const struct field *field, const struct place *place,
                       struct tries *tries)
{
	float smooth[3], score[CANDIDATE_TRIES];

	tries->n = 0;
	field_normal(field, place->p, place->n, smooth);
	for (unsigned q = 0; q < N_PROJECTIONS; q++) {
		const float *axis = keeper->sampling->projection[q].axis[2];
		float g = v3f_dot(axis, smooth);
		int i = tries->n;

		if (v3f_dot(axis, place->n) < LEAST_COSINE || (i == CANDIDATE_TRIES && g <= score[CANDIDATE_TRIES - 1]))
			continue;
		i = i < CANDIDATE_TRIES ? tries->n++ : CANDIDATE_TRIES - 1;
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

/* Finds the corners of projection q's lattice triangle around a place; SHEET_NONE where its surface has no hit. */
static void find_corners(const struct keeper *keeper, unsigned q, const struct place *place,
                         struct corner corner[3], float projected[3])
{
	const struct sheets *sheets = &keeper->sheets[q];
	struct lattice_point at[3];
	struct sheet_ref ref[3];
	int is_thin = sampling_is_thin(keeper->sampling, place->surface);

	projection_project(&sheets->projection, place->p, projected);
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
		sampling_normal(keeper->sampling, surface, n);
		if (v3f_dot(n, place->n) < LEAST_ALIKE && !(is_thin && sampling_is_thin(keeper->sampling, surface))) {
			c->ref.patch = SHEET_NONE;
			continue;
		}
		sheets_position(sheets, c->ref, c->position);
		v3f_sub(d, c->position, place->p);
		c->distance2 = v3f_dot(d, d);
		c->is_kept = sheets_is_kept(sheets, c->ref);
	}
}

/* Whether the corners make a small enough triangle with the place on it. */
static int is_triangle(const struct keeper *keeper, const struct place *place, const struct corner corner[3])
{
	const double ds = keeper->sampling->ds;
	const float most = (float)(LONGEST_SIDE * LONGEST_SIDE * ds * ds);
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
	v3f_sub(off, place->p, corner[0].position);
	away = v3f_dot(off, n);
	return away * away <= (float)(OFF_TRIANGLE * OFF_TRIANGLE * ds * ds) * v3f_dot(n, n);
}

/* The corners around a place in each try, and the place in that projection's space. */
struct look {
	struct tries tries;
	int n; /* tries made so far */
	struct corner corner[CANDIDATE_TRIES][3];
	float projected[CANDIDATE_TRIES][3];
};

static void look_next(const struct keeper *keeper, const struct place *place, struct look *look)
{
	find_corners(keeper, look->tries.projection[look->n], place, look->corner[look->n], look->projected[look->n]);
	look->n++;
}

static int is_near_kept(const struct keeper *keeper, const struct place *place)
{
	return kept_covers(keeper->kept, place->p, place->n, KEPT_NEAR * keeper->sampling->ds);
}

/* Whether a place is on a triangle of kept samples. */
static int is_on_kept(const struct keeper *keeper, const struct field *field, const struct place *place,
                      struct look *look)
{
	list_tries(keeper, field, place, &look->tries);
	look->n = 0;
	while (look->n < look->tries.n && look->n < CANDIDATE_TRIANGLES) {
		const struct corner *corner = look->corner[look->n];

		look_next(keeper, place, look);
		if (is_triangle(keeper, place, corner) && corner[0].is_kept && corner[1].is_kept && corner[2].is_kept)
			return 1;
	}
	return 0;
}

int candidates_cover(const struct keeper *keeper, const struct field *field, const struct place *place)
{
	struct look look;

	return is_near_kept(keeper, place) || is_on_kept(keeper, field, place, &look);
}

/* Moved to the corners that try i found, at a cost below `most`. */
static void find_moves(struct candidates *candidates, const struct keeper *keeper, const struct place *place,
                       const struct look *look, int i, float most)
{
	const struct corner *corner = look->corner[i];
	const unsigned q = look->tries.projection[i];
	const struct sheets *sheets = &keeper->sheets[q];
	const float *p = look->projected[i];
	const double ds = keeper->sampling->ds;
	const int is_textured = sampling_material(keeper->sampling, place->surface & ~SURFACE_BACK)->base_texture.image >= 0;
	const float aside = keeper->sampling->level == 0 && i >= CANDIDATE_TRIANGLES ? MOVE_ASIDE : 0;
	float n[3];

	projection_project(&sheets->projection, place->n, n);
	for (int k = 0; k < 3; k++) {
		double x, y, dx, dy, dz, away, off, inner[3];
		float z, cost;

		sheets_point(sheets, corner[k].at.row, corner[k].at.col, &x, &y);
		dx = x - (double)p[0];
		dy = y - (double)p[1];
		dz = -(dx * (double)n[0] + dy * (double)n[1]) / (double)n[2];
		away = sqrt(dx * dx + dy * dy + dz * dz) / ds;
		cost = MOVE + aside + (is_textured ? MOVE_TEXTURE : MOVE_AWAY) * (float)away;
		if (away > MOST_AWAY || cost >= most)
			continue;
		z = p[2] + (float)dz;
		projection_inner(&sheets->projection, x, y, (double)z, inner);
		off = fmin(ray_scene_distance(keeper->sampling->scene, inner, away * ds) / ds, away); /* the place is there */
		if (off > PSR_SAMPLE_FAR_OFF)
			continue;
		cost += MOVE_AWAY * (float)off + (off > PSR_SAMPLE_OFF ? LAST_RESORT : 0);
		candidates->move[candidates->n_moves++] = (struct candidate_move){ q, cost, z, corner[k].at };
	}
}

static const struct patch *patch_of(const struct keeper *keeper, unsigned projection, struct sheet_ref ref)
{
	return &keeper->sheets[projection].patch[ref.patch];
}

static void find(struct candidates *candidates, const struct keeper *keeper, const struct place *place,
                 struct look *look)
{
	float least = INFINITY;

	candidates->n_triangles = candidates->n_hits = candidates->n_moves = 0;
	/* Further candidates cannot cost less than a hit in a block that exists. */
	for (int i = 0; i < look->tries.n && (i < CANDIDATE_TRIANGLES || HIT + (float)i / 2 < least); i++) {
		unsigned q = look->tries.projection[i];
		const struct corner *corner = look->corner[i];

		if (i == look->n)
			look_next(keeper, place, look);
		if (i < CANDIDATE_TRIANGLES && is_triangle(keeper, place, corner))
			candidates->triangle[candidates->n_triangles++] =
				(struct candidate){ q, (float)i / 2, { corner[0].ref, corner[1].ref, corner[2].ref } };
		for (int k = 0; k < 3; k++) {
			float distance, cost;

			if (corner[k].ref.patch == SHEET_NONE)
				continue;
			distance = (float)(sqrt((double)corner[k].distance2) / keeper->sampling->ds);
			cost = HIT + distance / 4 + (float)i / 2;
			if (distance > (float)KEPT_NEAR)
				continue;
			candidates->hit[candidates->n_hits++] = (struct candidate){ q, cost, { corner[k].ref } };
			if (cost < least && patch_of(keeper, q, corner[k].ref)->kept != 0)
				least = cost;
		}
		find_moves(candidates, keeper, place, look, i, least);
	}
}

int candidates_look(struct candidates *candidates, const struct keeper *keeper, const struct field *field,
                    const struct place *place)
{
	struct look look;

	if (is_near_kept(keeper, place) || is_on_kept(keeper, field, place, &look))
		return 1;
	find(candidates, keeper, place, &look);
	return 0;
}

void candidates_find(struct candidates *candidates, const struct keeper *keeper, const struct field *field,
                     const struct place *place)
{
	struct look look = { .n = 0 };

	list_tries(keeper, field, place, &look.tries);
	find(candidates, keeper, place, &look);
}

static int is_kept(const struct keeper *keeper, const struct candidate *candidate, int corner)
{
	return sheets_is_kept(&keeper->sheets[candidate->projection], candidate->ref[corner]);
}

int candidates_are_superfluous(const struct candidates *candidates, const struct keeper *keeper,
                               const struct place *place)
{
	if (is_near_kept(keeper, place))
		return 1;
	for (int i = 0; i < candidates->n_triangles; i++) {
		const struct candidate *triangle = &candidates->triangle[i];

		if (is_kept(keeper, triangle, 0) && is_kept(keeper, triangle, 1) && is_kept(keeper, triangle, 2))
			return 1;
	}
	return 0;
}

/* A patch without kept samples costs a block, shared by all places that want it. */
static float opening_cost(const struct keeper *keeper, unsigned projection, struct sheet_ref ref)
{
	const struct patch *patch = patch_of(keeper, projection, ref);

	return patch->kept != 0 ? 0 : NEW_BLOCK + WANTED / (float)(1 + patch->n_wanted);
}

/* Returns the triangle that lacks the fewest samples. */
static const struct candidate *best_triangle(const struct candidates *candidates, const struct keeper *keeper,
                                             float *least)
{
	const struct candidate *best = NULL;

	for (int i = 0; i < candidates->n_triangles; i++) {
		const struct candidate *triangle = &candidates->triangle[i];
		float cost = triangle->cost, opening = 0;

		for (int k = 0; k < 3; k++) {
			cost += is_kept(keeper, triangle, k) ? 0 : 0.5f;
			opening = fmaxf(opening, opening_cost(keeper, triangle->projection, triangle->ref[k]));
		}
		if (cost + opening < *least) {
			*least = cost + opening;
			best = triangle;
		}
	}
	return best;
}

static const struct candidate *best_hit(const struct candidates *candidates, const struct keeper *keeper, float *least)
{
	const struct candidate *best = NULL;

	for (int i = 0; i < candidates->n_hits; i++) {
		const struct candidate *hit = &candidates->hit[i];
		float cost = hit->cost;

		if (cost < *least)
			cost += opening_cost(keeper, hit->projection, hit->ref[0]);
		if (cost < *least) {
			*least = cost;
			best = hit;
		}
	}
	return best;
}

/* Places at edges, and on things too thin for any lattice, move along the face to a lattice point. */
static const struct candidate_move *best_move(const struct candidates *candidates, const struct keeper *keeper,
                                              const struct place *place, float *least)
{
	const struct candidate_move *best = NULL;
	int is_sheet = sampling_is_sheet(keeper->sampling, place->surface);

	for (int i = 0; i < candidates->n_moves; i++) {
		const struct candidate_move *move = &candidates->move[i];
		float cost = move->cost;

		if (cost < *least
		    && sheets_room(&keeper->sheets[move->projection], move->at, move->z, is_sheet).patch == SHEET_NONE)
			cost += NEW_BLOCK + WANTED;
		if (cost < *least) {
			*least = cost;
			best = move;
		}
	}
	return best;
}

int candidates_take(const struct candidates *candidates, const struct keeper *keeper, const struct place *place,
                    float most, int *is_left)
{
	float least = INFINITY;
	const struct candidate *triangle = best_triangle(candidates, keeper, &least);
	const struct candidate *hit = best_hit(candidates, keeper, &least);
	const struct candidate_move *move = best_move(candidates, keeper, place, &least);
	int rc = PSR_OK;

	*is_left = least < INFINITY && least > most;
	if (least > most || least == INFINITY)
		return PSR_OK;
	if (move != NULL)
		return keep_moved(keeper, move->projection, move->at, move->z, place->surface);
	if (hit != NULL)
		return keep_sample(keeper, (struct sample_ref){ hit->projection, hit->ref[0] });
	for (int k = 0; rc == PSR_OK && k < 3; k++)
		rc = keep_sample(keeper, (struct sample_ref){ triangle->projection, triangle->ref[k] });
	return rc;
}

void candidates_want(const struct candidates *candidates, const struct keeper *keeper)
{
	const struct patch *last = NULL;

	for (int i = 0; i < candidates->n_hits; i++) {
		const struct candidate *hit = &candidates->hit[i];
		const struct patch *patch = patch_of(keeper, hit->projection, hit->ref[0]);

		if (patch != last)
			sheets_want(&keeper->sheets[hit->projection], hit->ref[0].patch);
		last = patch;
	}
}
