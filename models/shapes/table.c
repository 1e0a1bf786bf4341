/* A farm table with turned legs, a checkered runner that hangs over its ends, and a bowl of fruit. */
#include "generators.h"

#include <math.h>
#include "base/vec.h"
#include "image.h"
#include "base/random.h"
#include "surfaces.h"
#include "sweep.h"

#define TOP_Y 0.74
#define HALF_LENGTH 0.8
#define HALF_WIDTH 0.42
#define THICK 0.032

enum { TOP, LEG, CLOTH, BOWL, APPLE, ORANGE, STALK, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[TOP] = { "oak", 0xffffff, 0, 0.5, 0 },
	[LEG] = { "white paint", 0xeae6da, 0, 0.5, 0 },
	[CLOTH] = { "checkered cloth", 0xffffff, 0, 0.95, 1 },
	[BOWL] = { "blue glaze", 0x2f5f8f, 0, 0.15, 0 },
	[APPLE] = { "apple", 0xb02a24, 0, 0.3, 0 },
	[ORANGE] = { "orange", 0xe5871d, 0, 0.5, 0 },
	[STALK] = { "stalk", 0x4c3420, 0, 0.8, 0 },
};

static void frame(struct shape *shape)
{
	static const double top[3] = { 0, TOP_Y - THICK / 2, 0 }, half[3] = { HALF_LENGTH, THICK / 2, HALF_WIDTH };
	static const double u[4] = { 0, 0.5, 2, 0 }, v[4] = { 0.7, 0, 0, 0 };
	uint32_t first = shape->n_vertices;

	shape->current = TOP;
	sweep_block(shape, top, half, 0.012);
	shape_map(shape, first, u, v);
	shape->current = LEG;
	for (int side = -1; side <= 1; side += 2) {
		const double along[3] = { 0, TOP_Y - THICK - 0.05, side * 0.35 }, along_half[3] = { 0.68, 0.052, 0.012 };
		const double across[3] = { side * 0.72, TOP_Y - THICK - 0.05, 0 }, across_half[3] = { 0.012, 0.052, 0.31 };

		sweep_block(shape, along, along_half, 0.003);
		sweep_block(shape, across, across_half, 0.003);
	}
}

static void leg(struct shape *shape, double x, double z)
{
	const struct surface_profile pieces[] = {
		surface_line(0, 0, 0.018, 0, 1, LEG),
		{ { { 0.018, 0 }, { 0.03, 0.02 }, { 0.03, 0.05 }, { 0.02, 0.07 } }, 0, 1, 10, LEG },
		{ { { 0.02, 0.07 }, { 0.024, 0.2 }, { 0.036, 0.35 }, { 0.038, 0.44 } }, 0, 1, 20, LEG },
		{ { { 0.038, 0.44 }, { 0.04, 0.48 }, { 0.024, 0.48 }, { 0.024, 0.495 } }, 0, 1, 10, LEG },
		{ { { 0.024, 0.495 }, { 0.048, 0.5 }, { 0.048, 0.535 }, { 0.026, 0.54 } }, 0, 1, 12, LEG },
		surface_line(0.026, 0.54, 0, 0.54, 1, LEG),
	};
	const double center[3] = { x, 0.625, z }, half[3] = { 0.04, 0.09, 0.04 }, move[3] = { x, 0, z };
	uint32_t first = shape->n_vertices;

	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], 48);
	shape_shift(shape, first, move);
	sweep_block(shape, center, half, 0.005);
}

/* The runner lies on the table, bends around its ends and hangs down in folds. u across, v along. */
static void cloth_at(double u, double v, double p[3], const void *context)
{
	double half_top = HALF_LENGTH + 0.004, bend = 0.012, hang = 0.24, quarter = bend * 1.5707963267948966;
	double length = half_top + quarter + hang, s = (2 * v - 1) * length, side = s < 0 ? -1 : 1,
		rest = fabs(s) - half_top;
	double c, sine, fold_c, fold_s;

	(void)context;
	p[2] = (2 * u - 1) * 0.2;
	if (rest <= 0) {
		p[0] = s;
		p[1] = TOP_Y + 0.003;
	} else if (rest < quarter) {
		sweep_angle(rest / quarter / 4, &c, &sine);
		p[0] = side * (half_top + bend * sine);
		p[1] = TOP_Y + 0.003 - bend * (1 - c);
	} else {
		double drop = rest - quarter;

		sweep_angle(2.5 * u, &fold_c, &fold_s);
		p[0] = side * (half_top + bend + 0.09 * drop * (1 - fold_c) * 0.5);
		p[1] = TOP_Y + 0.003 - bend - drop;
		p[2] *= 1 - 0.1 * drop;
	}
}

