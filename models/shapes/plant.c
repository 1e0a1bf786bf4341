/* A plant in a terracotta pot: bent stems, broad veined leaves as thin sheets, a few blossoms. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "image.h"
#include "base/random.h"
#include "surfaces.h"
#include "sweep.h"

#define SOIL 0.5
#define STEMS 13
#define LEAVES 5 /* a stem */
#define BLOSSOMS 4

enum { POT, EARTH, STEM, LEAF, PETAL, HEART, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[POT] = { "terracotta", 0xb9623c, 0, 0.85, 0 },
	[EARTH] = { "earth", 0x3d2b1f, 0, 0.95, 0 },
	[STEM] = { "stem", 0x5f8a3a, 0, 0.7, 0 },
	[LEAF] = { "leaf", 0xffffff, 0, 0.5, 1 },
	[PETAL] = { "petal", 0xe2577f, 0, 0.6, 1 },
	[HEART] = { "stamens", 0xf0c33c, 0, 0.7, 0 },
};

static void pot(struct shape *shape)
{
	const struct surface_profile pieces[] = {
		surface_line(0, 0, 0.3, 0, 2, POT),
		surface_line(0.3, 0, 0.4, 0.45, 8, POT),
		surface_line(0.4, 0.45, 0.44, 0.455, 1, POT),
		{ { { 0.44, 0.455 }, { 0.455, 0.47 }, { 0.46, 0.58 }, { 0.45, 0.6 } }, 0, 1, 10, POT },
		{ { { 0.45, 0.6 }, { 0.44, 0.615 }, { 0.41, 0.615 }, { 0.4, 0.6 } }, 0, 1, 8, POT },
		surface_line(0.4, 0.6, 0.385, SOIL, 2, POT),
		{ { { 0.385, SOIL }, { 0.25, 0.53 }, { 0.1, 0.55 }, { 0, 0.55 } }, 0, 1, 10, EARTH },
	};

	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], 128);
}

/* A leaf of length 1 along +x, its upper side up, folded along its midrib and bent down towards its tip. */
static void leaf_at(double u, double v, double p[3], const void *context)
{
	const double *form = context; /* width, droop, wave */
	double side = 2 * u - 1, width = form[0] * sqrt(v) * (1 - v) * (1 + 0.6 * v) * 1.55, c, s;

	sweep_angle(2.5 * v, &c, &s);
	v3d_set(p, v * (1 - 0.15 * form[1] * v), 0.28 * fabs(side) * width - form[1] * v * v
	        + form[2] * s * side * side * (1 - v), side * width);
}

static void leaf_parts(struct shape *shape, uint32_t part[3])
{
	static const double form[3][3] = { { 0.34, 0.25, 0.015 }, { 0.4, 0.45, 0.03 }, { 0.28, 0.1, 0.01 } };

	shape->current = LEAF;
	for (int i = 0; i < 3; i++) {
		part[i] = shape_part(shape);
		sweep_surface(shape, leaf_at, form[i], 28, 16, 0);
	}
	shape->current_part = 0;
}

static void petal_at(double u, double v, double p[3], const void *context)
{
	double side = 2 * u - 1, width = 0.36 * sqrt(v) * (1.25 - v * v * 0.95);

	(void)context;
	v3d_set(p, v, 0.35 * v - 0.3 * v * v + 0.2 * side * side * width, side * width);
}

/* Five petals around +y and a heart of stamens; petals reach to 1. */
static uint32_t blossom_part(struct shape *shape)
{
	static const double zero[3] = { 0, 0, 0 }, heart[3] = { 0, 0.08, 0 }, half[3] = { 0.17, 0.14, 0.17 };
	uint32_t part = shape_part(shape);
	double c, s;

	for (uint32_t i = 0; i < 5; i++) {
		uint32_t first = shape->n_vertices;

		surface_turn(i, 5, &c, &s);
		const double turn[3][3] = { { c, 0, s }, { 0, 1, 0 }, { -s, 0, c } };
		shape->current = PETAL;
		sweep_surface(shape, petal_at, NULL, 12, 10, 0);
		shape_move(shape, first, turn, zero);
	}
	shape->current = HEART;
	sweep_ball(shape, heart, half, 14, 20);
	shape->current_part = 0;
	return part;
}

/* Places a part of length 1 along +x so that it points along `out` (unit) with `up` towards the sky. */
static void place(struct shape *shape, uint32_t part, const double at[3], const double out[3], double size)
{
	static const double sky[3] = { 0, 1, 0 };
	double side[3], up[3], m[3][3];

	v3d_cross(side, out, sky);
	v3d_normalize(side, side);
	v3d_cross(up, side, out);
	for (int k = 0; k < 3; k++)
		v3d_set(m[k], out[k] * size, up[k] * size, side[k] * size);
	shape_place(shape, part, m, at);
}

static void stem(struct shape *shape, uint32_t number, const uint32_t leaf[3], uint32_t blossom, uint64_t *random)
{
	double c, s, path[21][3], radius[21], reach = random_in(random, 0.15, 0.75), height = random_in(random, 0.75, 1.45);
	double turn = number * 0.38196601125 + random_in(random, -0.03, 0.03);

	height -= 0.45 * reach;
	sweep_angle(turn, &c, &s);
	for (int i = 0; i <= 20; i++) {
		double t = i / 20.0;

		v3d_set(path[i], (0.08 + reach * t * t) * c, SOIL + height * t * (1 - 0.25 * t * reach),
		        -(0.08 + reach * t * t) * s);
		radius[i] = 0.014 * (1 - 0.75 * t);
	}
	shape->current = STEM;
	sweep_tube(shape, (const double (*)[3])path, radius, 21, 12);
	for (int i = 0; i < LEAVES; i++) {
		int at = 20 - i * 3;
		double out[3], leaf_turn = turn + (i == 0 ? 0 : 0.38196601125 * i + random_in(random, -0.05, 0.05));
		double rise = i == 0 ? 0.25 : random_in(random, -0.1, 0.3);

		sweep_angle(leaf_turn, &c, &s);
		v3d_set(out, c, rise, -s);
		v3d_normalize(out, out);
		uint32_t kind = (uint32_t)(random_next(random) % 3);
		place(shape, leaf[kind], path[at], out, random_in(random, 0.3, 0.46) * (1 - 0.05 * i));
	}
	if (number < BLOSSOMS) {
		const double x = path[20][0], y = path[20][1], z = path[20][2];
		const double stalk[3][3] = { { x, y, z }, { x, y + 0.12, z }, { x, y + 0.24, z } };
		const double tilt[3] = { 0.95, random_in(random, -0.3, 0.3), 0.1 };
		double out[3];

		v3d_normalize(out, tilt);
		sweep_bend(shape, stalk, 0.006, 12, 8);
		place(shape, blossom, stalk[2], out, 0.13);
	}
}

void make_plant(struct shape *shape)
{
	uint32_t leaf[3], blossom;
	uint64_t random = 1903;

	shape_materials(shape, materials, N_MATERIALS);
	shape_image(shape, LEAF, 128, image_leaf(128, 0x3f7d33, 0xa9c46c));
	pot(shape);
	leaf_parts(shape, leaf);
	blossom = blossom_part(shape);
	for (uint32_t i = 0; i < STEMS; i++)
		stem(shape, i, leaf, blossom, &random);
}
