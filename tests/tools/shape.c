/* shape PICTURE.png: "WIDTH HEIGHT EMPTY RED OTHER TOP BOTTOM UPPER LOWER": pixels of the background #202428, pixels that
 * are clearly red, all others; first and last row of red, and red pixels of its upper and lower half. */
#include <png.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int is_red(const uint8_t *p)
{
	return p[0] > 2 * p[1] && p[0] > 2 * p[2];
}

int main(int argc, char **argv)
{
	png_image image = { .version = PNG_IMAGE_VERSION };
	unsigned long n[3] = { 0, 0, 0 }, half[2] = { 0, 0 };
	unsigned top = 0, bottom = 0;
	uint8_t *rgb;

	if (argc != 2 || !png_image_begin_read_from_file(&image, argv[1]))
		return 2;
	image.format = PNG_FORMAT_RGB;
	rgb = malloc(PNG_IMAGE_SIZE(image));
	if (rgb == NULL || !png_image_finish_read(&image, NULL, rgb, 0, NULL))
		return 2;
	for (unsigned i = 0; i < image.width * image.height; i++) {
		const uint8_t *p = rgb + 3 * i;

		n[memcmp(p, "\x20\x24\x28", 3) == 0 ? 0 : is_red(p) ? 1 : 2]++;
		if (is_red(p)) {
			top = n[1] == 1 ? i / image.width : top;
			bottom = i / image.width;
		}
	}
	for (unsigned i = 0; i < image.width * image.height; i++)
		half[i / image.width > (top + bottom) / 2] += (unsigned)is_red(rgb + 3 * i);
	printf("%u %u %lu %lu %lu %u %u %lu %lu\n", image.width, image.height, n[0], n[1], n[2], top, bottom, half[0], half[1]);
	free(rgb);
	return 0;
}
