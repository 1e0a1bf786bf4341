/* A judge's gavel on its sounding block: turned wood with brass bands. */
#include "generators.h"

#include "image.h"
#include "surfaces.h"
#include "sweep.h"

#define BLOCK_TOP 0.24
#define HEAD_RADIUS 0.3
#define MERIDIANS 128

enum { WALNUT, BLOCK, BRASS, FELT, N_MATERIALS };

static const struct shape_material materials[N_MATERIALS] = {
	[WALNUT] = { "walnut", 0xffffff, 0, 0.3, 0 },
	[BLOCK] = { "block", 0xffe6cc, 0, 0.35, 0 },
	[BRASS] = { "brass", 0xd8ae4f, 0.5, 0.25, 0 },
	[FELT] = { "felt", 0x22513a, 0, 0.95, 0 },
};

static void block(struct shape *shape)
{
	static const double u[4] = { 0.9, 0.25, 0, 0 }, v[4] = { 0, 0, 0.7, 0.2 };
	const struct surface_profile pieces[] = {
		surface_line(0, 0, 0.74, 0, 4, FELT),
		surface_line(0.74, 0, 0.74, 0.02, 1, FELT),
		surface_line(0.74, 0.02, 0.76, 0.02, 1, BLOCK),
		{ { { 0.76, 0.02 }, { 0.82, 0.04 }, { 0.8, 0.1 }, { 0.72, 0.13 } }, 0, 1, 12, BLOCK },
		{ { { 0.72, 0.13 }, { 0.69, 0.142 }, { 0.69, 0.16 }, { 0.7, 0.175 } }, 0, 1, 8, BLOCK },
		{ { { 0.7, 0.175 }, { 0.72, 0.2 }, { 0.69, 0.235 }, { 0.64, 0.24 } }, 0, 1, 10, BLOCK },
		{ { { 0.64, 0.24 }, { 0.45, 0.24 }, { 0.2, BLOCK_TOP }, { 0, BLOCK_TOP } }, 0, 1, 16, BLOCK },
	};
	uint32_t first = shape->n_vertices;

	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], MERIDIANS);
	shape_map(shape, first, u, v);
}

/* Half of the head's outline, from its middle to a striking face; the other half mirrors it. */
static const double half_head[][4][2] = {
	{ { 0.235, 0.09 }, { 0.235, 0.14 }, { 0.215, 0.18 }, { 0.2, 0.21 } },
	{ { 0.2, 0.21 }, { 0.19, 0.235 }, { 0.22, 0.25 }, { 0.245, 0.255 } },
	{ { 0.245, 0.255 }, { 0.29, 0.265 }, { 0.3, 0.3 }, { HEAD_RADIUS, 0.34 } },
	{ { HEAD_RADIUS, 0.34 }, { 0.3, 0.4 }, { 0.295, 0.44 }, { 0.27, 0.46 } },
	{ { 0.27, 0.46 }, { 0.2, 0.485 }, { 0.1, 0.49 }, { 0, 0.49 } },
};
#define HALF (sizeof half_head / sizeof half_head[0])

static void head(struct shape *shape)
{
	static const double u[4] = { 0, 1.3, 0.6, 0.1 }, v[4] = { 0.8, 0, 0, 0 };
	static const double left[3] = { 0, BLOCK_TOP + HEAD_RADIUS, 0 }, right[3] = { 1, BLOCK_TOP + HEAD_RADIUS, 0 };
	struct surface_profile pieces[2 * HALF + 5];
	uint32_t first = shape->n_vertices, n = 0;

	for (size_t i = HALF; i-- > 0;) {
		struct surface_profile *piece = &pieces[n++];

		*piece = (struct surface_profile){ .from = 0, .to = 1, .steps = 14, .material = WALNUT };
		for (int k = 0; k < 4; k++) {
			piece->p[k][0] = half_head[i][3 - k][0];
			piece->p[k][1] = -half_head[i][3 - k][1];
		}
	}
	pieces[n++] = surface_line(0.235, -0.09, 0.25, -0.085, 1, BRASS);
	pieces[n++] = surface_line(0.25, -0.085, 0.25, 0.085, 4, BRASS);
	pieces[n++] = surface_line(0.25, 0.085, 0.235, 0.09, 1, BRASS);
	for (size_t i = 0; i < HALF; i++) {
		struct surface_profile *piece = &pieces[n++];

		*piece = (struct surface_profile){ .from = 0, .to = 1, .steps = 14, .material = WALNUT };
		for (int k = 0; k < 4; k++) {
			piece->p[k][0] = half_head[i][k][0];
			piece->p[k][1] = half_head[i][k][1];
		}
	}
	surface_lathe(shape, pieces, n, MERIDIANS);
	sweep_along(shape, first, left, right);
	shape_map(shape, first, u, v);
}

static void handle(struct shape *shape)
{
	static const double u[4] = { 1.3, 0.6, 0, 0.4 }, v[4] = { 0, 0, 0.8, 0.1 };
	static const double start[3] = { 0, BLOCK_TOP + HEAD_RADIUS, 0.2 };
	static const double end[3] = { 0, BLOCK_TOP + HEAD_RADIUS - 0.1, 2.2 };
	const struct surface_profile pieces[] = {
		surface_line(0, 0, 0.085, 0, 1, BRASS),
		surface_line(0.085, 0, 0.085, 0.1, 2, BRASS),
		surface_line(0.085, 0.1, 0.062, 0.11, 1, BRASS),
		{ { { 0.062, 0.11 }, { 0.05, 0.3 }, { 0.075, 0.5 }, { 0.085, 0.7 } }, 0, 1, 24, WALNUT },
		{ { { 0.085, 0.7 }, { 0.095, 0.9 }, { 0.07, 1.1 }, { 0.058, 1.25 } }, 0, 1, 24, WALNUT },
		{ { { 0.058, 1.25 }, { 0.085, 1.253 }, { 0.085, 1.297 }, { 0.058, 1.3 } }, 0, 1, 12, WALNUT },
		{ { { 0.058, 1.3 }, { 0.06, 1.5 }, { 0.115, 1.55 }, { 0.115, 1.72 } }, 0, 1, 24, WALNUT },
		{ { { 0.115, 1.72 }, { 0.115, 1.84 }, { 0.07, 1.87 }, { 0, 1.87 } }, 0, 1, 16, WALNUT },
	};
	uint32_t first = shape->n_vertices;

	surface_lathe(shape, pieces, sizeof pieces / sizeof pieces[0], 64);
	sweep_along(shape, first, start, end);
	shape_map(shape, first, u, v);
}

void make_gavel(struct shape *shape)
{
	shape_materials(shape, materials, N_MATERIALS);
	shape_image(shape, WALNUT, 128, image_wood(128, 0x3c2012, 0x8a552f, 5));
	shape_image(shape, BLOCK, 128, image_wood(128, 0x5a3219, 0xa86f3e, 6));
	block(shape);
	head(shape);
	handle(shape);
}
