/* A pencil sharpened by a true cone: the scallops are where the cone meets the hexagon's faces. It is made along +Y,
 * its tip at the origin, and laid down at the end. */
#include "generators.h"

#include <math.h>
#include "surfaces.h"

#define APOTHEM 0.35
#define CORNER 0.06   /* radius of the rounded edges */
#define TAPER 0.22    /* radius of the cone at height 1 */
#define LEAD 0.11     /* radius of the graphite where the wood begins */
#define POINT 0.012   /* radius of the blunt point */
#define BODY 8.4      /* where the hexagon ends, within the ferrule */
#define FACE_STEPS 16
#define CORNER_STEPS 6
#define AROUND (6 * (FACE_STEPS + CORNER_STEPS))
#define WOOD_ROWS 24
#define LEAD_ROWS 6
#define BODY_ROWS 32

enum { GRAPHITE, WOOD, PAINT, FERRULE, ERASER, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[GRAPHITE] = { "graphite", 0x3a3a3f, 0.3, 0.45, 0 },
	[WOOD] = { "cedar", 0xd9a871, 0, 0.8, 0 },
	[PAINT] = { "yellow paint", 0xf2b21c, 0, 0.3, 0 },
	[FERRULE] = { "ferrule", 0xb9b89c, 0.5, 0.3, 0 },
	[ERASER] = { "eraser", 0xd98580, 0, 0.9, 0 },
};

/* A point of the hexagon's outline: place and normal in x and -z, distance from the axis. */
struct outline {
	double p[2], n[2], r;
};

/* Six times a face (its first point is the last one's successor) and a rounded corner of 60 degrees. */
static void make_outline(struct outline outline[AROUND])
{
	double half = (APOTHEM - CORNER) / sqrt(3); /* half a face's flat part */
	struct outline *o = outline;
	double c, s, turn_c, turn_s;

	for (uint32_t face = 0; face < 6; face++) {
		surface_turn(face, 6, &c, &s);
		for (int i = 0; i < FACE_STEPS; i++, o++) {
			double t = half * (2.0 * i / FACE_STEPS - 1);

			o->p[0] = APOTHEM * c - t * s;
			o->p[1] = APOTHEM * s + t * c;
			o->n[0] = c;
			o->n[1] = s;
		}
		for (uint32_t i = 0; i < CORNER_STEPS; i++, o++) {
			surface_turn(face * CORNER_STEPS + i, 6 * CORNER_STEPS, &turn_c, &turn_s);
			o->p[0] = (APOTHEM - CORNER) * c - half * s + CORNER * turn_c;
			o->p[1] = (APOTHEM - CORNER) * s + half * c + CORNER * turn_s;
			o->n[0] = turn_c;
			o->n[1] = turn_s;
		}
	}
	for (int i = 0; i < AROUND; i++)
		outline[i].r = sqrt(outline[i].p[0] * outline[i].p[0] + outline[i].p[1] * outline[i].p[1]);
}

static void set(struct shape_vertex *v, const double p[2], double y, double nx, double ny, double nz)
{
	v->p[0] = p[0];
	v->p[1] = y;
	v->p[2] = -p[1];
	v->n[0] = nx;
	v->n[1] = ny;
	v->n[2] = -nz;
}

/* A stump of the cone: its first row at radius `from`, its last at `to` or, if that is 0, at the outline. */
static void cone(struct shape *shape, const struct outline outline[AROUND], double from, double to, uint32_t rows)
{
	struct shape_vertex grid[(WOOD_ROWS + 1) * AROUND];

	for (uint32_t row = 0; row <= rows; row++) {
		for (int i = 0; i < AROUND; i++) {
			const struct outline *o = &outline[i];
			double end = to > 0 ? to : o->r, r = row == rows ? end : from + (end - from) * row / rows;
			double dir[2] = { o->p[0] / o->r, o->p[1] / o->r }, p[2] = { r * dir[0], r * dir[1] };

			/* the outline's own places, which the body shares */
			if (row == rows && to == 0) {
				p[0] = o->p[0];
				p[1] = o->p[1];
			}
			set(&grid[row * AROUND + (uint32_t)i], p, r / TAPER, dir[0], -TAPER, dir[1]);
		}
	}
	shape_grid(shape, grid, rows + 1, AROUND, 0, 1);
}

