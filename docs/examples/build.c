/* build MODEL.psr: builds a model of arrays, a cushion of 64 x 64 squares in red, and writes it.
 * cc build.c $(pkg-config --cflags --libs psr-build) -lm -o build */
#include <math.h>
#include <stdio.h>
#include <psr/build.h>

#define N 64

static double position[(N + 1) * (N + 1)][3];
static uint32_t triangle[2 * N * N][3];

int main(int argc, char **argv)
{
	struct psr_mesh *mesh = NULL;
	struct psr_model *model = NULL;
	struct psr_build_options options;
	struct psr_error err;
	uint32_t n = 0;

	for (uint32_t i = 0; i < (N + 1) * (N + 1); i++) {
		const double x = i % (N + 1) * 2.0 / N - 1, z = i / (N + 1) * 2.0 / N - 1;

		position[i][0] = x, position[i][1] = 0.5 * cos(x) * cos(z), position[i][2] = z;
	}
}
