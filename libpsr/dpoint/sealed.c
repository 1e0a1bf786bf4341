/* Rays to a cell, and lids in their way. */
#include "sealed.h"

#include <math.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "group.h"

#define PLACES 9  /* of a cell: corners, middles of sides, the middle */
#define INWARDS 0.9f
#define GRAZED 2.5f /* of `behind`, for grazing rays: they get as much further before they are as deep */

#define STEEP (1 + 2 * AROUND) /* rays to any cell; more graze cells of two sides */
#define DIRECTIONS (STEEP + AROUND_GRAZING)

#define ALONG_SADDLE 4 /* rays along both lines in which a saddle does not bend, either way */
#define LEAST_SADDLE 0.01f /* -rho */

/* Cosines of rays to the cell's normal. More rays, 86 degrees off and from between those directions as well, are to
 * cells of two sides alone: who looks into what is hollow and open sees its walls aslant as far as they go. */
static const float slant[2] = { 0.65f, LID_LEAST_COSINE };

void nearby_gather(struct nearby *nearby, const struct sealing *s, size_t i, const float middle[3], float radius)
{
	const struct cell_ball *ball = &s->tree.ball[i];
	const struct cell_node *node = &s->tree.node[i];
	float away[3];

	v3f_sub(away, ball->middle, middle);
	if (v3f_dot(away, away) > (ball->radius + radius) * (ball->radius + radius))
		return;
	if (!cell_node_is_leaf(node)) {
		nearby_gather(nearby, s, 2 * i + 1, middle, radius);
		nearby_gather(nearby, s, 2 * i + 2, middle, radius);
		return;
	}
	if (!ARRAY_ROOM(nearby->near, nearby->n, nearby->room)) {
		nearby->is_failed = 1;
		return;
	}
	nearby->near[nearby->n++].lid = &s->lid[s->tree.order[node->begin]];
}

int rays_stop(uint8_t *open, int n_open, const struct lid *lid, const float at[3], const float p[3],
              const float (*from)[3], float behind)
{
	float away[3];
	int n = 0;

	v3f_sub(away, at, lid->rectangle.at);
	for (int i = 0; i < n_open; i++) {
		const int d = open[i];
		const float after = d < STEEP ? behind : GRAZED * behind;

		open[n] = (uint8_t)d;
		n += !lid_may_stop(lid, away, from[d], after) || !lid_stops(lid, p, from[d], after);
	}
	return n;
}

int rays_stop_by(uint8_t *open, int n_open, const struct nearby *nearby, const float at[3], const float (*from)[3],
                 float behind)
{
	for (size_t i = 0; i < nearby->n && n_open > 0; i++) {
		const struct lid *lid = nearby->near[i].lid;
		float seen[3];

		rectangle_sees(seen, &lid->rectangle, at);
		n_open = rays_stop(open, n_open, lid, at, seen, from, behind);
	}
	return n_open;
}

int rays_open(uint8_t *open, int n)
{
	for (int d = 0; d < n; d++)
		open[d] = (uint8_t)d;
	return n;
}

/* Some of the lids nearby. */
struct lids {
	struct near_lid *near;
	size_t n;
};

static struct lids lids_of(const struct nearby *nearby, size_t begin, size_t end)
{
	return (struct lids){ begin > 0 ? nearby->near + begin : nearby->near, end - begin };
}

/* Returns whether the place is within the lid's sides. */
static int see(struct near_lid *near, const float at[3])
{
	const float *extent = near->lid->rectangle.extent;

	rectangle_sees(near->place, &near->lid->rectangle, at);
	near->is_over = fabsf(near->place[0]) <= extent[0] && fabsf(near->place[1]) <= extent[1];
	return near->is_over;
}

/* Lids over the place come first: they stop most rays. */
static int is_sealed_at(const struct sealing *s, struct lids lids, const float at[3],
                        const float (*from)[3], const float normal[3], int n)
{
	uint8_t open[DIRECTIONS];
	int n_open = rays_open(open, n);

	for (size_t i = 0; i < lids.n; i++)
		if (lids.near[i].is_over && lid_stops_all(lids.near[i].lid, lids.near[i].place, normal,
		                                           n > STEEP ? GRAZING : LID_LEAST_COSINE, s->behind))
			return 1;
	for (int is_over = 1; is_over >= 0; is_over--)
		for (size_t i = 0; i < lids.n && n_open > 0; i++) {
			const struct near_lid *near = &lids.near[i];

			if (near->is_over == is_over)
				n_open = rays_stop(open, n_open, near->lid, at, near->place, from, s->behind);
		}
	return n_open == 0;
}

