/* A pull-along wooden bird on wheels, with its string. It looks along +x. */
#include "generators.h"

#include "base/vec.h"
#include "surfaces.h"
#include "sweep.h"

enum { BODY, BELLY, WING, BEAK, COMB, EYE, PUPIL, BASE, WHEEL, HUB, STRING, BEAD, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[BODY] = { "blue lacquer", 0x2b7fb8, 0, 0.25, 0 },
	[BELLY] = { "cream lacquer", 0xf3e3bd, 0, 0.3, 0 },
	[WING] = { "green lacquer", 0x3b9a5b, 0, 0.3, 0 },
	[BEAK] = { "orange lacquer", 0xe8862a, 0, 0.25, 0 },
	[COMB] = { "red lacquer", 0xc93a2b, 0, 0.25, 0 },
	[EYE] = { "white", 0xf7f4ec, 0, 0.2, 0 },
	[PUPIL] = { "black", 0x1d1d20, 0, 0.15, 0 },
	[BASE] = { "beech", 0xd9ae76, 0, 0.6, 0 },
	[WHEEL] = { "yellow lacquer", 0xf0bd2c, 0, 0.3, 0 },
	[HUB] = { "hub", 0x8d5a2e, 0, 0.5, 0 },
	[STRING] = { "string", 0xc9b99a, 0, 0.95, 0 },
	[BEAD] = { "bead", 0xb7322c, 0, 0.2, 0 },
};

#define ROWS 80
#define COLS 96

/* The body's axis rises from tail to breast; its section is an egg. Row 0 is the tail's end. */
static void body_at(double u, double v, double p[3])
{
	double c, s, along_c, along_s, r, rise;

	sweep_angle(u, &c, &s);
	sweep_angle(v / 2, &along_c, &along_s);
	r = 0.46 * along_s * (1 - 0.28 * along_c);
	rise = 0.1 - 0.16 * along_c * along_c;
	v3d_set(p, -0.78 * along_c, 1.02 + rise + r * (s > 0 ? 0.95 : 1.05) * s, -r * 0.9 * c);
}

static void body(struct shape *shape)
{
	static struct shape_vertex grid[(ROWS + 1) * COLS];
	static const struct sweep_grid all = { grid, ROWS + 1, COLS, 0 };

	for (uint32_t i = 0; i < (ROWS + 1) * COLS; i++)
		body_at((double)(i % COLS) / COLS, (double)(i / COLS) / ROWS, grid[i].p);
	for (uint32_t j = 0; j < COLS; j++) {
		body_at(0, 0, grid[j].p);
		body_at(0, 1, grid[ROWS * COLS + j].p);
	}
	sweep_normals(grid, ROWS + 1, COLS, 0, 1);
	/* half a turn is the upper side; the belly is a third of the girth */
	shape->current = BODY;
	sweep_band(shape, &all, 0, COLS * 7 / 12);
	sweep_band(shape, &all, COLS * 11 / 12, COLS);
	shape->current = BELLY;
	sweep_band(shape, &all, COLS * 7 / 12, COLS * 11 / 12);
}

static void head(struct shape *shape)
{
	static const double center[3] = { 0.62, 1.62, 0 }, half[3] = { 0.33, 0.31, 0.3 };
	static const double beak[3] = { 0.86, 1.6, 0 }, tip[3] = { 1.32, 1.5, 0 };
	static const double neck[2][3] = { { 0.4, 1.15, 0 }, { 0.58, 1.5, 0 } };

	shape->current = BODY;
	sweep_ball(shape, center, half, 48, 64);
	surface_rod(shape, neck[0], 0.27, neck[1], 0.22, 48);
	shape->current = BEAK;
	sweep_cone(shape, beak, 0.12, tip, 48);
	shape->current = COMB;
	for (int i = 0; i < 3; i++) {
		const double at[3] = { 0.74 - 0.14 * i, 1.95 - 0.04 * i * i + 0.02 * i, 0 },
			size[3] = { 0.085, 0.12 - 0.012 * i, 0.05 };

		sweep_ball(shape, at, size, 20, 28);
	}
	for (int side = -1; side <= 1; side += 2) {
		const double eye[3] = { 0.76, 1.71, side * 0.225 }, pupil[3] = { 0.785, 1.72, side * 0.272 };
		static const double eye_half[3] = { 0.085, 0.085, 0.06 }, pupil_half[3] = { 0.045, 0.045, 0.055 };

		shape->current = EYE;
		sweep_ball(shape, eye, eye_half, 20, 28);
		shape->current = PUPIL;
		sweep_ball(shape, pupil, pupil_half, 14, 20);
	}
}

