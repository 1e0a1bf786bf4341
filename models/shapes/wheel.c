/* A bicycle wheel, 36 spokes crossing three times. It is made around +Y and stood up at the end. */
#include "generators.h"

#include "surfaces.h"

#define SPOKES 36
#define SPOKE_RADIUS 0.0035
#define SPOKE_SIDES 12
#define FLANGE_Y 0.085      /* the hub's flanges, from the middle plane */
#define FLANGE_RADIUS 0.058 /* of the circle of spoke holes */
#define RIM_RADIUS 0.865    /* where the nipples sit */
#define AROUND 256

enum { RUBBER, SIDEWALL, RIM, SPOKE, NIPPLE, HUB, AXLE, REFLECTOR, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[RUBBER] = { "tread", 0x26262a, 0, 0.85, 0 },
	[SIDEWALL] = { "sidewall", 0xb98a52, 0, 0.8, 0 },
	[RIM] = { "rim", 0xc6c9cf, 0.5, 0.3, 0 },
	[SPOKE] = { "spoke", 0xd8d9dc, 0.5, 0.2, 0 },
	[NIPPLE] = { "nipple", 0xc79a45, 0.5, 0.35, 0 },
	[HUB] = { "hub", 0x9aa0a8, 0.5, 0.25, 0 },
	[AXLE] = { "axle", 0x4a4c50, 0.5, 0.5, 0 },
	[REFLECTOR] = { "reflector", 0xe8801a, 0, 0.15, 0 },
};

/* A quarter of a circle as a cubic Bezier curve, kappa = 4 (sqrt 2 - 1) / 3 */
#define KAPPA 0.5522847498
#define QUARTER(cx, cy, ax, ay, bx, by) \
	{ { (cx) + (ax), (cy) + (ay) }, { (cx) + (ax) + KAPPA * (bx), (cy) + (ay) + KAPPA * (by) }, \
	  { (cx) + (bx) + KAPPA * (ax), (cy) + (by) + KAPPA * (ay) }, { (cx) + (bx), (cy) + (by) } }

#define TIRE 0.05
#define TIRE_RADIUS 0.95

static void tire_and_rim(struct shape *shape)
{
	const struct surface_profile tire[] = {
		{ QUARTER(TIRE_RADIUS, 0, 0, -TIRE, TIRE, 0), 0, 0.3, 5, SIDEWALL },
		{ QUARTER(TIRE_RADIUS, 0, 0, -TIRE, TIRE, 0), 0.3, 1, 10, RUBBER },
		{ QUARTER(TIRE_RADIUS, 0, TIRE, 0, 0, TIRE), 0, 0.7, 10, RUBBER },
		{ QUARTER(TIRE_RADIUS, 0, TIRE, 0, 0, TIRE), 0.7, 1, 5, SIDEWALL },
		{ QUARTER(TIRE_RADIUS, 0, 0, TIRE, -TIRE, 0), 0, 1, 12, SIDEWALL },
		{ QUARTER(TIRE_RADIUS, 0, -TIRE, 0, 0, -TIRE), 0, 1, 12, SIDEWALL },
	};
	/* a box section: brake flanks, the inner side rounded towards the hub */
	const struct surface_profile rim[] = {
		surface_line(0.88, -0.042, 0.925, -0.042, 2, RIM),
		surface_line(0.925, -0.042, 0.925, 0.042, 4, RIM),
		surface_line(0.925, 0.042, 0.88, 0.042, 2, RIM),
		{ { { 0.88, 0.042 }, { 0.868, 0.042 }, { 0.86, 0.025 }, { 0.86, 0 } }, 0, 1, 8, RIM },
		{ { { 0.86, 0 }, { 0.86, -0.025 }, { 0.868, -0.042 }, { 0.88, -0.042 } }, 0, 1, 8, RIM },
	};

	surface_lathe(shape, tire, sizeof tire / sizeof tire[0], AROUND);
	surface_lathe(shape, rim, sizeof rim / sizeof rim[0], AROUND);
	shape->current = RIM;
	surface_torus(shape, 0.925, 0.006, -0.04, AROUND, 10);
	surface_torus(shape, 0.925, 0.006, 0.04, AROUND, 10);
}

