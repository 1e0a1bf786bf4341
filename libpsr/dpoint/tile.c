/* Rectangles that cover a triangle, each along one of its sides.
 *
 * A strip along each side, as wide as the radius of the inscribed circle, covers all but the tips. Of a tip of angle a,
 * what is nearer to one of its sides is at a distance r and an angle t <= a / 2 from it, so in a strip of width w along
 * that side, which begins where the other side lets all of it begin, if r sin t <= w <= r cos t tan a. As tan a >=
 * 2 tan (a / 2), strips whose widths go down by less than a half each leave nothing out. The last one may reach over the
 * other side, and begins at the corner itself.
 *
 * Packing turns a rectangle by up to pi / 256 (dpoint.h), which takes AWRY of a strip's width at most, since rectangles
 * are short enough for that. */
#include <math.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "lean.h"

#define NARROWER 3           /* classes of delta from one strip to the next: 2^(-3/4), above 1 / (2 (1 - AWRY)) */
#define AWRY 0.1
#define NARROW 0.35          /* of what may be reached over: half of what is as wide as any strip is */
#define SLACK 2e-5           /* that packing moves a place by: half a step of a box of DPOINT_MOST_BOX */
#define MOST_STRIPS 24

struct side {
	double from[3], along[3], in[3], length, high; /* high: of the triangle, in from it */
	double cot[2];     /* of the angles at its ends; below 0 of those beyond 90 degrees */
	double cosine[2];
	double beyond[2];  /* what may be reached over beside its ends */
	double turn;       /* the sine of the angle that packing turns what is along it by */
	double longest;    /* half of a rectangle along it */
};

struct tiling {
	struct dpoint_surface *surface;
	const struct dpoint_face *face;
	uint64_t attr;
	unsigned least_class; /* of the widest that rectangles may be */
	double normal[3];
};

static int put_point(struct tiling *t, const struct dpoint_candidate *made)
{
	struct dpoint_surface *s = t->surface;
	struct dpoint_candidate *candidate = dpoint_surface_candidate(s);

	if (candidate == NULL || !ARRAY_ROOM(s->lean, s->n_lean, s->lean_room))
		return PSR_ERR_MEMORY;
	*candidate = *made;
	lean_make(&s->lean[s->n_lean++], t->face, candidate);
	return PSR_OK;
}

static int make_rectangle(struct dpoint_candidate *made, const struct tiling *t, const struct side *s, double along,
                          double in, unsigned u, unsigned v)
{
	const struct dpoint_candidate like = { .point.attr = t->attr, .delta = { dpoint_delta_of_class(u),
		                                   dpoint_delta_of_class(v) }, .part = t->face->part,
		                                   .cell = t->face->first_cell };
	struct dpoint_local local = { .at = { s->from[0], s->from[1], s->from[2] } };

	v3d_add_scaled(local.at, local.at, along, s->along);
	v3d_add_scaled(local.at, local.at, in, s->in);
	memcpy(local.axis[0], s->along, sizeof s->along);
	memcpy(local.axis[2], t->normal, sizeof t->normal);
	v3d_cross(local.axis[1], local.axis[2], local.axis[0]);
	return dpoint_candidate_make(made, &local, &like) != DPOINT_BAD;
}

/* The class of the least delta that is at least this one. */
static unsigned class_above(double half)
{
	const unsigned class = dpoint_delta_class((float)half);

	return class > 0 && (double)dpoint_delta_of_class(class) < half ? class - 1 : class;
}

/* A strip along a side: half its width is the delta of a class. */
struct strip {
	double half, turned, reach; /* how far packing turns an end of the longest rectangle aside; half of that */
	double in;                  /* its middle, from the side */
	unsigned class;
};

/* need: half of what has to be covered, or 0: all but AWRY. */
static struct strip strip_of(const struct side *s, unsigned class, double need)
{
	const double half = (double)dpoint_delta_of_class(class);
	const double most = need > 0 ? fmax(AWRY * half, half - need) : AWRY * half;
	const double reach = fmin(s->longest, s->turn > 0 ? most / s->turn : 1);

	return (struct strip){ half, reach * s->turn, reach, half - reach * s->turn, class };
}

static int put_rectangle(struct tiling *t, const struct side *s, const struct strip *strip, double along,
                         unsigned class)
{
	struct dpoint_candidate made;

	if (!make_rectangle(&made, t, s, along, strip->in, class, strip->class))
		return PSR_OK;
	return put_point(t, &made);
}

