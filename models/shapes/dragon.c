/* A dragon that winds itself into a trefoil knot and bites its tail: one closed scaly tube with a crest of spikes. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "surfaces.h"
#include "sweep.h"

#define SCALES_ALONG 150
#define SCALES_AROUND 20
#define STEPS 6          /* quads a scale, along and around */
#define ROWS (SCALES_ALONG * STEPS)
#define COLS (SCALES_AROUND * STEPS)
#define MAJOR 2.15
#define MINOR 0.95
#define LIFT 1.35        /* so that the lowest part lies on the ground */
#define BELLY_FROM 7     /* the scales from here on, to BELLY_TO, are the belly */
#define BELLY_TO 13
#define HEAD 0.012       /* half of the knot's part that the head hides */

enum { SCALE, SCALE_DARK, BELLY, SPIKE, EYE, PUPIL, HORN, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[SCALE] = { "jade scales", 0x2f8f62, 0.2, 0.35, 0 },
	[SCALE_DARK] = { "dark scales", 0x17603f, 0.2, 0.35, 0 },
	[BELLY] = { "golden belly", 0xdcb463, 0.2, 0.45, 0 },
	[SPIKE] = { "crest", 0xb5402c, 0, 0.45, 0 },
	[EYE] = { "eye", 0xf4c430, 0, 0.1, 0 },
	[PUPIL] = { "pupil", 0x18130c, 0, 0.1, 0 },
	[HORN] = { "horn", 0xe9dfc8, 0, 0.5, 0 },
};

/* The knot at t turns: place, direction, and the normal of the torus that it lies on. */
static void knot_at(double t, double p[3], double along[3], double out[3])
{
	double c2, s2, c3, s3, r;

	sweep_angle(2 * t, &c2, &s2);
	sweep_angle(3 * t, &c3, &s3);
	r = MAJOR + MINOR * c3;
	v3d_set(p, r * c2, LIFT + MINOR * s3, -r * s2);
	v3d_set(out, c3 * c2, s3, -c3 * s2);
	v3d_set(along, -2 * r * s2 - 3 * MINOR * s3 * c2, 3 * MINOR * c3, -2 * r * c2 + 3 * MINOR * s3 * s2);
	v3d_normalize(along, along);
}

/* The body's radius: slim behind the head (t = 0), thick in its middle, thin at the tail's end (t = 1). */
static double girth(double t)
{
	double body = 0.17 + 0.9 * t * (1 - t) * (1.25 - 0.5 * t) + 0.1 * (1 - t);
	double blend = t < HEAD ? 0.5 + t / HEAD / 2 : t > 1 - HEAD ? 0.5 - (1 - t) / HEAD / 2 : 2;

	/* head and tail meet within the head */
	if (blend <= 1) {
		double neck = 0.27, tail = 0.17;

		blend = blend * blend * (3 - 2 * blend);
		return tail + (neck - tail) * blend;
	}
	return body;
}

/* Relief of 0 to 1: scales in staggered rows that rise towards the tail, and rings across the belly. */
static double relief(uint32_t row, uint32_t col)
{
	double along = (double)row / STEPS, around = (double)col / STEPS, away, a, b;

	if (col >= BELLY_FROM * STEPS && col <= BELLY_TO * STEPS) {
		away = fabs(2 * (along - floor(along)) - 1);
		return 0.9 * (1 - away * away * away);
	}
	along += 0.5 * ((uint32_t)floor(around) & 1);
	a = along - floor(along);
	b = 2 * (around - floor(around)) - 1;
	away = 1 - b * b * (0.45 + 0.55 * a);
	return away * (0.25 + 0.75 * a) * (a > 0.84 ? (1 - a) / 0.16 : 1);
}

static void skin(struct shape *shape)
{
	static struct shape_vertex grid[ROWS * COLS];
	static const struct sweep_grid all = { grid, ROWS, COLS, 1 };
	double p[3], along[3], out[3], side[3], c, s;

	for (uint32_t row = 0; row < ROWS; row++) {
		double t = (double)row / ROWS, radius = girth(t);

		knot_at(t, p, along, out);
		v3d_cross(side, along, out);
		for (uint32_t col = 0; col < COLS; col++) {
			struct shape_vertex *v = &grid[row * COLS + col];
			double r = radius * (0.95 + 0.11 * relief(row, col));

			surface_turn(col, COLS, &c, &s);
			v3d_add_scaled(v->p, p, r * c, out);
			v3d_add_scaled(v->p, v->p, r * s, side);
		}
	}
	sweep_normals(grid, ROWS, COLS, 1, 1);
	for (uint32_t col = 0; col < SCALES_AROUND; col++) {
		shape->current = col >= BELLY_FROM && col < BELLY_TO ? BELLY : col < 2 || col >= SCALES_AROUND - 2
			? SCALE_DARK : SCALE;
		sweep_band(shape, &all, col * STEPS, (col + 1) * STEPS);
	}
}

