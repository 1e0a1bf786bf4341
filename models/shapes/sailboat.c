/* A small sloop under sail: hull with bands of colour, planked deck, mast, boom, two sails, stays and shrouds. The bow
 * points along +x. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "image.h"
#include "surfaces.h"
#include "sweep.h"

#define LENGTH 6.0
#define BEAM 2.1
#define MAST_X 0.55
#define MAST_TOP 8.0
#define WIRE 0.013
#define ALONG 120
#define ACROSS 64

enum { ANTIFOULING, WHITE, STRIPE, DECK, WOOD, SAIL, TRIM, WIRES, GLASS, FLAG, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[ANTIFOULING] = { "antifouling", 0x8c2f26, 0, 0.7, 0 },
	[WHITE] = { "white gelcoat", 0xf1efe9, 0, 0.3, 0 },
	[STRIPE] = { "blue stripe", 0x1f3f73, 0, 0.3, 0 },
	[DECK] = { "teak deck", 0xffffff, 0, 0.8, 0 },
	[WOOD] = { "varnished spruce", 0xc08a4a, 0, 0.35, 0 },
	[SAIL] = { "sailcloth", 0xf5f1e6, 0, 0.9, 1 },
	[TRIM] = { "red sailcloth", 0xb9352c, 0, 0.9, 1 },
	[WIRES] = { "stainless wire", 0xb8bcc2, 0.5, 0.3, 0 },
	[GLASS] = { "window", 0x2a3440, 0, 0.1, 0 },
	[FLAG] = { "pennant", 0xe0a92e, 0, 0.9, 1 },
};

/* At v from stern (0) to stem (1): where the frame stands, half its beam, its sheer and its keel. */
static void frame_at(double v, double *x, double *half, double *sheer, double *keel)
{
	double fore = v == 1 ? 1 : v > 0.42 ? (v - 0.42) / 0.58 : 0, aft = v < 0.42 ? (0.42 - v) / 0.42 : 0;

	*half = BEAM / 2 * (1 - 0.98 * fore * fore) * (1 - 0.28 * aft * aft);
	*sheer = 0.62 + 0.3 * fore * fore + 0.1 * aft * aft;
	*keel = -0.4 + 1.02 * fore * fore * fore + 0.42 * aft * aft;
	*x = LENGTH * (v - 0.5);
}

/* u goes from the starboard gunwale by the keel to the port one. */
static void hull_at(double u, double v, double p[3])
{
	double x, half, sheer, keel, c, s, side;

	frame_at(v, &x, &half, &sheer, &keel);
	sweep_angle(u / 2, &c, &s);
	/* a full bilge: between an ellipse and a box; the stem rakes forward */
	side = c * (1.25 - 0.25 * c * c);
	v3d_set(p, x + 0.45 * v * v * v * (1 - s) * (1 - s), keel + (sheer - keel) * (1 - s * (1.3 - 0.3 * s * s)),
	        half * side);
}

/* The deck's line across, cambered; its ends are the hull's to the last bit. */
static void deck_at(uint32_t j, double v, double p[3])
{
	double port[3], starboard[3], t = (double)j / ACROSS;

	hull_at(0, v, starboard);
	hull_at(1, v, port);
	v3d_set(p, starboard[0], starboard[1] + 0.05 * 4 * t * (1 - t) * starboard[2],
	        starboard[2] + (port[2] - starboard[2]) * t);
	if (j == ACROSS)
		v3d_set(p, port[0], port[1], port[2]);
}

