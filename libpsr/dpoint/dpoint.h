/* Differential points ([K] 4.1): a point that knows the principal curvatures of the surface around it, and stands for a
 * rectangle on its tangent plane, with a normal of its own at each place. [K] is Kalaiah and Varshney, "Differential
 * Point Rendering", 2001. Lengths are in inner units (psr/model.h), curvatures in their inverse.
 *
 * The frame of a point is (u, v, normal): u is the direction of the curvature of greater magnitude, v = normal x u. A
 * curvature is positive where the surface bends towards its normal: a sphere with its normals outwards has negative
 * ones.
 *
 * All arithmetic is additions, multiplications, true division and sqrt: the same bits on every machine. */
#ifndef PSR_DPOINT_DPOINT_H
#define PSR_DPOINT_DPOINT_H

#include <math.h>
#include <stdint.h>
#include "base/maths.h"

struct dpoint {
	float at[3], normal[3], u[3]; /* u and normal are of unit length, perpendicular to each other */
	float lambda_u;               /* 0, or DPOINT_LEAST_LAMBDA / 2 .. DPOINT_MOST_LAMBDA in magnitude */
	float rho;                    /* lambda_v / lambda_u, -1..1; 0 where lambda_u is 0 */
	uint64_t attr;                /* as of a sample of blocks, with the normal's index in bits 0 to 14 */
};

/* ---- from curvatures ---- */

enum dpoint_made {
	DPOINT_BAD,     /* a NaN, an infinity, or no normal: there is no point */
	DPOINT_MADE,
	DPOINT_CLAMPED, /* a curvature beyond DPOINT_MOST_LAMBDA was brought to it */
};

/* A place of a surface: its height above the tangent plane at x, y is (a x x + 2 b x y + c y y) / 2 in second order. */
struct dpoint_local {
	double at[3], axis[3][3]; /* x, y, normal: orthonormal */
	double shape[3];          /* a, b, c */
};

/* Finds principal curvatures and directions. At an umbilic point, where all directions are principal ones, u is x. attr
 * is 0. */
enum dpoint_made dpoint_make(struct dpoint *out, const struct dpoint_local *local);

/* How shading's normal leans from a flat point's, where a mesh has normals of its own: its components along u and v,
 * where that along the normal is 1, and how they grow along u and v. */
struct dpoint_lean {
	int16_t at[2];     /* in the middle, in 2^-12 */
	uint16_t by[2][2]; /* of each component, along each of u and v: the upper half of a float */
};

#define DPOINT_LEAN_STEP 0x1p-12f
#define DPOINT_MOST_LEAN_BY 0x1p20f /* in magnitude */

static inline float dpoint_lean_by(uint16_t by)
{
	return psr_float_from_bits((uint32_t)by << 16);
}

/* ---- 16 bytes ---- */

struct dpoint_word {
	/* From bit 0: x, y, z (12 each), two steps from the attributes' normal (3 each), angle of u (7), lambda_u (8: sign
	 * in the highest), rho (7). */
	uint64_t place;
	uint64_t attr;
};

#define DPOINT_PLACE_STEPS 4095
#define DPOINT_FINE_STEP 0.00553f     /* of a normal along each tangent: eight of them reach over a triangle of normals */
#define DPOINT_FINE_MIDDLE 3.5f
#define DPOINT_LAMBDA_STEPS 6         /* an octave */
#define DPOINT_LEAST_LAMBDA 0x1p-5    /* codes 1 to 127 reach from one to the other, 0 is 0 */
#define DPOINT_MOST_LAMBDA 0x1p16
#define DPOINT_RHO_STEPS 63           /* from 0 to 1; code DPOINT_RHO_STEPS is 0 */
#define DPOINT_ANGLES 128             /* of half a turn */

/* The box of a group of points, which places are counted in. */
struct dpoint_box {
	float low[3], step[3];
};

/* Makes a box that reaches from low to high at least; low <= high, finite, below 2^10 in magnitude. */
void dpoint_box_make(struct dpoint_box *box, const float low[3], const float high[3]);

