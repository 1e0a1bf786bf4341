#include <assert.h>
#include <fenv.h>
#include <math.h>
#include <pthread.h>
#include "direction.h"
#include "vec.h"

#define LEVELS 6
#define N_INNER ((1 << 2 * LEVELS) / 3) /* divided triangles of one octant: 1 + 4 + ... + 4^5 */

/* Planes through the origin that divide the triangles of the positive octant, level after level. A triangle has three:
 * each cuts off child 1, 2 or 3, with its normal towards that child. The other octants are mirror images. */
static double cut_plane[N_INNER][3][3];
static float direction_table[PSR_DIRECTIONS][3];
static uint64_t direction_words[PSR_DIRECTIONS];
static uint32_t direction_tens[PSR_DIRECTIONS];
static pthread_once_t tables_once = PTHREAD_ONCE_INIT;

static void midpoint(double m[3], const double a[3], const double b[3])
{
	v3d_add(m, a, b);
	v3d_normalize(m, m);
}

static void child_corners(double child[3][3], const double corner[3][3], unsigned which)
{
	double ab[3], bc[3], ca[3];
	const double *pick[4][3] = { { bc, ca, ab }, { corner[0], ab, ca }, { ab, corner[1], bc }, { ca, bc, corner[2] } };
	double made[3][3];

	midpoint(ab, corner[0], corner[1]);
	midpoint(bc, corner[1], corner[2]);
	midpoint(ca, corner[2], corner[0]);
	for (int i = 0; i < 3; i++)
		v3d_set(made[i], pick[which][i][0], pick[which][i][1], pick[which][i][2]);
	for (int i = 0; i < 3; i++)
		v3d_set(child[i], made[i][0], made[i][1], made[i][2]);
}

void psr_direction_corners(int level, unsigned index, double corner[3][3])
{
	unsigned octant = index >> 2 * level;

	assert(level >= 0 && level <= LEVELS && octant < 8);
	v3d_set(corner[0], 1, 0, 0);
	v3d_set(corner[1], 0, 1, 0);
	v3d_set(corner[2], 0, 0, 1);
	while (level-- > 0)
		child_corners(corner, corner, index >> 2 * level & 3);
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			if (octant >> k & 1 && corner[i][k] != 0)
				corner[i][k] = -corner[i][k];
}

void psr_direction_center(int level, unsigned index, double v[3])
{
	double corner[3][3];

	psr_direction_corners(level, index, corner);
	v3d_add(v, corner[0], corner[1]);
	v3d_add(v, v, corner[2]);
	v3d_normalize(v, v);
}

/* Within the triangle (a, b, c), the child at a lies beyond the great circle through ab and ca. */
static void cut_off(double plane[3], const double first[3], const double second[3], const double corner[3])
{
	v3d_cross(plane, first, second);
	if (v3d_dot(plane, corner) < 0)
		v3d_scale(plane, plane, -1);
}

static void make_tables(void)
{
	unsigned node = 0;
	fenv_t callers;

	fegetenv(&callers);
	fesetenv(FE_DFL_ENV);
	for (int level = 0; level < LEVELS; level++) {
		for (unsigned index = 0; index < 1u << 2 * level; index++, node++) {
			double corner[3][3], middle[3][3]; /* bc, ca, ab */

			psr_direction_corners(level, index, corner);
			child_corners(middle, corner, 0);
			cut_off(cut_plane[node][0], middle[2], middle[1], corner[0]);
			cut_off(cut_plane[node][1], middle[2], middle[0], corner[1]);
			cut_off(cut_plane[node][2], middle[1], middle[0], corner[2]);
		}
	}
	for (unsigned index = 0; index < PSR_DIRECTIONS; index++) {
		double v[3];

		psr_direction_center(LEVELS, index, v);
		for (int k = 0; k < 3; k++) {
			direction_table[index][k] = (float)v[k];
			direction_words[index] |= (uint64_t)(uint16_t)lround(v[k] * 32767) << 16 * k;
			direction_tens[index] |= ((uint32_t)lround(v[k] * 511) & 0x3ff) << 10 * k;
		}
	}
	fesetenv(&callers);
}

const uint64_t *psr_direction_words(void)
{
	pthread_once(&tables_once, make_tables);
	return direction_words;
}

const float (*psr_direction_table(void))[3]
{
	pthread_once(&tables_once, make_tables);
	return (const float(*)[3])direction_table;
}

const uint32_t *psr_direction_tens(void)
{
	pthread_once(&tables_once, make_tables);
	return direction_tens;
}

uint16_t psr_direction_encode(const float v[3])
{
	double folded[3];
	unsigned octant = 0, index = 0, first = 0; /* first: number of the level's first node */
	int infinite = isinf(v[0]) || isinf(v[1]) || isinf(v[2]);

	if (isnan(v[0]) || isnan(v[1]) || isnan(v[2]) || (v[0] == 0 && v[1] == 0 && v[2] == 0))
		return 0;
	for (int k = 0; k < 3; k++) {
		octant |= (unsigned)(v[k] < 0) << k;
		folded[k] = infinite ? isinf(v[k]) != 0 : fabs((double)v[k]);
	}
	pthread_once(&tables_once, make_tables);
	for (int level = 0; level < LEVELS; level++) {
		const double (*plane)[3] = (const double(*)[3])cut_plane[first + index];
		unsigned child = 0;

		for (unsigned i = 0; i < 3 && child == 0; i++)
			if (v3d_dot(plane[i], folded) > 0)
				child = i + 1;
		first += 1u << 2 * level;
		index = index << 2 | child;
	}
	return (uint16_t)(octant << 2 * LEVELS | index);
}

void psr_direction_basis(const double dir[3], double basis[3][3])
{
	double up[3] = { 0, 0, 0 };
	int least = 0;

	assert(fabs(v3d_dot(dir, dir) - 1) < 1e-6);
	for (int k = 1; k < 3; k++)
		if (fabs(dir[k]) < fabs(dir[least]))
			least = k;
	up[least] = 1;
	v3d_set(basis[2], dir[0], dir[1], dir[2]);
	v3d_cross(basis[0], up, basis[2]);
	v3d_normalize(basis[0], basis[0]);
	v3d_cross(basis[1], basis[2], basis[0]);
	v3d_normalize(basis[1], basis[1]);
}
