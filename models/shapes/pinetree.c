/* A pine: a trunk, whorls of drooping branches, and on them twigs whose every needle is there. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "base/random.h"
#include "surfaces.h"
#include "sweep.h"

#define HEIGHT 6.0
#define WHORLS 21
#define NEEDLES 44     /* a twig */
#define NEEDLE 0.014   /* half its thickness, for a twig of length 1 */

enum { BARK, TWIG, NEEDLES_OLD, NEEDLES_NEW, CONE, EARTH, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[BARK] = { "bark", 0x6b4630, 0, 0.95, 0 },
	[TWIG] = { "twig", 0x7d5a35, 0, 0.9, 0 },
	[NEEDLES_OLD] = { "old needles", 0x1f5a35, 0, 0.6, 0 },
	[NEEDLES_NEW] = { "new needles", 0x4f8f3f, 0, 0.6, 0 },
	[CONE] = { "cone", 0x8a5a2c, 0, 0.8, 0 },
	[EARTH] = { "mound", 0x57683a, 0, 0.95, 0 },
};

/* A twig of length 1 along +y with needles all around, which point outwards and forwards. */
static uint32_t twig_part(struct shape *shape, uint64_t seed, uint32_t needles)
{
	static const double root[3] = { 0, 0, 0 }, tip[3] = { 0, 1, 0 };
	uint32_t part = shape_part(shape);
	uint64_t random = seed;

	shape->current = TWIG;
	sweep_cone(shape, root, 0.022, tip, 6);
	shape->current = needles;
	for (int i = 0; i < NEEDLES; i++) {
		double at = 0.06 + 0.92 * i / (NEEDLES - 1), c, s, length = random_in(&random, 0.26, 0.36) * (1.15 - 0.5 * at);
		double lean = random_in(&random, 0.55, 0.85) + 0.5 * at;

		sweep_angle(0.38196601125 * i + random_in(&random, -0.04, 0.04), &c, &s);
		const double foot[3] = { 0.008 * c, at, -0.008 * s };
		const double point[3] = { foot[0] + length * c, at + length * lean, foot[2] - length * s };
		sweep_cone(shape, foot, NEEDLE, point, 3);
	}
	shape->current_part = 0;
	return part;
}

static uint32_t cone_part(struct shape *shape)
{
	uint32_t part = shape_part(shape);
	const struct surface_profile pieces[] = {
		{ { { 0, -0.2 }, { 0.025, -0.2 }, { 0.05, -0.17 }, { 0.05, -0.12 } }, 0, 1, 8, CONE },
		{ { { 0.05, -0.12 }, { 0.05, -0.06 }, { 0.02, 0 }, { 0, 0 } }, 0, 1, 10, CONE },
	};

	surface_lathe(shape, pieces, 2, 20);
	shape->current_part = 0;
	return part;
}

/* A twig at `at` that points along `out`, any length. */
static void place_twig(struct shape *shape, uint32_t part, const double at[3], const double out[3], double length)
{
	double axis[3], turn[3][3];

	v3d_normalize(axis, out);
	sweep_frame(axis, turn);
	for (int k = 0; k < 3; k++)
		v3d_scale(turn[k], turn[k], length);
	shape_place(shape, part, turn, at);
}

/* The twigs and the cone that branches carry. */
struct parts {
	uint32_t twig[2], cone;
};

static void branch(struct shape *shape, double height, double length, double turn, const struct parts *parts,
                   uint64_t *random)
{
	double c, s, path[13][3], radius[13], rise = 0.1 + 0.3 * height / HEIGHT;
	int n = 2 + (int)(length * 8);

	sweep_angle(turn, &c, &s);
	for (int i = 0; i <= 12; i++) {
		double t = i / 12.0, sag = rise * t - 0.42 * t * t + 0.2 * t * t * t * t;

		v3d_set(path[i], length * t * c, height + length * sag, -length * t * s);
		radius[i] = (0.009 + 0.016 * length) * (1 - t);
	}
	shape->current = BARK;
	sweep_tube(shape, (const double (*)[3])path, radius, 13, 8);
	for (int i = 0; i < n; i++) {
		double t = 0.16 + 0.84 * i / (n - 1), x = t * 11.999, rest = x - floor(x), at[3], out[3];
		int k = (int)x, side = i & 1 ? 1 : -1;
		double spread = i == n - 1 ? 0 : random_in(random, 0.6, 1.0) * side,
			size = random_in(random, 0.3, 0.42) * (1.1 - 0.35 * t);

		size *= 0.3 + 0.7 * (length < 0.8 ? length / 0.8 : 1);
		for (int j = 0; j < 3; j++)
			at[j] = path[k][j] + (path[k + 1][j] - path[k][j]) * rest;
		v3d_set(out, c - spread * s, random_in(random, -0.1, 0.25), -s - spread * c);
		place_twig(shape, parts->twig[t > 0.8], at, out, size);
		if (i == n / 2 && random_next(random) % 3 == 0)
			shape_place(shape, parts->cone, shape_straight, at);
	}
}

void make_pinetree(struct shape *shape)
{
	static const double mound[3] = { 0, 0, 0 }, mound_half[3] = { 0.55, 0.12, 0.55 };
	struct parts parts;
	uint64_t random = 77;
	double path[25][3], radius[25];

	shape_materials(shape, materials, N_MATERIALS);
	shape->current = EARTH;
	sweep_ball(shape, mound, mound_half, 20, 48);
	for (int i = 0; i <= 24; i++) {
		double t = i / 24.0;

		v3d_set(path[i], 0.03 * (1 - t) * t * 4 - 0.02 * t * t, HEIGHT * t, 0.02 * t * (1 - t));
		radius[i] = 0.13 * (1 - t) + 0.06 * (1 - t) * (1 - t) * (1 - t) * (1 - t) * (1 - t) * (1 - t);
	}
	shape->current = BARK;
	sweep_tube(shape, (const double (*)[3])path, radius, 25, 24);
	parts.twig[0] = twig_part(shape, 1, NEEDLES_OLD);
	parts.twig[1] = twig_part(shape, 2, NEEDLES_NEW);
	parts.cone = cone_part(shape);
	for (int i = 0; i < WHORLS; i++) {
		double t = (double)i / WHORLS, height = 0.75 + (HEIGHT - 0.95) * t,
			length = 1.85 * (1 - t) * (1 - 0.15 * t) + 0.06;
		int n = 7 - (int)(2.5 * t);
		double start = random_in(&random, 0, 1);

		for (int j = 0; j < n; j++) {
			double reach = length * random_in(&random, 0.85, 1.1), off = random_in(&random, -0.03, 0.03);

			branch(shape, height + random_in(&random, -0.06, 0.06), reach, start + (double)j / n + off, &parts,
			       &random);
		}
	}
	const double top[3] = { -0.02, HEIGHT - 0.25, 0 }, up[3] = { 0, 1, 0 };
	place_twig(shape, parts.twig[1], top, up, 0.3);
}
