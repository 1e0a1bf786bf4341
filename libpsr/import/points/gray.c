#include <math.h>
#include <stdlib.h>
#include "gray.h"
#include "base/srgb.h"

#define MOST 65536
#define BRIGHT 0.99 /* share of intensities below white */

int gray_begin(struct gray *gray)
{
	*gray = (struct gray){ .stride = 1 };
	gray->value = malloc(MOST * sizeof *gray->value);
	return gray->value != NULL;
}

void gray_note(struct gray *gray, double intensity)
{
	if (!isfinite(intensity) || gray->seen++ % gray->stride != 0)
		return;
	gray->value[gray->n++] = intensity;
	if (gray->n < MOST)
		return;
	gray->n = MOST / 2;
	gray->stride *= 2;
	for (size_t i = 0; i < gray->n; i++)
		gray->value[i] = gray->value[2 * i];
}

static int by_value(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

void gray_end(struct gray *gray)
{
	double white;

	if (gray->n > 0) {
		qsort(gray->value, gray->n, sizeof *gray->value, by_value);
		gray->black = fmin(gray->value[0], 0.0);
		white = gray->value[(size_t)ceil(BRIGHT * (double)(gray->n - 1))];
		gray->scale = white > gray->black ? 1.0 / (white - gray->black) : 0.0;
		gray->scale = isfinite(gray->scale) ? gray->scale : 0.0;
	}
	gray_fini(gray);
}

void gray_fini(struct gray *gray)
{
	free(gray->value);
	gray->value = NULL;
}

uint8_t gray_code(const struct gray *gray, double intensity)
{
	return psr_linear_to_srgb((float)((intensity - gray->black) * gray->scale));
}