static void crest(struct shape *shape)
{
	double p[3], along[3], out[3], foot[3], tip[3];

	shape->current = SPIKE;
	for (uint32_t i = 5; i + 3 < SCALES_ALONG; i += 2) {
		double t = (double)i / SCALES_ALONG, radius = girth(t);

		knot_at(t, p, along, out);
		v3d_add_scaled(foot, p, radius * 0.85, out);
		v3d_add_scaled(tip, p, radius * 1.72, out);
		v3d_add_scaled(tip, tip, radius * 0.45, along);
		sweep_cone(shape, foot, radius * 0.22, tip, 16);
	}
}

/* Made around the origin, snout along -z, up +y; then put over the ends of the body. */
static void head(struct shape *shape)
{
	static const double skull[3] = { 0, 0.03, 0.05 }, skull_half[3] = { 0.37, 0.34, 0.46 };
	static const double snout[3] = { 0, 0.06, -0.46 }, snout_half[3] = { 0.24, 0.15, 0.42 };
	static const double jaw[3] = { 0, -0.26, -0.36 }, jaw_half[3] = { 0.2, 0.085, 0.46 };
	uint32_t first = shape->n_vertices;
	double p[3], along[3], out[3], side[3];

	shape->current = SCALE;
	sweep_ball(shape, skull, skull_half, 40, 64);
	sweep_ball(shape, snout, snout_half, 32, 48);
	shape->current = BELLY;
	sweep_ball(shape, jaw, jaw_half, 28, 48);
	for (int x = -1; x <= 1; x += 2) {
		const double eye[3] = { 0.225 * x, 0.24, -0.24 }, brow[3] = { 0.23 * x, 0.33, -0.2 };
		const double pupil[3] = { 0.262 * x, 0.262, -0.31 }, nostril[3] = { 0.1 * x, 0.17, -0.79 };
		static const double eye_half[3] = { 0.1, 0.1, 0.1 }, pupil_half[3] = { 0.042, 0.055, 0.035 };
		static const double brow_half[3] = { 0.13, 0.05, 0.16 }, nostril_half[3] = { 0.06, 0.05, 0.06 };
		const double horn[3][3] = { { 0.17 * x, 0.28, 0.16 }, { 0.3 * x, 0.75, 0.35 }, { 0.28 * x, 0.8, 0.95 } };
		const double whisker[3][3] = { { 0.16 * x, 0, -0.75 }, { 0.75 * x, 0.1, -0.8 }, { 0.95 * x, -0.2, -0.1 } };
		double path[25][3], radius[25];

		shape->current = EYE;
		sweep_ball(shape, eye, eye_half, 20, 32);
		shape->current = PUPIL;
		sweep_ball(shape, pupil, pupil_half, 14, 20);
		shape->current = SCALE_DARK;
		sweep_ball(shape, brow, brow_half, 16, 24);
		sweep_ball(shape, nostril, nostril_half, 16, 24);
		shape->current = HORN;
		for (int i = 0; i <= 24; i++) {
			double a = i / 24.0, b = 1 - a;

			for (int k = 0; k < 3; k++)
				path[i][k] = b * b * horn[0][k] + 2 * a * b * horn[1][k] + a * a * horn[2][k];
			radius[i] = 0.085 * b;
		}
		sweep_tube(shape, (const double (*)[3])path, radius, 25, 24);
		sweep_bend(shape, whisker, 0.012, 32, 10);
		for (int i = 0; i < 5; i++) {
			const double root[3] = { (0.2 - 0.022 * i * i * 0.4) * x, -0.02 + 0.012 * i, -0.36 - 0.1 * i };
			const double tip[3] = { root[0] * 0.95, root[1] - 0.16 + 0.015 * i, root[2] - 0.02 };

			sweep_cone(shape, root, 0.03, tip, 12);
		}
	}
	knot_at(0, p, along, out);
	v3d_cross(side, out, along);
	/* columns: where x, y and z go */
	const double turn[3][3] = { { side[0], out[0], along[0] }, { side[1], out[1], along[1] },
		{ side[2], out[2], along[2] } };
	shape_move(shape, first, turn, p);
}

void make_dragon(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	skin(shape);
	crest(shape);
	head(shape);
}