/* Wings and tail are flat ellipsoids, fanned out. */
static void feathers(struct shape *shape)
{
	for (int side = -1; side <= 1; side += 2) {
		for (int i = 0; i < 3; i++) {
			static const double origin[3] = { 0, 0, 0 };
			const double half[3] = { 0.15, 0.4 - 0.07 * i, 0.05 },
				at[3] = { 0.28 - 0.1 * i, 1.22 - 0.1 * i, side * (0.41 - 0.02 * i) };
			const double from[3] = { at[0], at[1], at[2] };
			const double to[3] = { at[0] - 0.9, at[1] + 0.32 - 0.16 * i, at[2] + side * 0.12 };
			uint32_t first = shape->n_vertices;
			double low[3] = { 0, half[1] * 0.8, 0 };

			shape->current = i == 1 ? COMB : WING;
			sweep_ball(shape, origin, half, 32, 40);
			shape_shift(shape, first, low);
			sweep_along(shape, first, from, to);
		}
	}
	for (int i = -1; i <= 1; i++) {
		static const double half[3] = { 0.035, 0.38, 0.1 }, low[3] = { 0, 0.3, 0 };
		const double from[3] = { -0.62, 1.04, 0.03 * i }, to[3] = { -1.3, 1.35 + 0.1 * (i == 0), 0.28 * i };
		uint32_t first = shape->n_vertices;

		shape->current = i == 0 ? WING : BODY;
		sweep_ball(shape, low, half, 32, 40);
		sweep_along(shape, first, from, to);
	}
}

static void cart(struct shape *shape)
{
	static const double center[3] = { 0, 0.3, 0 }, half[3] = { 0.85, 0.06, 0.36 };
	const struct surface_profile wheel[] = {
		surface_line(0, -0.05, 0.07, -0.05, 1, HUB),
		surface_line(0.07, -0.05, 0.08, -0.035, 1, HUB),
		surface_line(0.08, -0.035, 0.2, -0.035, 2, WHEEL),
		{ { { 0.2, -0.035 }, { 0.227, -0.035 }, { 0.24, -0.027 }, { 0.24, 0 } }, 0, 1, 10, WHEEL },
		{ { { 0.24, 0 }, { 0.24, 0.027 }, { 0.227, 0.035 }, { 0.2, 0.035 } }, 0, 1, 10, WHEEL },
		surface_line(0.2, 0.035, 0.08, 0.035, 2, WHEEL),
		surface_line(0.08, 0.035, 0.07, 0.05, 1, HUB),
		surface_line(0.07, 0.05, 0, 0.05, 1, HUB),
	};

	shape->current = BASE;
	sweep_block(shape, center, half, 0.04);
	for (int x = -1; x <= 1; x += 2) {
		const double axle[2][3] = { { 0.55 * x, 0.24, -0.5 }, { 0.55 * x, 0.24, 0.5 } };
		const double leg[2][3] = { { 0.12 * x + 0.05, 0.34, 0.16 * x }, { 0.06 * x + 0.05, 0.78, 0.12 * x } };

		shape->current = HUB;
		surface_rod(shape, axle[0], 0.028, axle[1], 0.028, 32);
		shape->current = BEAK;
		surface_rod(shape, leg[0], 0.035, leg[1], 0.03, 32);
		for (int z = -1; z <= 1; z += 2) {
			const double from[3] = { 0.55 * x, 0.24, 0.43 * z }, to[3] = { 0.55 * x, 0.24, 0.43 * z + z };
			uint32_t first = shape->n_vertices;

			surface_lathe(shape, wheel, sizeof wheel / sizeof wheel[0], 64);
			sweep_along(shape, first, from, to);
		}
	}
}

/* From the cart's front it hangs down, lies on the ground in a curve and ends in a bead. */
static void string(struct shape *shape)
{
	static const double bead[3] = { 1.75, 0.075, 0.62 }, half[3] = { 0.075, 0.075, 0.075 };
	double path[49][3], radius[49], c, s;

	for (int i = 0; i <= 48; i++) {
		double t = i / 48.0, fall = t < 0.35 ? 1 - t / 0.35 : 0;

		sweep_angle(0.85 * t, &c, &s);
		v3d_set(path[i], 0.84 + 0.91 * t, 0.016 + 0.284 * fall * fall + 0.059 * t * t * t * t * t * t,
		        0.38 * s * t * 0.8 + 0.9 * t * t * t);
		path[i][2] += (0.62 - (0.38 * -0.8090169943749475 * 0.8 + 0.9)) * t * t * t;
		radius[i] = 0.012;
	}
	shape->current = STRING;
	sweep_tube(shape, (const double (*)[3])path, radius, 49, 12);
	shape->current = BEAD;
	sweep_ball(shape, bead, half, 24, 32);
}

void make_toybird(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	body(shape);
	head(shape);
	feathers(shape);
	cart(shape);
	string(shape);
}
