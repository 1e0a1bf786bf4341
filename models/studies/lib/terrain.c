/* A square of land for studies: hills of noise, and a picture whose details are finer than pixels of most views. */
#include <math.h>
#include <stdlib.h>
#include "base/random.h"
#include "terrain.h"

#define CELLS 512   /* a side */
#define PICTURE 1024
#define LATTICE 512 /* values of noise a side; it repeats */
#define OCTAVES 7
#define FIELDS 24   /* a side, with dark lines between them */

static double value_at(uint32_t i, uint32_t k)
{
	uint64_t state = (uint64_t)(i % LATTICE) * LATTICE + k % LATTICE;

	return random_in(&state, -1, 1);
}

/* Of lattice squares `step` a unit, smooth between their corners. */
static double noise(double x, double z, double step)
{
	const double u = x * step, v = z * step;
	const uint32_t i = (uint32_t)floor(u), k = (uint32_t)floor(v);
	const double p = u - i, q = v - k, s = p * p * (3 - 2 * p), t = q * q * (3 - 2 * q);
	const double near = value_at(i, k) + s * (value_at(i + 1, k) - value_at(i, k));
	const double far = value_at(i, k + 1) + s * (value_at(i + 1, k + 1) - value_at(i, k + 1));

	return near + t * (far - near);
}

/* x and z from 0 to 1. */
static double height(double x, double z)
{
	double sum = 0, part = 0.07;

	for (int i = 0; i < OCTAVES; i++, part *= 0.48)
		sum += part * noise(x, z, 4 << i);
	return sum;
}

static void paint(uint8_t rgb[3], double x, double z, uint64_t *random)
{
	static const double color[3][3] = { { 70, 96, 48 }, { 128, 110, 80 }, { 226, 228, 232 } };
	const double level = fmin(fmax(1 + height(x, z) * 14 + 0.3 * noise(x, z, 200), 0), 1.999);
	const int at = (int)level, is_line = fmod(x * FIELDS, 1) < 0.05 || fmod(z * FIELDS, 1) < 0.05;
	const double shade = (is_line ? 0.45 : 1) * random_in(random, 0.75, 1.1);

	for (int c = 0; c < 3; c++)
		rgb[c] = (uint8_t)fmin(255, shade * (color[at][c] + (level - at) * (color[at + 1][c] - color[at][c])));
}

static uint8_t *make_picture(void)
{
	uint8_t *rgb = malloc((size_t)3 * PICTURE * PICTURE);
	uint64_t random = 1;

	for (size_t i = 0; rgb != NULL && i < (size_t)PICTURE * PICTURE; i++)
		paint(rgb + 3 * i, (double)(i % PICTURE) / PICTURE, (double)(i / PICTURE) / PICTURE, &random);
	return rgb;
}

void make_terrain(struct shape *shape)
{
	static const struct shape_material land = { "land", 0xffffff, 0, 0.9, 1 };
	static const double u[4] = { 1, 0, 0, 0 }, v[4] = { 0, 0, 1, 0 };
	struct shape_vertex *grid = shape_grid_alloc(shape, CELLS + 1, CELLS + 1);
	const double step = 1.0 / CELLS;

	if (grid == NULL)
		return;
	for (uint32_t row = 0; row <= CELLS; row++)
		for (uint32_t column = 0; column <= CELLS; column++) {
			const double z = 1 - row * step, x = column * step;
			const double up_x = height(x + step, z) - height(fmax(x - step, 0), z);
			const double up_z = height(x, z + step) - height(x, fmax(z - step, 0));

			grid[row * (CELLS + 1) + column] = (struct shape_vertex){
				{ x, height(x, z), z }, { -up_x / (2 * step), 1, -up_z / (2 * step) } };
		}
	shape_image(shape, shape_material(shape, &land), PICTURE, make_picture());
	shape_grid(shape, grid, CELLS + 1, CELLS + 1, 0, 0);
	shape_map(shape, 0, u, v);
	free(grid);
}