/* Packs a point to the nearest word; to the same one if it was unpacked, and its attributes' normal was left alone. What
 * dpoint_unpack() then gives differs from it by at most:
 *   place       half a step of the box and 2^-22 of its greatest coordinate, on each axis; it is inside of the box
 *   normal      half a step along each tangent, 0.23 degrees in all
 *   direction   pi / 256 around the normal, after it was brought to the tangent plane of the new one
 *   lambda_u    a factor of 2^(1/12), or DPOINT_LEAST_LAMBDA / 2 where it is below DPOINT_LEAST_LAMBDA
 *   rho         1/126; -1, 0 and 1 stay what they are */
void dpoint_pack(struct dpoint_word *word, const struct dpoint *point, const struct dpoint_box *box);

/* Unpacks any word. */
void dpoint_unpack(struct dpoint *point, const struct dpoint_word *word, const struct dpoint_box *box);

/* What codes of a word stand for, for kernels that unpack many. */
enum {
	DPOINT_PLACE_BITS = 12, DPOINT_FINE_BITS = 3, DPOINT_FINE_AT = 36, DPOINT_ANGLE_AT = 42, DPOINT_LAMBDA_AT = 49,
	DPOINT_RHO_AT = 57,
};
struct dpoint_tables {
	float lambda[256];             /* with its sign */
	float turn[DPOINT_ANGLES][2];  /* cosine and sine of an angle from the first tangent */
};
const struct dpoint_tables *dpoint_tables(void);

/* Finds a basis of the tangent plane that is continuous but where z changes its sign (Duff et al., "Building an
 * Orthonormal Basis, Revisited", 2017): one division. Angles count from x. */
static inline void dpoint_tangents(float x[3], float y[3], const float n[3])
{
	const float sign = psr_choose(n[2] < 0, -1, 1);
	const float a = -1.0f / (sign + n[2]), b = n[0] * n[1] * a;

	x[0] = 1.0f + sign * n[0] * n[0] * a;
	x[1] = sign * b;
	x[2] = -sign * n[0];
	y[0] = b;
	y[1] = sign + n[1] * n[1] * a;
	y[2] = -n[1];
}

/* Computes the normal that is `fine` steps from a triangle's centre, of unit length. */
static inline void dpoint_fine_normal(float n[3], const float center[3], const float fine[2])
{
	const float unit = 1 / sqrtf(1 + (fine[0] * fine[0] + fine[1] * fine[1]));
	float x[3], y[3];

	dpoint_tangents(x, y, center);
	for (int k = 0; k < 3; k++)
		n[k] = (center[k] + (fine[0] * x[k] + fine[1] * y[k])) * unit;
}

static inline void dpoint_fine_of(float fine[2], uint64_t place)
{
	for (int k = 0; k < 2; k++) {
		const int32_t code = (int32_t)(place >> (DPOINT_FINE_AT + k * DPOINT_FINE_BITS) & 7);

		fine[k] = ((float)code - DPOINT_FINE_MIDDLE) * DPOINT_FINE_STEP;
	}
}

/* Returns whether dpoint_pack() could have written the word. */
int dpoint_word_is_valid(const struct dpoint_word *word);

/* ---- extent and surface ---- */

/* What limits extents: [K]'s epsilon as sqrt(2 epsilon - epsilon^2), and delta along u and v. */
struct dpoint_limit {
	float sine, delta[2];
};

/* Deltas of a group are among these: 2^(-class / 4). */
#define DPOINT_DELTA_CLASSES 64
static inline float dpoint_delta_of_class(unsigned class)
{
	static const float quarter[4] = { 1.0f, 0.84089641525f, 0.70710678119f, 0.59460355750f };

	return quarter[class % 4] * psr_float_from_bits((127 - class / 4) << 23);
}

/* epsilon: 0..1 */
static inline float dpoint_sine(double epsilon)
{
	return (float)sqrt(2.0 * epsilon - epsilon * epsilon);
}

/* Computes half of the rectangle's sides along u and v ([K] 4.1): at most delta, also where a curvature is 0. */
static inline void dpoint_extent(float extent[2], const struct dpoint *point, const struct dpoint_limit *limit)
{
	const float u = fabsf(point->lambda_u), v = fabsf(point->lambda_u * point->rho);

	/* Without a division by 0: delta counts where delta |lambda| <= sine. */
	extent[0] = limit->delta[0] * u <= limit->sine ? limit->delta[0] : limit->sine / u;
	extent[1] = limit->delta[1] * v <= limit->sine ? limit->delta[1] : limit->sine / v;
}