static void hull(struct shape *shape)
{
	static struct shape_vertex grid[(ALONG + 1) * (ACROSS + 1)], deck[(ALONG + 1) * (ACROSS + 1)];
	static const struct sweep_grid all = { grid, ALONG + 1, ACROSS + 1, 0 };
	struct shape_vertex transom[2 * (ACROSS + 1)], stem[2 * (ACROSS + 1)];
	static const struct {
		uint32_t last, material;
	} bands[] = { { 2, WHITE }, { 4, STRIPE }, { 11, WHITE }, { 53, ANTIFOULING }, { 60, WHITE }, { 62, STRIPE },
	              { ACROSS, WHITE } };
	static const double u[4] = { 0, 0, 0.9, 0 }, v[4] = { 0.5, 0, 0, 0 };
	uint32_t first = 0, deck_first;

	for (uint32_t i = 0; i < (ALONG + 1) * (ACROSS + 1); i++) {
		uint32_t j = i % (ACROSS + 1);
		double along = (double)(i / (ACROSS + 1)) / ALONG;

		hull_at((double)j / ACROSS, along, grid[i].p);
		/* the deck's rows run the other way, so that its outside is up */
		deck_at(ACROSS - j, along, deck[i].p);
	}
	for (uint32_t j = 0; j <= ACROSS; j++) {
		for (int k = 0; k < 3; k++) {
			transom[j].p[k] = deck[ACROSS - j].p[k];
			transom[ACROSS + 1 + j].p[k] = grid[j].p[k];
			stem[j].p[k] = grid[ALONG * (ACROSS + 1) + j].p[k];
			stem[ACROSS + 1 + j].p[k] = deck[ALONG * (ACROSS + 1) + ACROSS - j].p[k];
		}
		for (uint32_t row = 0; row < 2; row++) {
			v3d_set(transom[row * (ACROSS + 1) + j].n, -1, 0, 0);
			v3d_set(stem[row * (ACROSS + 1) + j].n, 1, 0, 0);
		}
	}
	sweep_normals(grid, ALONG + 1, ACROSS + 1, 0, 0);
	sweep_normals(deck, ALONG + 1, ACROSS + 1, 0, 0);
	for (uint32_t band = 0; band < sizeof bands / sizeof bands[0]; band++) {
		shape->current = bands[band].material;
		sweep_band(shape, &all, first, bands[band].last);
		first = bands[band].last;
	}
	shape->current = DECK;
	deck_first = shape->n_vertices;
	shape_grid(shape, deck, ALONG + 1, ACROSS + 1, 0, 0);
	shape_map(shape, deck_first, u, v);
	shape->current = WOOD;
	shape_grid(shape, transom, 2, ACROSS + 1, 0, 0);
	shape_grid(shape, stem, 2, ACROSS + 1, 0, 0);
}

static void fittings(struct shape *shape)
{
	static const double cabin[3] = { 0.35, 0.82, 0 }, cabin_half[3] = { 0.95, 0.22, 0.55 };
	static const double keel[3] = { 0.1, -0.75, 0 }, keel_half[3] = { 0.75, 0.75, 0.07 };
	static const double rudder[3] = { -3.02, -0.1, 0 }, rudder_half[3] = { 0.2, 0.62, 0.035 };
	static const double bench[3] = { -1.75, 0.7, 0 }, bench_half[3] = { 0.55, 0.07, 0.42 };
	static const double tiller[3][3] = { { -3, 0.62, 0 }, { -2.6, 1, 0 }, { -2, 0.95, 0.1 } };

	shape->current = WHITE;
	sweep_block(shape, cabin, cabin_half, 0.12);
	shape->current = ANTIFOULING;
	sweep_ball(shape, keel, keel_half, 40, 64);
	shape->current = WOOD;
	sweep_block(shape, rudder, rudder_half, 0.03);
	sweep_block(shape, bench, bench_half, 0.03);
	sweep_bend(shape, tiller, 0.03, 16, 16);
	shape->current = GLASS;
	for (int i = 0; i < 6; i++) {
		const double at[3] = { -0.15 + 0.45 * (i % 3), 0.88, i < 3 ? 0.545 : -0.545 }, half[3] = { 0.13, 0.07, 0.045 };

		sweep_block(shape, at, half, 0.03);
	}
}

