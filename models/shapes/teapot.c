/* Martin Newell's teapot (1975): 32 bicubic Bezier patches. The table holds the ten that the others are mirror images
 * of; the original has z up. */
#include "generators.h"

#include <string.h>
#include "surfaces.h"
#include "teapot.h"

#define STEPS 28 /* a side of a patch: 50,176 triangles and the caps */

static const double points[][3] = {
	{ 0.2, 0, 2.7 }, { 0.2, -0.112, 2.7 }, { 0.112, -0.2, 2.7 }, { 0, -0.2, 2.7 },
	{ 1.3375, 0, 2.53125 }, { 1.3375, -0.749, 2.53125 }, { 0.749, -1.3375, 2.53125 }, { 0, -1.3375, 2.53125 },
	{ 1.4375, 0, 2.53125 }, { 1.4375, -0.805, 2.53125 }, { 0.805, -1.4375, 2.53125 }, { 0, -1.4375, 2.53125 },
	{ 1.5, 0, 2.4 }, { 1.5, -0.84, 2.4 }, { 0.84, -1.5, 2.4 }, { 0, -1.5, 2.4 },
	{ 1.75, 0, 1.875 }, { 1.75, -0.98, 1.875 }, { 0.98, -1.75, 1.875 }, { 0, -1.75, 1.875 },
	{ 2, 0, 1.35 }, { 2, -1.12, 1.35 }, { 1.12, -2, 1.35 }, { 0, -2, 1.35 },
	{ 2, 0, 0.9 }, { 2, -1.12, 0.9 }, { 1.12, -2, 0.9 }, { 0, -2, 0.9 },
	{ -2, 0, 0.9 },
	{ 2, 0, 0.45 }, { 2, -1.12, 0.45 }, { 1.12, -2, 0.45 }, { 0, -2, 0.45 },
	{ 1.5, 0, 0.225 }, { 1.5, -0.84, 0.225 }, { 0.84, -1.5, 0.225 }, { 0, -1.5, 0.225 },
	{ 1.5, 0, 0.15 }, { 1.5, -0.84, 0.15 }, { 0.84, -1.5, 0.15 }, { 0, -1.5, 0.15 },
	{ -1.6, 0, 2.025 }, { -1.6, -0.3, 2.025 }, { -1.5, -0.3, 2.25 }, { -1.5, 0, 2.25 },
	{ -2.3, 0, 2.025 }, { -2.3, -0.3, 2.025 }, { -2.5, -0.3, 2.25 }, { -2.5, 0, 2.25 },
	{ -2.7, 0, 2.025 }, { -2.7, -0.3, 2.025 }, { -3, -0.3, 2.25 }, { -3, 0, 2.25 },
	{ -2.7, 0, 1.8 }, { -2.7, -0.3, 1.8 }, { -3, -0.3, 1.8 }, { -3, 0, 1.8 },
	{ -2.7, 0, 1.575 }, { -2.7, -0.3, 1.575 }, { -3, -0.3, 1.35 }, { -3, 0, 1.35 },
	{ -2.5, 0, 1.125 }, { -2.5, -0.3, 1.125 }, { -2.65, -0.3, 0.9375 }, { -2.65, 0, 0.9375 },
	{ -2, -0.3, 0.9 }, { -1.9, -0.3, 0.6 }, { -1.9, 0, 0.6 },
	{ 1.7, 0, 1.425 }, { 1.7, -0.66, 1.425 }, { 1.7, -0.66, 0.6 }, { 1.7, 0, 0.6 },
	{ 2.6, 0, 1.425 }, { 2.6, -0.66, 1.425 }, { 3.1, -0.66, 0.825 }, { 3.1, 0, 0.825 },
	{ 2.3, 0, 2.1 }, { 2.3, -0.25, 2.1 }, { 2.4, -0.25, 2.025 }, { 2.4, 0, 2.025 },
	{ 2.7, 0, 2.4 }, { 2.7, -0.25, 2.4 }, { 3.3, -0.25, 2.4 }, { 3.3, 0, 2.4 },
	{ 2.8, 0, 2.475 }, { 2.8, -0.25, 2.475 }, { 3.525, -0.25, 2.49375 }, { 3.525, 0, 2.49375 },
	{ 2.9, 0, 2.475 }, { 2.9, -0.15, 2.475 }, { 3.45, -0.15, 2.5125 }, { 3.45, 0, 2.5125 },
	{ 2.8, 0, 2.4 }, { 2.8, -0.15, 2.4 }, { 3.2, -0.15, 2.4 }, { 3.2, 0, 2.4 },
	{ 0, 0, 3.15 }, { 0.8, 0, 3.15 }, { 0.8, -0.45, 3.15 }, { 0.45, -0.8, 3.15 }, { 0, -0.8, 3.15 },
	{ 0, 0, 2.85 },
	{ 1.4, 0, 2.4 }, { 1.4, -0.784, 2.4 }, { 0.784, -1.4, 2.4 }, { 0, -1.4, 2.4 },
	{ 0.4, 0, 2.55 }, { 0.4, -0.224, 2.55 }, { 0.224, -0.4, 2.55 }, { 0, -0.4, 2.55 },
	{ 1.3, 0, 2.55 }, { 1.3, -0.728, 2.55 }, { 0.728, -1.3, 2.55 }, { 0, -1.3, 2.55 },
	{ 1.3, 0, 2.4 }, { 1.3, -0.728, 2.4 }, { 0.728, -1.3, 2.4 }, { 0, -1.3, 2.4 },
	{ 0, 0, 0 },
	{ 1.425, -0.798, 0 }, { 1.5, 0, 0.075 }, { 1.425, 0, 0 }, { 0.798, -1.425, 0 },
	{ 0, -1.5, 0.075 }, { 0, -1.425, 0 }, { 1.5, -0.84, 0.075 }, { 0.84, -1.5, 0.075 },
};

