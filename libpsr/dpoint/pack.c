/* Points to words of 16 bytes, and back. */
#include "dpoint.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include "base/direction.h"
#include "base/vec.h"

#define NORMAL_MASK ((uint64_t)PSR_DIRECTIONS - 1)

enum { PLACE_BITS = 14, ANGLE_AT = 42, LAMBDA_AT = 49, RHO_AT = 57 };

/* 2^(k/12) */
static const double twelfth[12] = {
	1.0, 1.0594630943592952646, 1.1224620483093729814, 1.1892071150027210667, 1.2599210498948731648,
	1.3348398541700343648, 1.4142135623730950488, 1.4983070768766814988, 1.5874010519681994748,
	1.6817928305074290861, 1.7817974362806786095, 1.8877486253633869933,
};

static float lambda_of_code[128];
static float turn[DPOINT_ANGLES][2];       /* cosine and sine of each angle */
static double between[DPOINT_ANGLES][2];   /* of each angle and a half */
static pthread_once_t tables_once = PTHREAD_ONCE_INIT;

static void make_tables(void)
{
	const double step = PSR_DEGREE * 180 / DPOINT_ANGLES;

	for (int code = 1; code < 128; code++)
		lambda_of_code[code] = (float)ldexp(DPOINT_LEAST_LAMBDA * twelfth[2 * ((code - 1) % DPOINT_LAMBDA_STEPS)],
		                                    (code - 1) / DPOINT_LAMBDA_STEPS);
	for (int k = 0; k < DPOINT_ANGLES; k++) {
		double s, c;

		psr_sincos(k * step, &s, &c);
		turn[k][0] = (float)c;
		turn[k][1] = (float)s;
		psr_sincos((k + 0.5) * step, &between[k][1], &between[k][0]);
	}
}

/* A basis of the tangent plane that is continuous but where z changes its sign (Duff et al., "Building an Orthonormal
 * Basis, Revisited", 2017): one division, and the same for packing and unpacking. */
static void tangents(float x[3], float y[3], const float n[3])
{
	const float sign = n[2] < 0 ? -1.0f : 1.0f;
	const float a = -1.0f / (sign + n[2]), b = n[0] * n[1] * a;

	v3f_set(x, 1.0f + sign * n[0] * n[0] * a, sign * b, -sign * n[0]);
	v3f_set(y, b, sign + n[1] * n[1] * a, -n[1]);
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

static uint64_t pack_place(const float at[3], const struct dpoint_box *box)
{
	uint64_t place = 0;

	for (int k = 0; k < 3; k++) {
		const double steps = box->step[k] > 0 ? ((double)at[k] - box->low[k]) / box->step[k] : 0;

		place |= (uint64_t)floor(fmin(fmax(steps, 0), DPOINT_PLACE_STEPS) + 0.5) << k * PLACE_BITS;
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

	tangents(x, y, normal);
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

void dpoint_pack(struct dpoint_word *word, const struct dpoint *point, const struct dpoint_box *box)
{
	const uint16_t index = psr_direction_encode(point->normal);
	uint64_t rho;

	pthread_once(&tables_once, make_tables);
	rho = (uint64_t)floor(fmin(fmax((double)point->rho, -1), 1) * DPOINT_RHO_STEPS + DPOINT_RHO_STEPS + 0.5);
	word->place = pack_place(point->at, box) | pack_angle(point->u, psr_direction_table()[index]) << ANGLE_AT |
	              pack_lambda(point->lambda_u) << LAMBDA_AT | rho << RHO_AT;
	word->attr = (point->attr & ~NORMAL_MASK) | index;
	/* A plane has one word. */
	if ((word->place >> LAMBDA_AT & 255) == 0)
		word->place = (word->place & ~((uint64_t)127 << RHO_AT)) | (uint64_t)DPOINT_RHO_STEPS << RHO_AT;
}

void dpoint_unpack(struct dpoint *point, const struct dpoint_word *word, const struct dpoint_box *box)
{
	const float *normal = psr_direction_table()[word->attr & NORMAL_MASK];
	const unsigned angle = word->place >> ANGLE_AT & 127, lambda = word->place >> LAMBDA_AT & 255;
	const int rho = (int)(word->place >> RHO_AT & 127) - DPOINT_RHO_STEPS;
	float x[3], y[3];

	pthread_once(&tables_once, make_tables);
	tangents(x, y, normal);
	for (int k = 0; k < 3; k++) {
		point->at[k] = box->low[k] + (float)(word->place >> k * PLACE_BITS & DPOINT_PLACE_STEPS) * box->step[k];
		point->normal[k] = normal[k];
		point->u[k] = turn[angle][0] * x[k] + turn[angle][1] * y[k];
	}
	point->lambda_u = lambda & 128 ? -lambda_of_code[lambda & 127] : lambda_of_code[lambda & 127];
	point->rho = rho > DPOINT_RHO_STEPS ? 1.0f : (float)rho / DPOINT_RHO_STEPS;
	point->attr = word->attr;
}

int dpoint_word_is_valid(const struct dpoint_word *word)
{
	const unsigned lambda = word->place >> LAMBDA_AT & 255, rho = word->place >> RHO_AT & 127;

	return rho <= 2 * DPOINT_RHO_STEPS && lambda != 128 && (lambda != 0 || rho == DPOINT_RHO_STEPS);
}