/* A ray at an angle to a plane, as its cosine to the plane's normal; turn: around that. */
static void ray_of(float from[3], const float axis[3][3], float cosine, const float turn[2])
{
	const float sine = sqrtf(1 - cosine * cosine);

	v3f_scale(from, axis[2], cosine);
	v3f_add_scaled(from, from, sine * turn[0], axis[0]);
	v3f_add_scaled(from, from, sine * turn[1], axis[1]);
}

void rays_graze(float (*from)[3], const struct sealing *s, const float axis[3][3])
{
	for (int d = 0; d < AROUND_GRAZING; d++)
		ray_of(from[d], axis, GRAZING, s->around[d]);
}

int rays_axis(float axis[3][3], const struct dpoint_cell *cell)
{
	cell_plane(axis[2], cell);
	if (axis[2][0] == 0 && axis[2][1] == 0 && axis[2][2] == 0)
		return 0;
	dpoint_tangents(axis[0], axis[1], axis[2]);
	return 1;
}

/* Where rays to a cell come from: its plane's normal, and around it. Returns 0 of a cell without an area. */
static int directions(float (*from)[3], const struct sealing *s, const struct dpoint_cell *cell)
{
	float axis[3][3];

	if (!rays_axis(axis, cell))
		return 0;
	memcpy(from[0], axis[2], sizeof from[0]);
	for (int d = 1; d < STEEP; d++)
		ray_of(from[d], (const float (*)[3])axis, slant[(d - 1) / AROUND], s->around[2 * ((d - 1) % AROUND) + 1]);
	rays_graze(from + STEEP, s, (const float (*)[3])axis);
	return 1;
}

/* Brings lids over the place to the front: there they are asked first. */
static void put_first(struct lids lids, const float at[3])
{
	size_t n = 0;

	for (size_t i = 0; i < lids.n; i++) {
		struct near_lid near = lids.near[i];

		if (see(&near, at)) {
			lids.near[i] = lids.near[n];
			lids.near[n++] = near;
		}
	}
}

static void place_of(float place[3], const struct dpoint_cell *cell, const float middle[3], int p)
{
	const float *corner = cell->corner[p % 4], *next = cell->corner[(p + (p >= 4)) % 4];

	for (int k = 0; k < 3; k++)
		place[k] = p == 8 ? middle[k] : middle[k] + INWARDS * (0.5f * (corner[k] + next[k]) - middle[k]);
}

/* Whether the lid alone stops all rays to a cell of one side: most cells have such a one among those that cover
 * them. */
static int stops_all(const struct sealing *s, const struct lid *lid, const struct dpoint_cell *cell,
                     const float middle[3], const float normal[3])
{
	if (dpoint_is_two_sided(s->options, cell->part))
		return 0;
	for (int p = PLACES; p-- > 0;) {
		float place[3], seen[3];

		place_of(place, cell, middle, p);
		rectangle_sees(seen, &lid->rectangle, place);
		if (!lid_stops_all(lid, seen, normal, LID_LEAST_COSINE, s->behind))
			return 0;
	}
	return 1;
}

/* Whether these lids stop all rays to a place of the cell, from both sides if it has two. */
static int stops_rays(const struct sealing *s, struct lids lids, const struct dpoint_cell *cell,
                      const float (*from)[DIRECTIONS][3], const float place[3])
{
	const int n_sides = 1 + dpoint_is_two_sided(s->options, cell->part);

	for (size_t i = 0; i < lids.n; i++)
		see(&lids.near[i], place);
	for (int side = 0; side < n_sides; side++)
		if (!is_sealed_at(s, lids, place, from[side], from[side][0], n_sides == 1 ? STEEP : DIRECTIONS))
			return 0;
	return 1;
}

/* The lines in which a lid's saddle does not bend, as rays that graze a cell. */
static void directions_along(float (*from)[3], const struct rectangle *r, const float normal[3])
{
	const float u = sqrtf(-r->rho);

	for (int d = 0; d < ALONG_SADDLE; d++) {
		const float away[3] = { d & 1 ? u : -u, d & 2 ? 1 : -1, 0 };
		float along[3];

		m3f_apply_transposed(along, (const float (*)[3])r->axis, away);
		v3f_add_scaled(along, along, -v3f_dot(along, normal), normal);
		v3f_normalize(along, along);
		v3f_scale(from[d], normal, GRAZING);
		v3f_add_scaled(from[d], from[d], sqrtf(1 - GRAZING * GRAZING), along);
	}
}

