#include "compare.h"

#include <png.h>
#include <stdlib.h>
#include <string.h>
#include "report.h"

static int is_drawn(const uint8_t *pixel)
{
	return (pixel[0] | pixel[1] | pixel[2]) != 0;
}

struct compare compare_pictures(const uint8_t *a, const uint8_t *b, uint32_t width, uint32_t height)
{
	uint64_t n_both = 0, n_either = 0, sum = 0;

	for (size_t i = 0; i < (size_t)width * height; i++, a += 3, b += 3) {
		int most = 0;

		n_either += is_drawn(a) || is_drawn(b);
		if (!is_drawn(a) || !is_drawn(b))
			continue;
		n_both++;
		for (int c = 0; c < 3; c++)
			most = abs(a[c] - b[c]) > most ? abs(a[c] - b[c]) : most;
		sum += (uint64_t)most;
	}
	return (struct compare){ report_ratio((double)n_both, (double)n_either),
		                     report_ratio((double)sum, (double)n_both) };
}

double compare_covered(const uint8_t *rgb, uint32_t width, uint32_t height)
{
	uint64_t n = 0;

	for (size_t i = 0; i < (size_t)width * height; i++)
		n += (uint64_t)is_drawn(rgb + 3 * i);
	return (double)n / ((double)width * height);
}

void compare_save(const char *path, const uint8_t *rgb, uint32_t width, uint32_t height)
{
	png_image image;

	memset(&image, 0, sizeof image);
	image.version = PNG_IMAGE_VERSION;
	image.width = width;
	image.height = height;
	image.format = PNG_FORMAT_RGB;
	if (!png_image_write_to_file(&image, path, 0, rgb, 0, NULL))
		report_die(path, image.message);
}