/* The blunt point is a small dome that continues the cone's slope; then the lead, the wood, the painted faces. */
static void sharpened_body(struct shape *shape, const struct outline outline[AROUND])
{
	struct shape_vertex grid[(BODY_ROWS + 1) * AROUND];
	static const double origin[2] = { 0, 0 }, top[3] = { 0, BODY, 0 }, up[3] = { 0, 1, 0 };
	double rim[AROUND][3];

	for (int i = 0; i < AROUND; i++) {
		const struct outline *o = &outline[i];
		double dir[2] = { o->p[0] / o->r, o->p[1] / o->r }, p[2] = { POINT * dir[0], POINT * dir[1] };

		set(&grid[i], origin, POINT / TAPER * 0.75, 0, -1, 0);
		set(&grid[AROUND + i], p, POINT / TAPER, dir[0], -TAPER, dir[1]);
	}
	shape->current = GRAPHITE;
	shape_grid(shape, grid, 2, AROUND, 0, 1);
	cone(shape, outline, POINT, LEAD, LEAD_ROWS);
	shape->current = WOOD;
	cone(shape, outline, LEAD, 0, WOOD_ROWS);
	for (uint32_t row = 0; row <= BODY_ROWS; row++) {
		for (int i = 0; i < AROUND; i++) {
			const struct outline *o = &outline[i];
			double start = o->r / TAPER, y = row == BODY_ROWS ? BODY : start + (BODY - start) * row / BODY_ROWS;

			set(&grid[row * AROUND + (uint32_t)i], o->p, y, o->n[0], 0, o->n[1]);
		}
	}
	shape->current = PAINT;
	shape_grid(shape, grid, BODY_ROWS + 1, AROUND, 0, 1);
	for (int i = 0; i < AROUND; i++) {
		rim[i][0] = outline[i].p[0];
		rim[i][1] = BODY;
		rim[i][2] = -outline[i].p[1];
	}
	shape_fan(shape, top, up, (const double (*)[3])rim, AROUND);
}

static void ferrule_and_eraser(struct shape *shape)
{
	const struct surface_profile ferrule[] = {
		surface_line(0, 8.2, 0.375, 8.2, 1, FERRULE),
		surface_line(0.375, 8.2, 0.395, 8.22, 1, FERRULE),
		surface_line(0.395, 8.22, 0.395, 9.08, 4, FERRULE),
		surface_line(0.395, 9.08, 0.375, 9.1, 1, FERRULE),
		surface_line(0.375, 9.1, 0, 9.1, 1, FERRULE),
	};
	const struct surface_profile eraser[] = {
		surface_line(0, 9, 0.36, 9, 1, ERASER),
		surface_line(0.36, 9, 0.36, 9.48, 4, ERASER),
		{ { { 0.36, 9.48 }, { 0.36, 9.58 }, { 0.3, 9.62 }, { 0.22, 9.62 } }, 0, 1, 10, ERASER },
		surface_line(0.22, 9.62, 0, 9.62, 2, ERASER),
	};

	surface_lathe(shape, ferrule, sizeof ferrule / sizeof ferrule[0], 96);
	surface_lathe(shape, eraser, sizeof eraser / sizeof eraser[0], 96);
	shape->current = FERRULE;
	for (int i = 0; i < 3; i++) {
		surface_torus(shape, 0.39, 0.022, 8.34 + 0.055 * i, 96, 16);
		surface_torus(shape, 0.39, 0.022, 8.85 + 0.055 * i, 96, 16);
	}
}

void make_pencil(struct shape *shape)
{
	/* the ferrule's ridges are the widest part and carry the end; the hexagon's faces lie parallel to the ground */
	static const double lie[3][3] = { { 0, 1, 0 }, { 1, 0, 0 }, { 0, 0, -1 } }, lift[3] = { 0, 0.39 + 0.022, 0 };
	struct outline outline[AROUND];

	shape_materials(shape, materials, N_MATERIALS);
	make_outline(outline);
	sharpened_body(shape, outline);
	ferrule_and_eraser(shape);
	shape_move(shape, 0, lie, lift);
}
