/* The Wright brothers' Flyer of 1903, in metres: a biplane of spruce, muslin and wire. It flies along +x. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "surfaces.h"
#include "sweep.h"

#define SPAN 12.3
#define CHORD 2.0
#define GAP 1.88       /* between the wings */
#define LOW_Y 0.75     /* the lower wing's height */
#define DROOP 0.12     /* of the wings' tips */
#define STRUT 0.022
#define WIRE 0.0045
#define BAYS 8         /* cells between the struts; the pilot's is the middle one */

enum { MUSLIN, SPRUCE, WIRES, ENGINE, RADIATOR, CHAIN, PILOT, SUIT, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[MUSLIN] = { "muslin", 0xeee4c8, 0, 0.95, 0 },
	[SPRUCE] = { "spruce", 0xb98749, 0, 0.6, 0 },
	[WIRES] = { "steel wire", 0x8e9299, 0.5, 0.4, 0 },
	[ENGINE] = { "cast engine", 0x5b5e63, 0.4, 0.5, 0 },
	[RADIATOR] = { "copper radiator", 0xa35f34, 0.5, 0.45, 0 },
	[CHAIN] = { "chain", 0x2f3032, 0.4, 0.5, 0 },
	[PILOT] = { "skin", 0xd9a883, 0, 0.7, 0 },
	[SUIT] = { "suit", 0x39332d, 0, 0.9, 0 },
};

/* A thin cambered wing of a rectangle's plan with rounded tips, u around its section from the trailing edge over the
 * top, v along the span from +z to -z. */
struct wing {
	double x, y, chord, half_span, thick, camber, droop;
};

static void wing_at(double u, double v, double p[3], const void *context)
{
	const struct wing *w = context;
	double z = 1 - 2 * v, tip = fabs(z) > 0.93 ? (fabs(z) - 0.93) / 0.07 : 0, c, s, at;
	double round = v > 0 && v < 1 ? sqrt(1 - tip * tip) : 0;

	sweep_angle(u, &c, &s);
	/* 0 at the trailing edge, 1 at the leading edge */
	at = (1 - c) / 2;
	p[0] = w->x + w->chord * (at - 0.5) * sqrt(round);
	p[1] = w->y + w->camber * 4 * at * (1 - at) * (0.6 + 0.8 * at) * round + w->thick * s * (0.35 + 0.65 * at) * round
		- w->droop * z * z;
	p[2] = w->half_span * z;
}

static void wing(struct shape *shape, const struct wing *w, uint32_t along)
{
	shape->current = MUSLIN;
	sweep_surface(shape, wing_at, w, along, 64, 1);
}

/* ends: x, y, z of both. */
static void rod_between(struct shape *shape, uint32_t material, double radius, const double ends[6])
{
	shape->current = material;
	surface_rod(shape, ends, radius, ends + 3, radius, material == WIRES ? 8 : 16);
}
#define rod(shape, material, radius, ...) rod_between(shape, material, radius, (const double[6]){ __VA_ARGS__ })

/* Struts in two rows; wires cross each cell in front and behind, and each pair of struts from front to back. */
static void cell(struct shape *shape)
{
	double half = SPAN / 2 - 0.35, low = LOW_Y + 0.02, high = LOW_Y + GAP;

	for (int i = 0; i <= BAYS; i++) {
		double z = half * (2.0 * i / BAYS - 1), next = half * (2.0 * (i + 1) / BAYS - 1);

		for (int row = 0; row < 2; row++) {
			double x = row ? 0.8 : -0.55, sag = DROOP * (z / SPAN) * (z / SPAN) * 4;

			rod(shape, SPRUCE, STRUT, x, low - sag, z, x, high + 0.04 - sag, z);
			if (i == BAYS)
				continue;
			rod(shape, WIRES, WIRE, x + 0.006, low, z, x + 0.006, high, next);
			rod(shape, WIRES, WIRE, x - 0.006, low, next, x - 0.006, high, z);
		}
		rod(shape, WIRES, WIRE, -0.55, low, z + 0.006, 0.8, high, z + 0.006);
		rod(shape, WIRES, WIRE, -0.55, high, z - 0.006, 0.8, low, z - 0.006);
	}
}

