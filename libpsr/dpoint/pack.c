/* Points to words of 16 bytes, and back. */
#include "dpoint.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include "base/direction.h"
#include "base/vec.h"

#define NORMAL_MASK ((uint64_t)PSR_DIRECTIONS - 1)

/* 2^(k/12) */
static const double twelfth[12] = {
	1.0, 1.0594630943592952646, 1.1224620483093729814, 1.1892071150027210667, 1.2599210498948731648,
	1.3348398541700343648, 1.4142135623730950488, 1.4983070768766814988, 1.5874010519681994748,
	1.6817928305074290861, 1.7817974362806786095, 1.8877486253633869933,
};

static struct dpoint_tables tables;
static double between[DPOINT_ANGLES][2];   /* of each angle and a half */
static pthread_once_t tables_once = PTHREAD_ONCE_INIT;

static void make_tables(void)
{
	const double step = PSR_DEGREE * 180 / DPOINT_ANGLES;

	for (int code = 1; code < 128; code++)
		tables.lambda[code] = (float)ldexp(DPOINT_LEAST_LAMBDA * twelfth[2 * ((code - 1) % DPOINT_LAMBDA_STEPS)],
		                                   (code - 1) / DPOINT_LAMBDA_STEPS);
	for (int code = 0; code < 128; code++)
		tables.lambda[128 + code] = -tables.lambda[code];
	for (int k = 0; k < DPOINT_ANGLES; k++) {
		double s, c;

		psr_sincos(k * step, &s, &c);
		tables.turn[k][0] = (float)c;
		tables.turn[k][1] = (float)s;
		psr_sincos((k + 0.5) * step, &between[k][1], &between[k][0]);
	}
}

void dpoint_box_make(struct dpoint_box *box, const float low[3], const float high[3])
{
	for (int k = 0; k < 3; k++) {
		float step = (high[k] - low[k]) / DPOINT_PLACE_STEPS;

		assert(low[k] <= high[k]);
		while (low[k] + DPOINT_PLACE_STEPS * step < high[k])
			step = nextafterf(step, INFINITY);
		box->low[k] = low[k];
		box->step[k] = step;
	}
}

const struct dpoint_tables *dpoint_tables(void)
{
	pthread_once(&tables_once, make_tables);
	return &tables;
}

static uint64_t pack_place(const float at[3], const struct dpoint_box *box)
{
	uint64_t place = 0;

	for (int k = 0; k < 3; k++) {
		const double steps = box->step[k] > 0 ? ((double)at[k] - box->low[k]) / box->step[k] : 0;

		place |= (uint64_t)floor(fmin(fmax(steps, 0), DPOINT_PLACE_STEPS) + 0.5) << k * DPOINT_PLACE_BITS;
	}
	return place;
}

/* The number of angle-and-a-half directions that are not beyond the direction, by halving; the last one is angle 0
 * again. */
static uint64_t pack_angle(const float u[3], const float normal[3])
{
	float x[3], y[3];
	double c, s;
	int low = 0, high = DPOINT_ANGLES;

	dpoint_tangents(x, y, normal);
	c = (double)u[0] * x[0] + (double)u[1] * x[1] + (double)u[2] * x[2];
	s = (double)u[0] * y[0] + (double)u[1] * y[1] + (double)u[2] * y[2];
	if (s < 0) {
		c = -c;
		s = -s;
	}
	while (low < high) {
		const int middle = (low + high) / 2;

		if (between[middle][0] * s - between[middle][1] * c >= 0)
			low = middle + 1;
		else
			high = middle;
	}
	return (uint64_t)low % DPOINT_ANGLES;
}

/* Half steps from DPOINT_LEAST_LAMBDA on, rounded to whole ones: the nearest by ratio. */
static uint64_t pack_lambda(float lambda)
{
	const double size = fabs((double)lambda);
	const uint64_t sign = lambda < 0 ? 128 : 0;
	double part;
	int octave, k = 11, code;

	if (!(size >= 0.5 * DPOINT_LEAST_LAMBDA))
		return 0;
	part = 2 * frexp(fmin(size, DPOINT_MOST_LAMBDA) / DPOINT_LEAST_LAMBDA, &octave);
	while (twelfth[k] > part)
		k--;
	code = (2 * DPOINT_LAMBDA_STEPS * (octave - 1) + k + 1 + 2) >> 1;
	return sign | (uint64_t)(code < 1 ? 1 : code);
}

