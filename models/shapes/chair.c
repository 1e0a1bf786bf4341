/* A Windsor chair: a saddled seat, turned legs with stretchers, a hooped back with slender spindles. It faces +z. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "image.h"
#include "surfaces.h"
#include "sweep.h"

#define SEAT_Y 0.44
#define HALF_WIDTH 0.235
#define HALF_DEPTH 0.22
#define THICK 0.022      /* half of the seat's thickness */
#define HOOP_WIDTH 0.205 /* half the hoop's width at the seat */
#define HOOP_HEIGHT 0.5
#define HOOP_Z -0.17
#define HOOP_LEAN 0.16   /* how far its crown leans back */
#define SPINDLES 7

enum { WOOD, DARK, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[WOOD] = { "elm", 0xffffff, 0, 0.45, 0 },
	[DARK] = { "stained ash", 0x6b3d22, 0, 0.4, 0 },
};

/* v goes from the middle of the underside by the edge to the middle of the saddle. */
static void seat_at(double u, double v, double p[3], const void *context)
{
	double c, s, r, edge_c = 0, edge_s = v < 0.5 ? -1 : 1, square, saddle;

	(void)context;
	sweep_angle(u, &c, &s);
	if (v < 0.4) {
		r = v / 0.4;
	} else if (v > 0.6) {
		r = (1 - v) / 0.4;
	} else {
		sweep_angle((v - 0.5) * 2.5, &edge_c, &edge_s);
		r = 1;
	}
	/* halfway between an ellipse and a squircle */
	square = 0.5 + 0.5 / sqrt(sqrt(c * c * c * c + s * s * s * s));
	p[0] = (HALF_WIDTH * r * square + THICK * edge_c) * c;
	p[2] = -(HALF_DEPTH * r * square + THICK * edge_c) * s;
	saddle = v < 0.5 ? 0 : 0.017 * (1 - r * r) * (1 - r * r) * (1 - 0.4 * p[2] / HALF_DEPTH);
	p[1] = SEAT_Y + THICK * edge_s - saddle;
}

static void seat(struct shape *shape)
{
	static const double u[4] = { 2.1, 1.1, 0, 0.3 }, v[4] = { 0, 0, 1.4, 0.1 };
	uint32_t first = shape->n_vertices;

	shape->current = WOOD;
	sweep_surface(shape, seat_at, NULL, 60, 96, 1);
	shape_map(shape, first, u, v);
}

/* Turned: a foot that tapers, a bulb, two rings, a neck. Its y runs from 0 to 1 along the leg. */
static void leg(struct shape *shape, const double foot[3], const double top[3])
{
	const struct surface_profile pieces[] = {
		surface_line(0, 0, 0.011, 0, 1, DARK),
		{ { { 0.011, 0 }, { 0.015, 0.1 }, { 0.024, 0.25 }, { 0.017, 0.34 } }, 0, 1, 14, DARK },
		{ { { 0.017, 0.34 }, { 0.026, 0.342 }, { 0.026, 0.36 }, { 0.017, 0.362 } }, 0, 1, 8, DARK },
		{ { { 0.017, 0.362 }, { 0.014, 0.42 }, { 0.03, 0.55 }, { 0.018, 0.7 } }, 0, 1, 18, DARK },
		{ { { 0.018, 0.7 }, { 0.025, 0.702 }, { 0.025, 0.72 }, { 0.018, 0.722 } }, 0, 1, 8, DARK },
		{ { { 0.018, 0.722 }, { 0.014, 0.8 }, { 0.018, 0.9 }, { 0.016, 1 } }, 0, 1, 10, DARK },
		surface_line(0.016, 1, 0, 1, 1, DARK),
	};
	double length, axis[3];
	uint32_t first = shape->n_vertices;

	v3d_sub(axis, top, foot);
	length = v3d_length(axis);
	const double stretch[3][3] = { { 1, 0, 0 }, { 0, length, 0 }, { 0, 0, 1 } }, origin[3] = { 0, 0, 0 };
	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], 32);
	shape_transform(shape, first, stretch, origin);
	sweep_along(shape, first, foot, top);
}

/* A stretcher, thickest in its middle. */
static void stretcher(struct shape *shape, const double a[3], const double b[3])
{
	double path[21][3], radius[21];

	for (int i = 0; i <= 20; i++) {
		double t = i / 20.0, swell = 4 * t * (1 - t);

		for (int k = 0; k < 3; k++)
			path[i][k] = a[k] + (b[k] - a[k]) * t;
		radius[i] = 0.007 + 0.007 * swell * swell;
	}
	shape->current = DARK;
	sweep_tube(shape, (const double (*)[3])path, radius, 21, 20);
}

static void legs(struct shape *shape)
{
	double foot[4][3], top[4][3], side[2][2][3], cross[2][3];

	for (int i = 0; i < 4; i++) {
		double x = i & 1 ? 1 : -1, z = i & 2 ? 1 : -1;

		v3d_set(foot[i], 0.215 * x, 0, 0.225 * z);
		v3d_set(top[i], 0.15 * x, SEAT_Y - 0.005, 0.135 * z);
		leg(shape, foot[i], top[i]);
	}
	for (int x = 0; x < 2; x++) {
		for (int z = 0; z < 2; z++)
			for (int k = 0; k < 3; k++)
				side[x][z][k] = foot[x + 2 * z][k] + (top[x + 2 * z][k] - foot[x + 2 * z][k]) * 0.35;
		stretcher(shape, side[x][0], side[x][1]);
		for (int k = 0; k < 3; k++)
			cross[x][k] = (side[x][0][k] + side[x][1][k]) / 2;
	}
	stretcher(shape, cross[0], cross[1]);
}

/* The hoop's place: `along` half turns from its right foot to its left. */
static void hoop_at(double along, double p[3])
{
	double c, s, rise;

	sweep_angle(along / 2, &c, &s);
	rise = s * (1.2 - 0.2 * s);
	v3d_set(p, HOOP_WIDTH * c * (1 + 0.12 * s), SEAT_Y - 0.005 + HOOP_HEIGHT * rise, HOOP_Z - HOOP_LEAN * rise);
}

static void back(struct shape *shape)
{
	double path[65][3], radius[65];

	for (int i = 0; i <= 64; i++) {
		hoop_at(i / 64.0, path[i]);
		radius[i] = 0.0115;
	}
	shape->current = DARK;
	sweep_tube(shape, (const double (*)[3])path, radius, 65, 24);
	for (int i = 0; i < SPINDLES; i++) {
		double along = 0.2 + 0.6 * (i + 0.5) / SPINDLES, foot[3], top[3], spindle[17][3], thick[17];

		hoop_at(along, top);
		v3d_set(foot, top[0] * 0.8, SEAT_Y, HOOP_Z - 0.005);
		for (int j = 0; j <= 16; j++) {
			double t = j / 16.0, swell = 4 * t * (1 - t);

			for (int k = 0; k < 3; k++)
				spindle[j][k] = foot[k] + (top[k] - foot[k]) * t;
			thick[j] = 0.0038 + 0.0022 * swell * (1.4 - t);
		}
		sweep_tube(shape, (const double (*)[3])spindle, thick, 17, 16);
	}
}

void make_chair(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	shape_image(shape, WOOD, 128, image_wood(128, 0x6e4022, 0xb57b45, 11));
	seat(shape);
	legs(shape);
	back(shape);
}