/* The twin elevator in front and the twin rudder behind, on outriggers. */
static void tail_and_canard(struct shape *shape)
{
	static const struct wing elevators[2] = {
		{ 3.1, LOW_Y + 0.15, 0.75, 1.9, 0.012, 0.03, 0 }, { 3.1, LOW_Y + 0.95, 0.75, 1.9, 0.012, 0.03, 0 },
	};
	static const double rudder_half[3] = { 0.3, 0.95, 0.012 };

	wing(shape, &elevators[0], 96);
	wing(shape, &elevators[1], 96);
	for (int i = -2; i <= 2; i++)
		rod(shape, SPRUCE, 0.014, 3.1, LOW_Y + 0.16, 0.8 * i, 3.1, LOW_Y + 0.99, 0.8 * i);
	for (int side = -1; side <= 1; side += 2) {
		const double rudder[3] = { -3.3, LOW_Y + 0.95, 0.28 * side };

		shape->current = MUSLIN;
		sweep_block(shape, rudder, rudder_half, 0.011);
		rod(shape, SPRUCE, 0.018, -0.55, LOW_Y + 0.03, 0.28 * side, -3.3, LOW_Y + 0.5, 0.28 * side);
		rod(shape, SPRUCE, 0.018, -0.55, LOW_Y + GAP, 0.28 * side, -3.3, LOW_Y + 1.4, 0.28 * side);
		rod(shape, WIRES, WIRE, -0.55, LOW_Y + 0.03, 0.28 * side, -3.3, LOW_Y + 1.4, 0.28 * side);
		rod(shape, WIRES, WIRE, -0.55, LOW_Y + GAP, 0.28 * side, -3.3, LOW_Y + 0.5, 0.28 * side);
		rod(shape, SPRUCE, 0.018, 0.8, LOW_Y + GAP, 0.7 * side, 3, LOW_Y + 0.96, 0.7 * side);
		rod(shape, WIRES, WIRE, 0.8, LOW_Y + GAP, 1.5 * side, 3.1, LOW_Y + 0.17, 1.6 * side);
		rod(shape, WIRES, WIRE, 0.8, LOW_Y + 0.03, 1.5 * side, 3.1, LOW_Y + 0.97, 1.6 * side);
	}
	rod(shape, SPRUCE, 0.014, -3.3, LOW_Y + 1.3, -0.29, -3.3, LOW_Y + 1.3, 0.29);
	rod(shape, SPRUCE, 0.014, -3.3, LOW_Y + 0.6, -0.29, -3.3, LOW_Y + 0.6, 0.29);
}

/* Runners that curve up in front to carry the elevator. */
static void skids(struct shape *shape)
{
	for (int side = -1; side <= 1; side += 2) {
		const double runner[3][3] = { { -1.6, 0.03, 0.7 * side }, { 2.5, 0.03, 0.7 * side },
			{ 3.3, LOW_Y + 0.6, 0.7 * side } };

		shape->current = SPRUCE;
		sweep_bend(shape, runner, 0.03, 48, 16);
		rod(shape, SPRUCE, 0.018, -0.55, 0.04, 0.7 * side, -0.55, LOW_Y, 0.7 * side);
		rod(shape, SPRUCE, 0.018, 0.8, 0.09, 0.7 * side, 0.8, LOW_Y, 0.7 * side);
		rod(shape, WIRES, WIRE, -0.55, 0.04, 0.7 * side, 0.8, LOW_Y, 0.7 * side);
		rod(shape, WIRES, WIRE, 0.8, 0.09, 0.7 * side, -0.55, LOW_Y, 0.7 * side);
	}
	rod(shape, SPRUCE, 0.018, -0.55, 0.05, -0.7, -0.55, 0.05, 0.7);
	rod(shape, SPRUCE, 0.018, 0.8, 0.1, -0.7, 0.8, 0.1, 0.7);
}

/* A blade, twisted, along v from the hub; u around its section. */
static void blade_at(double u, double v, double p[3], const void *context)
{
	double c, s, pitch_c, pitch_s, width, thick, across, r = 0.04 + 1.25 * v, swell = v * (2 - v);

	(void)context;
	sweep_angle(u, &c, &s);
	sweep_angle(0.2 - 0.13 * v, &pitch_c, &pitch_s);
	width = v == 1 ? 0 : (0.035 + 0.075 * swell) * sqrt(1 - v * v * v * v * v * v);
	thick = v == 0 || v == 1 ? 0 : 0.028 - 0.02 * v;
	across = v == 0 ? 0 : width * c;
	v3d_set(p, across * pitch_s + thick * s * pitch_c, r, across * pitch_c - thick * s * pitch_s);
}