/* As few rectangles as reach from one place of a side to another, and not beyond `end`, if one may do. */
static int put_strip(struct tiling *t, const struct side *s, const struct strip *strip, double from, double to,
                     double end)
{
	const double half = 0.5 * fabs(to - from);
	const unsigned least = dpoint_delta_class((float)strip->reach), above = class_above(half);
	const double one = (double)dpoint_delta_of_class(above);
	unsigned class = dpoint_delta_class((float)half);
	int rc = PSR_OK;

	if (above >= least && fabs(end - from) >= 2 * one)
		return put_rectangle(t, s, strip, end > from ? from + one : from - one, above);
	class = class > least ? class : least;
	const double reach = (double)dpoint_delta_of_class(class);
	const uint32_t n = half > reach ? (uint32_t)ceil(half / fmax(reach - SLACK, 0.5 * reach)) : 1;
	const double begin = fmin(from, to) + reach, step = n > 1 ? 2 * (half - reach) / (n - 1) : 0;

	for (uint32_t i = 0; i < n && rc == PSR_OK; i++)
		rc = put_rectangle(t, s, strip, n == 1 ? 0.5 * (from + to) : begin + i * step, class);
	return rc;
}

/* Where a strip begins beside an end of a side: where the other side lets all of it begin; *is_last: it reaches over
 * that, or there is nothing to reach over. */
static double begin_of(int *is_last, const struct side *s, const struct strip *strip, int end)
{
	*is_last = s->cot[end] <= 0 || 2 * strip->half * s->cosine[end] <= s->beyond[end];
	return *is_last ? -s->turn * strip->half : 2 * strip->half * s->cot[end];
}

/* Strips beside one end of a side, narrower than the widest: each from where it begins to where a wider one does. */
static int put_tip(struct tiling *t, const struct side *s, int end, unsigned class)
{
	struct strip strip = strip_of(s, class, 0);
	int rc = PSR_OK, is_last, ignored;
	double before = begin_of(&is_last, s, &strip, end);

	for (int i = 0; !is_last && i < MOST_STRIPS && rc == PSR_OK; i++) {
		double at, most;

		before += s->turn * strip.half; /* ends are turned, too */
		class += NARROWER;
		if (class >= DPOINT_DELTA_CLASSES)
			break;
		strip = strip_of(s, class, 0);
		at = begin_of(&is_last, s, &strip, end);
		most = s->length - begin_of(&ignored, s, &strip, 1 - end);
		rc = end == 0 ? put_strip(t, s, &strip, at, before, most)
		              : put_strip(t, s, &strip, s->length - at, s->length - before, s->length - most);
		before = at;
	}
	return rc;
}

/* What is turned lies over a side with one end, by twice what is aside in the middle. */
static void find_turn(struct side *s, const struct tiling *t, double beyond)
{
	struct dpoint_candidate made;
	double u[3];

	s->turn = 0;
	s->longest = (double)dpoint_delta_of_class(t->least_class);
	if (!make_rectangle(&made, t, s, 0, 0, t->least_class, t->least_class))
		return;
	for (int k = 0; k < 3; k++)
		u[k] = made.point.u[k];
	s->turn = fabs(v3d_dot(u, s->in));
	if (2 * s->turn * s->longest > beyond)
		s->longest = beyond / (2 * s->turn);
}

/* corner: the triangle's; i: the side's first. */
static int side_of(struct side *s, const struct tiling *t, const double corner[3][3], int i, const float beyond[3])
{
	double to[3], other[3], back[3];

	memcpy(s->from, corner[i], sizeof s->from);
	v3d_sub(to, corner[(i + 1) % 3], corner[i]);
	v3d_sub(other, corner[(i + 2) % 3], corner[i]);
	v3d_sub(back, corner[(i + 2) % 3], corner[(i + 1) % 3]);
	s->length = v3d_length(to);
	if (v3d_normalize(s->along, to) == 0)
		return 0;
	v3d_add_scaled(s->in, other, -v3d_dot(other, s->along), s->along);
	s->high = v3d_length(s->in);
	if (v3d_normalize(s->in, s->in) == 0)
		return 0;
	s->cot[0] = v3d_dot(other, s->along) / s->high;
	s->cot[1] = -v3d_dot(back, s->along) / s->high;
	for (int end = 0; end < 2; end++) {
		s->cosine[end] = s->cot[end] / sqrt(1 + s->cot[end] * s->cot[end]);
		s->beyond[end] = (double)beyond[end == 0 ? (i + 2) % 3 : (i + 1) % 3];
	}
	find_turn(s, t, (double)beyond[i]);
	return 1;
}