static void hub(struct shape *shape)
{
	const struct surface_profile shell[] = {
		surface_line(0, -0.095, 0.03, -0.095, 1, HUB),
		surface_line(0.03, -0.095, 0.066, -0.09, 2, HUB),
		surface_line(0.066, -0.09, 0.066, -0.08, 1, HUB),
		surface_line(0.066, -0.08, 0.036, -0.075, 2, HUB),
		{ { { 0.036, -0.075 }, { 0.026, -0.05 }, { 0.024, -0.03 }, { 0.024, 0 } }, 0, 1, 10, HUB },
		{ { { 0.024, 0 }, { 0.024, 0.03 }, { 0.026, 0.05 }, { 0.036, 0.075 } }, 0, 1, 10, HUB },
		surface_line(0.036, 0.075, 0.066, 0.08, 2, HUB),
		surface_line(0.066, 0.08, 0.066, 0.09, 1, HUB),
		surface_line(0.066, 0.09, 0.03, 0.095, 2, HUB),
		surface_line(0.03, 0.095, 0, 0.095, 1, HUB),
	};
	static const double axle[2][3] = { { 0, -0.16, 0 }, { 0, 0.16, 0 } };
	static const double nut[4][3] = { { 0, -0.13, 0 }, { 0, -0.105, 0 }, { 0, 0.105, 0 }, { 0, 0.13, 0 } };

	surface_lathe(shape, shell, sizeof shell / sizeof shell[0], 96);
	shape->current = AXLE;
	surface_rod(shape, axle[0], 0.011, axle[1], 0.011, 32);
	surface_rod(shape, nut[0], 0.024, nut[1], 0.024, 6);
	surface_rod(shape, nut[2], 0.024, nut[3], 0.024, 6);
}

/* Spoke i leaves its flange 6 holes (three crossings) before or behind the place of its nipple. */
static void spoke(struct shape *shape, uint32_t i)
{
	double side = i & 1 ? 1 : -1, c, s, from[3], to[3], middle[3];
	uint32_t offset = i & 2 ? 6 : SPOKES - 6;

	surface_turn(i + offset, SPOKES, &c, &s);
	from[0] = FLANGE_RADIUS * c;
	from[1] = side * FLANGE_Y;
	from[2] = -FLANGE_RADIUS * s;
	surface_turn(i, SPOKES, &c, &s);
	to[0] = RIM_RADIUS * c;
	to[1] = side * 0.008;
	to[2] = -RIM_RADIUS * s;
	for (int k = 0; k < 3; k++)
		middle[k] = to[k] + (from[k] - to[k]) * 0.04;
	shape->current = SPOKE;
	surface_rod(shape, from, SPOKE_RADIUS, to, SPOKE_RADIUS, SPOKE_SIDES);
	shape->current = NIPPLE;
	surface_rod(shape, middle, SPOKE_RADIUS * 1.4, to, SPOKE_RADIUS * 2.2, SPOKE_SIDES);
}

/* Two flat ones between the spokes, opposite to each other. */
static void reflectors(struct shape *shape)
{
	static const double half[3] = { 0.03, 0.012, 0.1 };

	shape->current = REFLECTOR;
	for (int sign = -1; sign <= 1; sign += 2) {
		const double move[3] = { sign * 0.66, 0, 0 };
		uint32_t first = shape->n_vertices;

		surface_box(shape, half);
		shape_shift(shape, first, move);
	}
}

void make_wheel(struct shape *shape)
{
	static const double stand[3][3] = { { 1, 0, 0 }, { 0, 0, -1 }, { 0, 1, 0 } };
	static const double lift[3] = { 0, TIRE_RADIUS + TIRE, 0 };

	shape_materials(shape, materials, N_MATERIALS);
	tire_and_rim(shape);
	hub(shape);
	for (uint32_t i = 0; i < SPOKES; i++)
		spoke(shape, i);
	reflectors(shape);
	shape_move(shape, 0, stand, lift);
}
