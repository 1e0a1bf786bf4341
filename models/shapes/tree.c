/* A broad-leaved tree of exactly 26,438 cones and ellipsoids, as many as the thesis's had ([G] 8): every branch is a
 * cone, every leaf an ellipsoid. */
#include "generators.h"

#include "base/vec.h"
#include "base/random.h"
#include "sweep.h"

#define PRIMITIVES 26438 /* the trunk's roots and the mound included */
#define DEPTH 6
#define GOLDEN 0.38196601125 /* of a turn */

enum { BARK, TWIG, LEAF, LEAF_LIGHT, LEAF_YELLOW, GRASS, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[BARK] = { "bark", 0x6d5038, 0, 0.95, 0 },
	[TWIG] = { "twig", 0x80643f, 0, 0.9, 0 },
	[LEAF] = { "leaf", 0x3c7a2c, 0, 0.6, 0 },
	[LEAF_LIGHT] = { "young leaf", 0x6da53b, 0, 0.6, 0 },
	[LEAF_YELLOW] = { "yellow leaf", 0xc9a832, 0, 0.6, 0 },
	[GRASS] = { "grass", 0x5d7d35, 0, 0.95, 0 },
};

/* The twigs, which carry the leaves once all branches are there. */
struct grower {
	struct shape *shape;
	uint32_t thick, thin, leaf[3];
	uint64_t random;
	uint32_t n_twigs, room;
	double (*twig)[2][3];
};

static void place_cone(struct shape *shape, uint32_t part, const double a[3], const double b[3], double radius)
{
	double axis[3], turn[3][3], length;

	v3d_sub(axis, b, a);
	length = v3d_normalize(axis, axis);
	sweep_frame(axis, turn);
	for (int k = 0; k < 3; k++)
		v3d_set(turn[k], turn[k][0] * radius, turn[k][1] * length, turn[k][2] * radius);
	shape_place(shape, part, turn, a);
}

/* A direction that leaves `axis` at an angle whose tangent is `spread`, `turns` around it. */
static void leave(double out[3], const double axis[3], double spread, double turns)
{
	double frame[3][3], local[3], c, s;

	sweep_angle(turns, &c, &s);
	v3d_set(local, spread * c, 1, spread * s);
	sweep_frame(axis, frame);
	m3d_apply(out, frame, local);
	v3d_normalize(out, out);
}

#define MAX_TWIGS 8192

static void grow(struct grower *g, const double a[3], const double axis[3], double length, double radius, int depth)
{
	double b[3], turns = random_in(&g->random, 0, 1);
	int n = depth == 0 ? 9 : depth < 3 ? 5 : 4;

	v3d_add_scaled(b, a, length, axis);
	place_cone(g->shape, depth < 3 ? g->thick : g->thin, a, b, radius);
	if (depth >= DEPTH - 2 && g->n_twigs < MAX_TWIGS) {
		for (int k = 0; k < 3; k++) {
			g->twig[g->n_twigs][0][k] = a[k];
			g->twig[g->n_twigs][1][k] = b[k];
		}
		g->n_twigs++;
	}
	if (depth == DEPTH - 1)
		return;
	for (int i = 0; i < n; i++) {
		double at = depth == 0 ? 0.28 + 0.6 * i / (n - 1) : 0.3 + 0.62 * i / (n - 1), from[3], out[3], size;
		double spread = random_in(&g->random, 0.6, 1.1) * (1.25 - 0.6 * at);

		v3d_add_scaled(from, a, at * length, axis);
		leave(out, axis, spread, turns + GOLDEN * i);
		/* towards the light */
		out[1] += depth == 0 ? 0.12 : 0.18;
		v3d_normalize(out, out);
		size = length * random_in(&g->random, 0.5, 0.64) * (depth == 0 ? 0.95 - 0.35 * at : 1.12 - 0.4 * at);
		grow(g, from, out, size, radius * (1 - at) * 0.75 + 0.0015, depth + 1);
	}
}

/* A leaf at a random place along a twig, its longer axis outwards, lying rather flat. */
static void place_leaf(struct grower *g)
{
	static const double sky[3] = { 0, 1, 0 };
	const double (*twig)[3] = (const double (*)[3])g->twig[random_next(&g->random) % g->n_twigs];
	uint64_t kind = random_next(&g->random) % 16;
	double t = random_in(&g->random, 0.25, 1.05), c, s, out[3], side[3], up[3], m[3][3], at[3];
	double size = random_in(&g->random, 0.062, 0.1);

	sweep_angle(random_in(&g->random, 0, 1), &c, &s);
	v3d_set(out, c, random_in(&g->random, -0.7, 0.3), s);
	v3d_normalize(out, out);
	v3d_cross(side, out, sky);
	v3d_normalize(side, side);
	v3d_cross(up, side, out);
	for (int k = 0; k < 3; k++) {
		v3d_set(m[k], out[k] * size, up[k] * size * 0.1, side[k] * size * 0.5);
		at[k] = twig[0][k] + (twig[1][k] - twig[0][k]) * t + out[k] * size;
	}
	shape_place(g->shape, g->leaf[kind == 0 ? 2 : kind < 6], m, at);
}

void make_tree(struct shape *shape)
{
	static const double origin[3] = { 0, 0, 0 }, unit[3] = { 1, 1, 1 }, up[3] = { 0, 1, 0 };
	static const double mound[3] = { 0, 0.02, 0 }, mound_half[3] = { 1.3, 0.14, 1.3 };
	static double twigs[MAX_TWIGS][2][3];
	struct grower g = { .shape = shape, .random = 26438, .twig = twigs };

	shape_materials(shape, materials, N_MATERIALS);
	shape->current = GRASS;
	sweep_ball(shape, mound, mound_half, 24, 64);
	shape->current = BARK;
	g.thick = shape_part(shape);
	sweep_cone(shape, origin, 1, up, 24);
	shape->current = TWIG;
	g.thin = shape_part(shape);
	sweep_cone(shape, origin, 1, up, 7);
	for (int i = 0; i < 3; i++) {
		shape->current = LEAF + (uint32_t)i;
		g.leaf[i] = shape_part(shape);
		sweep_ball(shape, origin, unit, 4, 6);
	}
	for (int i = 0; i < 6; i++) {
		double c, s;

		sweep_angle((i + 0.3) / 6, &c, &s);
		const double root[3] = { 0.06 * c, 0.5, 0.06 * s }, end[3] = { 0.75 * c, 0.03, 0.75 * s };
		place_cone(shape, g.thick, root, end, 0.13);
	}
	grow(&g, origin, up, 5.2, 0.24, 0);
	/* the mound is the first primitive */
	while (shape->n_instances + 1 < PRIMITIVES && !shape->failed)
		place_leaf(&g);
}