enum kind { ROUND, MIRRORED }; /* quarters of a turn; halves */

static const struct {
	const char *part;
	enum kind kind;
	uint8_t index[16];
} patches[] = {
	{ "rim", ROUND, { 102, 103, 104, 105, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15 } },
	{ "body", ROUND, { 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27 } },
	{ "body", ROUND, { 24, 25, 26, 27, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40 } },
	{ "lid", ROUND, { 96, 96, 96, 96, 97, 98, 99, 100, 101, 101, 101, 101, 0, 1, 2, 3 } },
	{ "lid", ROUND, { 0, 1, 2, 3, 106, 107, 108, 109, 110, 111, 112, 113, 114, 115, 116, 117 } },
	{ "bottom", ROUND, { 118, 118, 118, 118, 124, 122, 119, 121, 123, 126, 125, 120, 40, 39, 38, 37 } },
	{ "handle", MIRRORED, { 41, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56 } },
	{ "handle", MIRRORED, { 53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63, 64, 28, 65, 66, 67 } },
	{ "spout", MIRRORED, { 68, 69, 70, 71, 72, 73, 74, 75, 76, 77, 78, 79, 80, 81, 82, 83 } },
	{ "spout", MIRRORED, { 80, 81, 82, 83, 84, 85, 86, 87, 88, 89, 90, 91, 92, 93, 94, 95 } },
};

/* A mirror image has its columns turned round, so that its outside stays outside. */
static void mirrored(const uint8_t index[16], int sign_x, int sign_y, double control[4][4][3])
{
	for (int row = 0; row < 4; row++) {
		for (int col = 0; col < 4; col++) {
			const double *p = points[index[4 * row + (sign_x * sign_y > 0 ? col : 3 - col)]];

			control[row][col][0] = sign_x * p[0];
			control[row][col][1] = p[2];
			control[row][col][2] = -sign_y * p[1];
		}
	}
}

const char *teapot_patch(uint32_t i, double control[4][4][3])
{
	size_t entry = 0;
	uint32_t copies = 4;

	while (i >= copies) {
		i -= copies;
		copies = patches[++entry].kind == ROUND ? 4 : 2;
	}
	mirrored(patches[entry].index, i & 2 ? -1 : 1, i & 1 ? -1 : 1, control);
	return patches[entry].part;
}

/* The groove between lid and rim, a flat ring in the original's hole: straight rows from one to the other. */
static void groove(struct shape *shape)
{
	double lid[4][4][3], rim[4][4][3], ring[4][4][3];

	for (int quarter = 0; quarter < 4; quarter++) {
		int sign_x = quarter & 2 ? -1 : 1, sign_y = quarter & 1 ? -1 : 1;

		mirrored(patches[0].index, sign_x, sign_y, rim);
		mirrored(patches[4].index, sign_x, sign_y, lid);
		for (int row = 0; row < 4; row++) {
			for (int col = 0; col < 4; col++) {
				for (int k = 0; k < 3; k++) {
					double a = lid[3][col][k], b = rim[0][col][k];

					ring[row][col][k] = row == 0 ? a : row == 3 ? b : a + (b - a) * row / 3;
				}
			}
		}
		surface_patch(shape, ring, 2, STEPS);
	}
}

/* Closes the open end of a tube of two mirrored patches: the row of control points at its start or its end, flat. */
static void cap(struct shape *shape, const uint8_t index[16], int at_end)
{
	double half[2][4][4][3], rim[2 * STEPS][3], center[3] = { 0, 0, 0 }, normal[3], a[3], b[3];
	int row = at_end ? 3 : 0, side;

	mirrored(index, 1, 1, half[0]);
	mirrored(index, 1, -1, half[1]);
	for (uint32_t i = 0; i < 2 * STEPS; i++) {
		side = i >= STEPS;
		const double *const control[4] = {
			half[side][row][0], half[side][row][1], half[side][row][2], half[side][row][3],
		};
		surface_bezier(control, 3, i % STEPS, STEPS, rim[at_end ? i : 2 * STEPS - 1 - i], NULL);
	}
	for (uint32_t i = 0; i < 2 * STEPS; i++) {
		for (int k = 0; k < 2; k++) /* z is 0 by symmetry, the sum might not be */
			center[k] += rim[i][k] / (2 * STEPS);
	}
	for (int k = 0; k < 3; k++) {
		a[k] = rim[0][k] - center[k];
		b[k] = rim[STEPS / 2][k] - center[k];
	}
	normal[0] = a[1] * b[2] - a[2] * b[1];
	normal[1] = a[2] * b[0] - a[0] * b[2];
	normal[2] = a[0] * b[1] - a[1] * b[0];
	shape_fan(shape, center, normal, (const double (*)[3])rim, 2 * STEPS);
}

void make_teapot(struct shape *shape)
{
	static const struct shape_material glaze = { "glaze", 0x2f7f86, 0, 0.22, 0 };
	static const struct shape_material tea = { "tea", 0x2a1408, 0, 0.1, 0 };
	double control[4][4][3];

	shape_material(shape, &glaze);
	for (uint32_t i = 0; i < TEAPOT_PATCHES; i++) {
		teapot_patch(i, control);
		surface_patch(shape, (const double (*)[4][3])control, STEPS, STEPS);
	}
	groove(shape);
	cap(shape, patches[6].index, 0);
	cap(shape, patches[7].index, 1);
	cap(shape, patches[8].index, 0);
	shape_material(shape, &tea);
	cap(shape, patches[9].index, 1);
}