static void propellers(struct shape *shape)
{
	for (int side = -1; side <= 1; side += 2) {
		double y = LOW_Y + 0.95, z = 1.75 * side, c, s;
		const double hub[3] = { -1.15, y, z };

		sweep_angle(side > 0 ? 0.09 : -0.16, &c, &s);
		for (int end = -1; end <= 1; end += 2) {
			const double turn[3][3] = { { 1, 0, 0 }, { 0, end * c, -end * s }, { 0, end * s, end * c } };
			uint32_t first = shape->n_vertices;

			shape->current = SPRUCE;
			sweep_surface(shape, blade_at, NULL, 60, 32, 1);
			shape_move(shape, first, turn, hub);
		}
		uint32_t first = shape->n_vertices;
		shape->current = SPRUCE;
		sweep_ball(shape, (const double[3]){ 0, 0, 0 }, (const double[3]){ 0.07, 0.09, 0.09 }, 16, 24);
		shape_shift(shape, first, hub);
		rod(shape, WIRES, 0.02, -1.15, y, z, -0.3, y, z);
		for (int leg = -1; leg <= 1; leg += 2) {
			for (int way = -1; way <= 1; way += 2)
				rod(shape, SPRUCE, 0.014, -1, y + 0.01 * leg, z + 0.01 * way, -0.55, LOW_Y + (leg > 0 ? GAP : 0.03),
				    z + 0.35 * way);
			/* the chain's two runs to the engine */
			rod(shape, CHAIN, 0.012, -0.35, y + 0.09 * leg, z, -0.35, LOW_Y + 0.3 + 0.05 * leg, 0.5);
		}
	}
}

static void engine_and_pilot(struct shape *shape)
{
	static const double block[3] = { 0.05, LOW_Y + 0.3, 0.55 }, block_half[3] = { 0.38, 0.16, 0.2 };
	static const double radiator[3] = { 0.79, LOW_Y + 0.95, 0.45 }, radiator_half[3] = { 0.045, 0.6, 0.07 };
	static const double tank[2][3] = { { 0.8, LOW_Y + 1.35, 0.75 }, { 0.8, LOW_Y + 1.75, 0.75 } };
	static const double body[3] = { 0.2, LOW_Y + 0.26, -0.35 }, body_half[3] = { 0.5, 0.12, 0.2 };
	static const double head[3] = { 0.86, LOW_Y + 0.42, -0.35 }, head_half[3] = { 0.12, 0.13, 0.1 };
	static const double cradle[3] = { 0.15, LOW_Y + 0.1, -0.35 }, cradle_half[3] = { 0.3, 0.035, 0.3 };

	shape->current = ENGINE;
	sweep_block(shape, block, block_half, 0.03);
	for (int i = 0; i < 4; i++)
		rod(shape, ENGINE, 0.06, -0.2 + 0.165 * i, LOW_Y + 0.3, 0.55, -0.2 + 0.165 * i, LOW_Y + 0.33, 0.85);
	shape->current = RADIATOR;
	sweep_block(shape, radiator, radiator_half, 0.015);
	surface_rod(shape, tank[0], 0.075, tank[1], 0.075, 32);
	shape->current = SPRUCE;
	sweep_block(shape, cradle, cradle_half, 0.03);
	shape->current = SUIT;
	sweep_ball(shape, body, body_half, 32, 40);
	for (int side = -1; side <= 1; side += 2) {
		rod(shape, SUIT, 0.055, -0.1, LOW_Y + 0.24, -0.35 + 0.1 * side, -1, LOW_Y + 0.2, -0.35 + 0.13 * side);
		rod(shape, SUIT, 0.045, 0.55, LOW_Y + 0.27, -0.35 + 0.16 * side, 0.95, LOW_Y + 0.16, -0.35 + 0.2 * side);
	}
	rod(shape, PILOT, 0.06, 0.6, LOW_Y + 0.3, -0.35, 0.82, LOW_Y + 0.4, -0.35);
	shape->current = PILOT;
	sweep_ball(shape, head, head_half, 24, 32);
}

void make_kittyhawk(struct shape *shape)
{
	static const struct wing wings[2] = {
		{ 0.1, LOW_Y, CHORD, SPAN / 2, 0.025, 0.09, DROOP },
		{ 0.1, LOW_Y + GAP, CHORD, SPAN / 2, 0.025, 0.09, DROOP },
	};

	shape_materials(shape, materials, N_MATERIALS);
	wing(shape, &wings[0], 320);
	wing(shape, &wings[1], 320);
	cell(shape);
	tail_and_canard(shape);
	skids(shape);
	propellers(shape);
	engine_and_pilot(shape);
}