/* Quadrics of neighbours end at slightly different heights, and a sight that grazes them would pass between. Where it
 * leans by the tangent t to a point's normal, along u or v, it sees the rectangle reach further over those sides: by t
 * times a sixteenth of a sample, which is as wide a strip across the sight, up to DPOINT_GRAZES of them (decision
 * 0158). Where it goes along that side, too, it sees such a strip from its narrow end, which is why that is kept short.
 * Seen from the front, the rectangle is as it is. */
#define DPOINT_GRAZES 8

/* A sixteenth of a sample of a model, inner units; of coarse ones, 2^-8. */
static inline float dpoint_graze(uint32_t resolution)
{
	const float sixteenth = 0.125f / (float)resolution;

	return sixteenth < 0x1p-8f ? sixteenth : 0x1p-8f;
}

/* How far a sight reaches over a side. along, across, down: its direction towards the side, along it, and along the
 * normal. */
static inline float dpoint_graze_by(float graze, float along, float across, float down)
{
	const float a = __builtin_fabsf(along), steep = a / (__builtin_fabsf(down) + 1e-20f);
	const float slim = 1.5f * (1 + a / (__builtin_fabsf(across) + 1e-20f));
	const float most = slim < DPOINT_GRAZES ? slim : DPOINT_GRAZES;

	return graze * psr_choose(steep < most, steep, most);
}

/* asin(w) / w for |w| <= 1/2 by its series in q = w^2: all coefficients are positive and fall, so that what follows the
 * term of q^8 is at most c9 q^9 / (1 - q) = 0.0097617 * 4^-9 / 0.75 < 4.97e-8. */
static inline float dpoint_asin_series(float q)
{
	float sum = 6435.0f / 557056.0f;

	sum = sum * q + 143.0f / 10240.0f;
	sum = sum * q + 231.0f / 13312.0f;
	sum = sum * q + 63.0f / 2816.0f;
	sum = sum * q + 35.0f / 1152.0f;
	sum = sum * q + 5.0f / 112.0f;
	sum = sum * q + 3.0f / 40.0f;
	sum = sum * q + 1.0f / 6.0f;
	return sum * q + 1.0f;
}

/* Returns asin(w) / w, of w clamped to -1..1, within 1e-6: the series, or beyond 1/2 by
 * asin w = pi/2 - 2 asin sqrt((1 - w) / 2). The constant, the root, the series and the product are off by 3.7e-7
 * together, twice as much after the division by 1/2. For NaN returns pi/2. */
static inline float dpoint_asin_ratio(float w)
{
	const float positive = fabsf(w), size = positive < 1.0f ? positive : 1.0f;
	const float half = 0.5f * (1.0f - size);
	const int is_far = size > 0.5f;
	const float series = dpoint_asin_series(is_far ? half : size * size);

	return is_far ? (1.57079632679f - 2.0f * sqrtf(half) * series) / size : series;
}

/* Computes lambda_p(t) |(u, v)|, the sine that [K] (5) takes the arc of: lambda_u psi of (6). 0 in the middle. */
static inline float dpoint_sine_at(float lambda_u, float rho, float u, float v)
{
	const float r = sqrtf(u * u + v * v);

	return r > 0.0f ? lambda_u * (u * u + rho * v * v) / r : 0.0f;
}

/* Computes the normal by [K] (6) in the point's frame, not of unit length; its last component is 1. */
static inline void dpoint_normal_at(float normal[3], float lambda_u, float rho, float u, float v)
{
	const float k = lambda_u * dpoint_asin_ratio(dpoint_sine_at(lambda_u, rho, u, v));

	normal[0] = -(u * k);
	normal[1] = -(rho * v * k);
	normal[2] = 1.0f;
}

/* Returns how far S_p is above the tangent plane at u, v: where its semicircle ends it stays at that height. */
static inline float dpoint_height_at(float lambda_u, float rho, float u, float v)
{
	const float r = sqrtf(u * u + v * v), w = dpoint_sine_at(lambda_u, rho, u, v);
	const float inside = 1.0f - w * w;

	/* 1/lambda - sqrt(1/lambda^2 - r^2) without a difference; the semicircle's radius is r / w. */
	return inside > 0.0f ? w * r / (1.0f + sqrtf(inside)) : r / w;
}

#endif