static void spars(struct shape *shape)
{
	static const double foot[3] = { MAST_X, 0.6, 0 }, top[3] = { MAST_X - 0.1, MAST_TOP, 0 };
	static const double gooseneck[3] = { MAST_X, 1.45, 0 }, boom_end[3] = { -2.75, 1.6, 0.5 };
	static const double wires[][2][3] = {
		{ { 3.42, 0.92, 0 }, { MAST_X - 0.08, 7.2, 0 } }, { { -2.95, 0.72, 0 }, { MAST_X - 0.1, MAST_TOP - 0.05, 0 } },
		{ { 0.35, 0.66, 0.99 }, { MAST_X - 0.06, 5, 0.55 } }, { { 0.35, 0.66, -0.99 }, { MAST_X - 0.06, 5, -0.55 } },
		{ { MAST_X - 0.06, 5, 0.55 }, { MAST_X - 0.1, MAST_TOP - 0.1, 0 } },
		{ { MAST_X - 0.06, 5, -0.55 }, { MAST_X - 0.1, MAST_TOP - 0.1, 0 } },
		{ { -2.5, 1.58, 0.46 }, { -2.3, 0.75, 0 } },
	};
	static const double spreader[2][3] = { { MAST_X - 0.06, 5, -0.55 }, { MAST_X - 0.06, 5, 0.55 } };

	shape->current = WOOD;
	surface_rod(shape, foot, 0.075, top, 0.04, 32);
	surface_rod(shape, gooseneck, 0.05, boom_end, 0.045, 24);
	surface_rod(shape, spreader[0], 0.022, spreader[1], 0.022, 16);
	shape->current = WIRES;
	for (size_t i = 0; i < sizeof wires / sizeof wires[0]; i++)
		surface_rod(shape, wires[i][0], WIRE, wires[i][1], WIRE, 10);
}

/* A triangle tack - clew - head that the wind fills towards its lee. */
struct sail {
	double tack[3], clew[3], head[3], roach, belly;
};

static void sail_at(double u, double v, double p[3], const void *context)
{
	const struct sail *sail = context;
	/* the head is cut off narrow, as a headboard does */
	double width = 1 - 0.97 * v, across = u * width, fill = sail->belly * 4 * u * (1 - u) * (1 - v) * (0.35 + v) * 1.6;

	for (int k = 0; k < 3; k++)
		p[k] = sail->tack[k] + (sail->clew[k] - sail->tack[k]) * across + (sail->head[k] - sail->tack[k]) * v;
	p[0] -= sail->roach * 4 * v * (1 - v) * u;
	p[2] += fill;
}

struct strip {
	const struct sail *sail;
	double from, to;
};

static void strip_at(double u, double v, double p[3], const void *context)
{
	const struct strip *strip = context;

	sail_at(u, strip->from + (strip->to - strip->from) * v, p, strip->sail);
}

static void flag_at(double u, double v, double p[3], const void *context)
{
	double c, s;

	(void)context;
	sweep_angle(1.2 * u, &c, &s);
	v3d_set(p, MAST_X - 0.14 - 0.9 * u, MAST_TOP - 0.03 - 0.13 * u - (0.28 - 0.26 * u) * (1 - v),
	        0.09 * s * u + 0.25 * u);
}

static void sails(struct shape *shape)
{
	static const struct sail main = { { MAST_X - 0.1, 1.6, 0.02 }, { -2.65, 1.72, 0.5 }, { MAST_X - 0.16, 7.8, 0.01 },
		0.3, 0.55 };
	static const struct sail jib = { { 3.3, 1.1, 0 }, { 0.25, 1.35, 0.75 }, { MAST_X + 0.0, 6.95, 0 }, -0.12, 0.55 };
	static const double cut[] = { 0, 0.42, 0.5, 0.56, 0.6, 1 };

	for (int i = 0; i < 5; i++) {
		const struct strip strip = { &main, cut[i], cut[i + 1] };

		shape->current = i & 1 ? TRIM : SAIL;
		sweep_surface(shape, strip_at, &strip, (uint32_t)(100 * (strip.to - strip.from)), 48, 0);
	}
	shape->current = SAIL;
	sweep_surface(shape, sail_at, &jib, 80, 40, 0);
	shape->current = FLAG;
	sweep_surface(shape, flag_at, NULL, 8, 32, 0);
}

void make_sailboat(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	shape_image(shape, DECK, 128, image_planks(128, 0xc79a63, 0x3c2a1c, 4));
	hull(shape);
	fittings(shape);
	spars(shape);
	sails(shape);
}