static int tile_triangle(struct tiling *t, const double corner[3][3], const float beyond[3])
{
	struct side side[3];
	const float least = fminf(beyond[0], fminf(beyond[1], beyond[2]));
	double area[3], a[3], b[3], radius;
	unsigned widest;
	int rc = PSR_OK;

	for (int i = 0; i < 3; i++)
		if (!side_of(&side[i], t, corner, i, beyond))
			return PSR_OK;
	v3d_sub(a, corner[1], corner[0]);
	v3d_sub(b, corner[2], corner[0]);
	v3d_cross(area, a, b);
	radius = v3d_length(area) / (side[0].length + side[1].length + side[2].length);
	/* What is narrower than it may reach over takes no shorter rectangles for that. */
	widest = class_above(fmax(0.5 * radius / (1 - AWRY), NARROW * (double)least));
	if (widest < t->least_class) {
		double half[3][3]; /* quarters */

		for (int i = 0; i < 3; i++)
			for (int k = 0; k < 3; k++)
				half[i][k] = 0.5 * (corner[i][k] + corner[(i + 1) % 3][k]);
		for (int i = 0; i < 3 && rc == PSR_OK; i++) {
			double part[3][3];

			memcpy(part[0], corner[i], sizeof part[0]);
			memcpy(part[1], half[i], sizeof part[1]);
			memcpy(part[2], half[(i + 2) % 3], sizeof part[2]);
			rc = tile_triangle(t, (const double (*)[3])part, (const float[3]){ beyond[i], least, beyond[(i + 2) % 3] });
		}
		return rc == PSR_OK ? tile_triangle(t, (const double (*)[3])half, (const float[3]){ least, least, least }) : rc;
	}
	for (int i = 0; i < 3 && rc == PSR_OK; i++) {
		const struct strip strip = strip_of(&side[i], widest, 0.5 * radius);
		int ignored;
		const double begin = begin_of(&ignored, &side[i], &strip, 0);
		const double end = side[i].length - begin_of(&ignored, &side[i], &strip, 1);

		rc = put_tip(t, &side[i], 0, widest);
		if (rc == PSR_OK)
			rc = put_tip(t, &side[i], 1, widest);
		if (rc == PSR_OK)
			rc = put_strip(t, &side[i], &strip, begin, end, end);
	}
	return rc;
}

static int tiling_init(struct tiling *t, struct dpoint_surface *surface, const struct dpoint_face *face,
                       double corner[3][3])
{
	double a[3], b[3], sum = 0;

	*t = (struct tiling){ .surface = surface, .face = face };
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			corner[i][k] = face->corner[i][k];
	v3d_sub(a, corner[1], corner[0]);
	v3d_sub(b, corner[2], corner[0]);
	v3d_cross(t->normal, a, b);
	if (v3d_normalize(t->normal, t->normal) == 0)
		return 0;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			sum += (double)face->normal[i][k] * t->normal[k];
	if (sum < 0)
		v3d_scale(t->normal, t->normal, -1);
	return 1;
}

int tile_face(struct dpoint_surface *surface, const struct dpoint_face *face, const float beyond[3], uint64_t attr,
              float delta)
{
	struct tiling t;
	double corner[3][3];

	if (!tiling_init(&t, surface, face, corner))
		return PSR_OK;
	t.attr = attr;
	t.least_class = dpoint_delta_class(delta);
	return tile_triangle(&t, (const double (*)[3])corner, beyond);
}

/* One rectangle that reaches over the ends a little, or as many as do not. */
static int put_row(struct tiling *t, const struct side *s, const struct strip *strip, double beyond)
{
	const double turned = s->turn * strip->half, half = 0.5 * s->length + turned;
	const unsigned above = class_above(half);
	const double reach = (double)dpoint_delta_of_class(above);

	if (reach <= strip->reach && reach + turned - 0.5 * s->length <= beyond)
		return put_rectangle(t, s, strip, 0.5 * s->length, above);
	return put_strip(t, s, strip, -turned, s->length + turned, s->length + turned);
}

int tile_rectangle(struct dpoint_surface *surface, const struct dpoint_face *face, float beyond, uint64_t attr,
                   float delta)
{
	const float all[3] = { beyond, beyond, beyond };
	double corner[3][3], half;
	struct tiling t;
	struct strip strip;
	struct side side;
	unsigned class, widest;
	int rc = PSR_OK;

	if (!tiling_init(&t, surface, face, corner))
		return PSR_OK;
	t.attr = attr;
	t.least_class = dpoint_delta_class(delta);
	if (!side_of(&side, &t, (const double (*)[3])corner, (face->shared + 2) % 3, all))
		return PSR_OK;
	half = 0.5 * side.high;
	widest = dpoint_delta_class((float)side.longest);
	strip = strip_of(&side, class_above(half), 0);
	strip.in = half;
	if (strip.class >= widest && strip.half - half <= (double)beyond && strip.half - strip.turned >= half)
		return put_row(&t, &side, &strip, (double)beyond);
	/* Rows, each over a part of the next one. */
	class = dpoint_delta_class((float)half);
	strip = strip_of(&side, class > widest ? class : widest, 0);
	const double first = strip.half - strip.turned;
	const uint32_t n = half > first ? (uint32_t)ceil(half / fmax(first - SLACK, 0.5 * first)) : 1;

	for (uint32_t i = 0; i < n && rc == PSR_OK; i++) {
		strip.in = n == 1 ? half : first + 2 * (half - first) * i / (n - 1);
		rc = put_row(&t, &side, &strip, (double)beyond);
	}
	return rc;
}

int tile_cell(struct dpoint_surface *surface, const struct dpoint_face *face, uint32_t cell,
              const struct dpoint_cover_options *options)
{
	struct dpoint_candidate made;
	struct tiling t;
	double corner[3][3];

	if (!tiling_init(&t, surface, face, corner) || !plane_over(&made, surface, cell, options))
		return PSR_OK;
	return put_point(&t, &made);
}