/* Steps from the centre of a triangle of normals to a normal. Returns how far the normal is from them, squared, in the
 * plane that touches the centre. */
static float pack_fine(uint64_t *place, const float normal[3], uint32_t index)
{
	const float *center = psr_direction_table()[index];
	const float along = v3f_dot(normal, center);
	float axis[2][3], fine[2], off = 0;

	dpoint_tangents(axis[0], axis[1], center);
	*place = 0;
	if (!(along > 0.5f))
		return INFINITY;
	for (int k = 0; k < 2; k++) {
		const float steps = v3f_dot(normal, axis[k]) / along / DPOINT_FINE_STEP + DPOINT_FINE_MIDDLE + 0.5f;

		*place |= (uint64_t)fminf(fmaxf(steps, 0), 7) << (DPOINT_FINE_AT + k * DPOINT_FINE_BITS);
	}
	dpoint_fine_of(fine, *place);
	for (int k = 0; k < 2; k++) {
		const float away = v3f_dot(normal, axis[k]) / along - fine[k];

		off += away * away;
	}
	return off;
}

/* The triangle that the attributes name, if a step of it is this very normal, else the normal's own. */
static uint32_t pack_normal(uint64_t *place, const struct dpoint *point)
{
	uint32_t index = (uint32_t)(point->attr & NORMAL_MASK);

	if (pack_fine(place, point->normal, index) > 1e-11f) {
		index = psr_direction_encode(point->normal);
		pack_fine(place, point->normal, index);
	}
	return index;
}

void dpoint_pack(struct dpoint_word *word, const struct dpoint *point, const struct dpoint_box *box)
{
	uint64_t rho, steps;
	float fine[2], normal[3];
	uint32_t index;

	pthread_once(&tables_once, make_tables);
	index = pack_normal(&steps, point);
	dpoint_fine_of(fine, steps);
	dpoint_fine_normal(normal, psr_direction_table()[index], fine);
	rho = (uint64_t)floor(fmin(fmax((double)point->rho, -1), 1) * DPOINT_RHO_STEPS + DPOINT_RHO_STEPS + 0.5);
	word->place = pack_place(point->at, box) | steps | pack_angle(point->u, normal) << DPOINT_ANGLE_AT |
	              pack_lambda(point->lambda_u) << DPOINT_LAMBDA_AT | rho << DPOINT_RHO_AT;
	word->attr = (point->attr & ~NORMAL_MASK) | index;
	/* A plane has one word. */
	if ((word->place >> DPOINT_LAMBDA_AT & 255) == 0)
		word->place = (word->place & ~((uint64_t)127 << DPOINT_RHO_AT)) | (uint64_t)DPOINT_RHO_STEPS << DPOINT_RHO_AT;
}

void dpoint_unpack(struct dpoint *point, const struct dpoint_word *word, const struct dpoint_box *box)
{
	const unsigned angle = word->place >> DPOINT_ANGLE_AT & 127, lambda = word->place >> DPOINT_LAMBDA_AT & 255;
	const int rho = (int)(word->place >> DPOINT_RHO_AT & 127) - DPOINT_RHO_STEPS;
	float x[3], y[3], fine[2], normal[3];

	pthread_once(&tables_once, make_tables);
	dpoint_fine_of(fine, word->place);
	dpoint_fine_normal(normal, psr_direction_table()[word->attr & NORMAL_MASK], fine);
	dpoint_tangents(x, y, normal);
	for (int k = 0; k < 3; k++) {
		point->at[k] = box->low[k] + (float)(word->place >> k * DPOINT_PLACE_BITS & DPOINT_PLACE_STEPS) * box->step[k];
		point->normal[k] = normal[k];
		point->u[k] = tables.turn[angle][0] * x[k] + tables.turn[angle][1] * y[k];
	}
	point->lambda_u = tables.lambda[lambda];
	point->rho = rho > DPOINT_RHO_STEPS ? 1.0f : (float)rho / DPOINT_RHO_STEPS;
	point->attr = word->attr;
}

int dpoint_word_is_valid(const struct dpoint_word *word)
{
	const unsigned lambda = word->place >> DPOINT_LAMBDA_AT & 255, rho = word->place >> DPOINT_RHO_AT & 127;

	return rho <= 2 * DPOINT_RHO_STEPS && lambda != 128 && (lambda != 0 || rho == DPOINT_RHO_STEPS);
}
