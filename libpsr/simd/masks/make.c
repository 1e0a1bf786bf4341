/* Writes the table of ewa_masks.h as C, to standard output. Runs on the machine that builds the library, whichever the
 * library is for: additions, multiplications, divisions and sqrt in double give the same bytes everywhere. */
#include <math.h>
#include <stdio.h>
#include "libpsr/simd/ewa_masks.h"

/* Columns of a pixel. A column's integral is exact, and rises and falls once from one column to the next, so the mean of
 * some has an error of their number's part of the greatest. */
#define COLUMNS 64
#define CORE 0.25 /* of a mask's greatest weight (decision 0121) */

static const struct ewa_size sizes[EWA_SIZES] = {
	{ 0.70710678f, 0, 0, 0 }, { 0.89089872f, 1, 1, 0 }, { 1.1224620f, 1, 1, 0 }, { 1.4142136f, 2, 1, 0 },
	{ 1.7817974f, 2, 1, 0 },  { 2.2449241f, 3, 2, 0 },  { 2.8284271f, 4, 2, 0 }, { 3.5635949f, 4, 3, 0 },
	{ 4.4898482f, 6, 4, 0 },  { 5.6568542f, 7, 5, 0 },
};

/* exp(-x) for x of 0 or more: halves x until a polynomial is exact. */
static double falling_exp(double x)
{
	double term = 1, sum = 1;
	int n_halved = 0;

	if (x > 200)
		return 0;
	while (x > 0.5) {
		x *= 0.5;
		n_halved++;
	}
	for (int k = 1; k < 20; k++) {
		term *= -x / k;
		sum += term;
	}
	for (int k = 0; k < n_halved; k++)
		sum *= sum;
	return sum;
}

/* The integral of exp(-t^2 / 2) from 0 to x: exp(-x^2 / 2) times a sum of positive terms. */
static double half_bell(double x)
{
	const double square = x * x;
	double term = x, sum = x;

	if (x < 0)
		return -half_bell(-x);
	if (x > 9)
		return 1.2533141373155003; /* sqrt(pi / 2) */
	for (int k = 3; term > sum * 1e-17; k += 2) {
		term *= square / k;
		sum += term;
	}
	return sum * falling_exp(square / 2);
}

/* A Gaussian exp(-(a x^2 + 2 b x y + c y^2) / 2). */
struct bell {
	double a, b, c;
};

/* The mean in the pixel whose middle is at (x, y). */
static double mean_in_pixel(const struct bell *g, double x, double y)
{
	const double root = sqrt(g->c), along = g->a - g->b * g->b / g->c;
	double sum = 0;

	for (int i = 0; i < COLUMNS; i++) {
		const double at = x - 0.5 + (i + 0.5) / COLUMNS, shift = g->b * at / g->c;
		const double height = half_bell(root * (y + 0.5 + shift)) - half_bell(root * (y - 0.5 + shift));

		sum += falling_exp(along * at * at / 2) * height / root;
	}
	return sum / COLUMNS;
}

static void make_bell(struct bell *g, uint32_t shape, double edge)
{
	const double deviation = (double)EWA_SIGMA * edge;
	float m[3];

	ewa_tilt(m, shape);
	const double x = (double)m[0], y = (double)m[1], z = (double)m[2], length2 = (x * x + y * y) + z * z;
	const double whole = z * z * (deviation * deviation);
	g->a = (length2 - y * y) / whole;
	g->b = x * y / whole;
	g->c = (length2 - x * x) / whole;
}

/* Writes a mask, and returns the least weight of its core. */
static unsigned write_mask(uint8_t weight[], const struct ewa_size *size, uint32_t shape, uint32_t sector)
{
	const int radius = (int)size->radius;
	const double right = sector & 1 ? 0.25 : -0.25, down = sector & 2 ? 0.25 : -0.25;
	struct bell g;
	double most = 0;

	make_bell(&g, shape, (double)size->edge);
	for (int y = -radius; y <= radius; y++) {
		putchar('\n');
		for (int x = -radius; x <= radius; x++, weight++) {
			const double mean = mean_in_pixel(&g, x - right, y - down);

			*weight = (uint8_t)(255 * mean + 0.5);
			printf("%d,", *weight);
			most = mean > most ? mean : most;
		}
	}
	const int core = (int)(255 * CORE * most + 0.5);
	return core > 1 ? (unsigned)core : 1;
}

/* The pixels of a core, as bits. */
static uint32_t core_bits(const uint8_t weight[], const struct ewa_size *size, unsigned least)
{
	const int radius = (int)size->radius, reach = (int)size->core_radius, side = EWA_SIDE(radius);
	uint32_t bits = 0;

	for (int y = -reach; y <= reach; y++)
		for (int x = -reach; x <= reach; x++)
			bits |= (uint32_t)(weight[(y + radius) * side + x + radius] >= least)
			        << (EWA_CORE_SIDE * (y + EWA_CORE_RADIUS) + x + EWA_CORE_RADIUS);
	return bits;
}

static void write_numbers(const char *name, const uint32_t number[], uint32_t n)
{
	printf("\n};\nconst %s = {", name);
	for (uint32_t i = 0; i < n; i++)
		printf("%s%lu,", i % 32 == 0 ? "\n" : "", (unsigned long)number[i]);
}

int main(void)
{
	static uint8_t weight[EWA_SIDE(EWA_MOST_RADIUS) * EWA_SIDE(EWA_MOST_RADIUS)];
	static uint32_t core[EWA_MASKS], bits[EWA_NARROW_MASKS];
	uint32_t first = 0, i = 0;

	printf("#include \"libpsr/simd/ewa_masks.h\"\nconst uint8_t ewa_weight[EWA_BYTES + EWA_BEYOND] = {");
	for (uint32_t k = 0; k < EWA_SIZES; k++)
		for (uint32_t m = 0; m < EWA_SHAPES * EWA_SECTORS; m++, i++) {
			core[i] = write_mask(weight, &sizes[k], m / EWA_SECTORS, m % EWA_SECTORS);
			if (i < EWA_NARROW_MASKS)
				bits[i] = core_bits(weight, &sizes[k], core[i]);
		}
	write_numbers("uint8_t ewa_core[EWA_MASKS]", core, EWA_MASKS);
	write_numbers("uint32_t ewa_core_bits[EWA_NARROW_MASKS]", bits, EWA_NARROW_MASKS);
	printf("\n};\nconst uint8_t ewa_bell[EWA_BELL] = {");
	for (i = 0; i < EWA_BELL; i++)
		printf("%s%d,", i % 32 == 0 ? "\n" : "", (int)(255 * falling_exp((i + 0.5) / (2 * EWA_STEPS)) + 0.5));
	printf("\n};\nconst struct ewa_size ewa_size[EWA_SIZES] = {\n");
	for (uint32_t k = 0; k < EWA_SIZES; k++) {
		printf("{ %.9gf, %u, %u, %u },\n", (double)sizes[k].edge, (unsigned)sizes[k].radius,
		       (unsigned)sizes[k].core_radius, (unsigned)first);
		first += EWA_SHAPES * EWA_SECTORS * EWA_SIDE(sizes[k].radius) * EWA_SIDE(sizes[k].radius);
	}
	printf("};\n");
	return first == EWA_BYTES && !ferror(stdout) && fflush(stdout) == 0 ? 0 : 1;
}