/* A saddle over a place, and as high as the surface there; NULL: none. */
static const struct rectangle *find_saddle(const struct sealing *s, const struct nearby *nearby, const float at[3])
{
	for (size_t i = 0; i < nearby->n; i++) {
		const struct rectangle *r = &nearby->near[i].lid->rectangle;
		float p[3];

		if (r->rho > -LEAST_SADDLE)
			continue;
		rectangle_sees(p, r, at);
		if (fabsf(p[0]) <= r->extent[0] && fabsf(p[1]) <= r->extent[1] &&
		    fabsf(p[2] - dpoint_quadric_at(r->lambda_u, r->rho, p[0], p[1])) <= s->options->height)
			return r;
	}
	return NULL;
}

static int stops_along(const struct sealing *s, const struct nearby *nearby, const struct dpoint_cell *cell,
                       const float (*from)[3], const float middle[3])
{
	for (int p = 0; p < PLACES; p++) {
		uint8_t open[ALONG_SADDLE];
		float place[3];

		place_of(place, cell, middle, p);
		if (rays_stop_by(open, rays_open(open, ALONG_SADDLE), nearby, place, from, GRAZED * s->behind) > 0)
			return 0;
	}
	return 1;
}

/* A saddle's surface goes on straight along two lines: who looks along one sees it graze for long, and an outline may
 * end there, with the surface behind it. So such rays to cells of one side are looked at as well. Curvatures of meshes
 * are too rough for that. */
static int is_sealed_along(const struct sealing *s, struct nearby *nearby, const struct dpoint_cell *cell,
                           const float middle[3], const float normal[3], float radius)
{
	float from[ALONG_SADDLE][3];

	if (s->surface->facets.n > 0 || dpoint_is_two_sided(s->options, cell->part))
		return 1;
	nearby->n = 0;
	nearby_gather(nearby, s, 0, middle, radius);
	const struct rectangle *saddle = find_saddle(s, nearby, middle);
	if (saddle == NULL)
		return 1;
	directions_along(from, saddle, normal);
	if (stops_along(s, nearby, cell, (const float (*)[3])from, middle))
		return 1;
	nearby->n = 0;
	nearby_gather(nearby, s, 0, middle, radius + 2 * GRAZED * s->behind);
	return stops_along(s, nearby, cell, (const float (*)[3])from, middle);
}

/* Lids over the cell stop most: all that are near enough are asked only where these do not. */
int is_sealed(const struct sealing *s, struct nearby *nearby, uint32_t at)
{
	const struct dpoint_cell *cell = &s->surface->cell[at];
	float from[2][DIRECTIONS][3], middle[3], radius = 0, away[3];

	if (cell->part == DPOINT_BEYOND || !directions(from[0], s, cell))
		return 1;
	for (int d = 0; d < DIRECTIONS; d++)
		v3f_scale(from[1][d], from[0][d], -1);
	dpoint_cell_middle(middle, cell);
	for (int c = 0; c < 4; c++) {
		v3f_sub(away, cell->corner[c], middle);
		radius = fmaxf(radius, v3f_length(away));
	}
	if (!is_sealed_along(s, nearby, cell, middle, from[0][0], radius))
		return 0;
	if (s->over != NULL && s->over[at] != UINT32_MAX && stops_all(s, &s->lid[s->over[at]], cell, middle, from[0][0]))
		return 1;
	nearby->n = 0;
	nearby_gather(nearby, s, 0, middle, radius);
	const size_t n_over = nearby->n;
	put_first(lids_of(nearby, 0, n_over), middle);
	for (int p = 0; p < PLACES; p++) {
		float place[3];

		place_of(place, cell, middle, p);
		if (stops_rays(s, lids_of(nearby, 0, n_over), cell, (const float (*)[DIRECTIONS][3])from, place))
			continue;
		if (nearby->n == n_over) {
			nearby_gather(nearby, s, 0, middle, radius + 2 * s->behind);
			put_first(lids_of(nearby, n_over, nearby->n), middle);
		}
		if (!stops_rays(s, lids_of(nearby, n_over, nearby->n), cell, (const float (*)[DIRECTIONS][3])from, place))
			return 0;
	}
	return 1;
}