static void cloth(struct shape *shape)
{
	uint32_t first = shape->n_vertices;

	shape->current = CLOTH;
	sweep_surface(shape, cloth_at, NULL, 240, 48, 0);
	for (uint32_t i = first; i < shape->n_vertices && !shape->failed; i++) {
		shape->uv[i][0] *= 5;
		shape->uv[i][1] *= 26.5f;
	}
}

static void bowl(struct shape *shape)
{
	static const double move[3] = { 0.12, TOP_Y + 0.004, 0.02 };
	const struct surface_profile pieces[] = {
		surface_line(0, 0, 0.05, 0, 1, BOWL),
		surface_line(0.05, 0, 0.05, 0.01, 1, BOWL),
		{ { { 0.05, 0.01 }, { 0.11, 0.015 }, { 0.14, 0.06 }, { 0.152, 0.1 } }, 0, 1, 24, BOWL },
		{ { { 0.152, 0.1 }, { 0.154, 0.106 }, { 0.148, 0.107 }, { 0.146, 0.1 } }, 0, 1, 8, BOWL },
		{ { { 0.146, 0.1 }, { 0.13, 0.06 }, { 0.1, 0.022 }, { 0, 0.022 } }, 0, 1, 24, BOWL },
	};
	uint32_t first = shape->n_vertices;

	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], 96);
	shape_shift(shape, first, move);
}

/* Apples have dimples and stalks, oranges are round. */
static void fruit(struct shape *shape)
{
	static const double where[5][3] = {
		{ 0.05, 0.065, 0.03 }, { -0.045, 0.064, 0.045 }, { -0.03, 0.065, -0.055 }, { 0.055, 0.064, -0.05 },
		{ 0.005, 0.128, -0.005 },
	};
	const struct surface_profile apple[] = {
		{ { { 0, -0.03 }, { 0.006, -0.036 }, { 0.04, -0.04 }, { 0.04, 0 } }, 0, 1, 16, APPLE },
		{ { { 0.04, 0 }, { 0.04, 0.04 }, { 0.01, 0.042 }, { 0, 0.026 } }, 0, 1, 16, APPLE },
	};
	static const double round[3] = { 0.038, 0.037, 0.038 };
	static const double stalk[3][3] = { { 0, 0.02, 0 }, { 0, 0.035, 0 }, { 0.006, 0.046, 0 } };
	uint64_t random = 3;

	for (int i = 0; i < 5; i++) {
		double center[3] = { 0.12 + where[i][0], TOP_Y + 0.004 + where[i][1], 0.02 + where[i][2] };
		double lean_x = random_in(&random, -0.4, 0.4), lean_z = random_in(&random, -0.4, 0.4);
		double tip[3] = { center[0] + lean_x, center[1] + 1, center[2] + lean_z };
		uint32_t first = shape->n_vertices;

		if (i == 1 || i == 3) {
			shape->current = ORANGE;
			sweep_ball(shape, center, round, 24, 40);
			continue;
		}
		surface_lathe(shape, apple, 2, 48);
		shape->current = STALK;
		sweep_bend(shape, stalk, 0.0012, 8, 8);
		sweep_along(shape, first, center, tip);
	}
}

void make_table(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	shape_image(shape, TOP, 128, image_planks(128, 0xb98a55, 0x4a2f18, 8));
	shape_image(shape, CLOTH, 32, image_checker(32, 0xf3efe4, 0xa8322c));
	frame(shape);
	for (int i = 0; i < 4; i++)
		leg(shape, i & 1 ? 0.72 : -0.72, i & 2 ? 0.35 : -0.35);
	cloth(shape);
	bowl(shape);
	fruit(shape);
}
