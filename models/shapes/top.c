#include "generators.h"

#include "surfaces.h"

#define MERIDIANS 192

enum { STEEL, RED, CREAM, BLUE, GOLD, WOOD, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[STEEL] = { "steel tip", 0xc8c8cc, 0.5, 0.25, 0 },
	[RED] = { "red lacquer", 0xb3261e, 0, 0.2, 0 },
	[CREAM] = { "cream lacquer", 0xf1e4c3, 0, 0.2, 0 },
	[BLUE] = { "blue lacquer", 0x1f3f7a, 0, 0.2, 0 },
	[GOLD] = { "gold ring", 0xd9a441, 0.5, 0.3, 0 },
	[WOOD] = { "turned wood", 0x9c6b3f, 0, 0.55, 0 },
};

/* Neighbouring curves have a common tangent where they meet, but for the ledge above the tip and the stem's foot. */
#define TIP { { 0, 0 }, { 0.04, 0 }, { 0.05, 0.03 }, { 0.075, 0.12 } }
#define BELLY { { 0.1, 0.12 }, { 0.2, 0.3 }, { 0.8, 0.55 }, { 0.98, 0.88 } }
#define BELT { { 0.98, 0.88 }, { 1.016, 0.946 }, { 1.02, 1.04 }, { 0.94, 1.1 } }
#define DOME { { 0.94, 1.1 }, { 0.86, 1.16 }, { 0.17, 1.16 }, { 0.13, 1.42 } }
#define STEM { { 0.12, 1.42 }, { 0.1, 1.55 }, { 0.085, 1.7 }, { 0.085, 1.95 } }
#define KNOB_LOW { { 0.085, 1.95 }, { 0.085, 2.02 }, { 0.15, 2.06 }, { 0.15, 2.13 } }
#define KNOB_HIGH { { 0.15, 2.13 }, { 0.15, 2.21 }, { 0.085, 2.25 }, { 0, 2.25 } }

void make_top(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	const struct surface_profile pieces[] = {
		{ TIP, 0, 1, 10, STEEL },
		surface_line(0.075, 0.12, 0.1, 0.12, 1, STEEL),
		{ BELLY, 0, 0.35, 14, RED },
		{ BELLY, 0.35, 0.4, 3, CREAM },
		{ BELLY, 0.4, 0.7, 14, RED },
		{ BELLY, 0.7, 0.82, 6, CREAM },
		{ BELLY, 0.82, 1, 8, BLUE },
		{ BELT, 0, 1, 16, GOLD },
		{ DOME, 0, 0.12, 6, BLUE },
		{ DOME, 0.12, 0.2, 4, CREAM },
		{ DOME, 0.2, 0.42, 10, RED },
		{ DOME, 0.42, 0.5, 4, CREAM },
		{ DOME, 0.5, 1, 18, BLUE },
		surface_line(0.13, 1.42, 0.12, 1.42, 1, GOLD),
		{ STEM, 0, 1, 10, WOOD },
		{ KNOB_LOW, 0, 1, 8, WOOD },
		{ KNOB_HIGH, 0, 1, 10, WOOD },
	};
	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], MERIDIANS);
}
