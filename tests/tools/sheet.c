/* sheet COLUMNS OUT.png IN.png...: a contact sheet of pictures, each box-filtered to half its size, in linear light. */
#include <png.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct picture {
	png_image image;
	uint16_t *rgb; /* linear, 16 bits */
};

static void die(const char *what, const char *file)
{
	fprintf(stderr, "sheet: %s: %s\n", file, what);
	exit(3);
}

static struct picture load(const char *path)
{
	struct picture p;
	memset(&p.image, 0, sizeof p.image);
	p.image.version = PNG_IMAGE_VERSION;
	if (!png_image_begin_read_from_file(&p.image, path))
		die(p.image.message, path);
	p.image.format = PNG_FORMAT_LINEAR_RGB;
	p.rgb = malloc(PNG_IMAGE_SIZE(p.image));
	if (!p.rgb || !png_image_finish_read(&p.image, NULL, p.rgb, 0, NULL))
		die(p.rgb ? p.image.message : "no memory", path);
	return p;
}

static void paste_half(const struct picture *from, uint16_t *to, uint32_t stride)
{
	for (uint32_t y = 0; y < from->image.height / 2; y++)
		for (uint32_t x = 0; x < from->image.width / 2; x++)
			for (uint32_t k = 0; k < 3; k++) {
				const uint16_t *a = from->rgb + 3 * ((size_t)2 * y * from->image.width + 2 * x) + k;
				const uint16_t *b = a + 3 * from->image.width;
				to[3 * ((size_t)y * stride + x) + k] = (uint16_t)((a[0] + a[3] + b[0] + b[3] + 2) / 4);
			}
}

int main(int argc, char **argv)
{
	if (argc < 4 || atoi(argv[1]) < 1) {
		fprintf(stderr, "usage: sheet COLUMNS OUT.png IN.png...\n");
		return 2;
	}
	uint32_t columns = (uint32_t)atoi(argv[1]), n = (uint32_t)argc - 3, w = 0, h = 0;
	if (columns > n)
		columns = n;
	struct picture *picture = calloc(n, sizeof *picture);
	for (uint32_t i = 0; picture && i < n; i++) {
		picture[i] = load(argv[3 + i]);
		w = picture[i].image.width / 2 > w ? picture[i].image.width / 2 : w;
		h = picture[i].image.height / 2 > h ? picture[i].image.height / 2 : h;
	}
	png_image out;
	memset(&out, 0, sizeof out);
	out.version = PNG_IMAGE_VERSION;
	out.format = PNG_FORMAT_LINEAR_RGB;
	out.width = columns * w;
	out.height = (n + columns - 1) / columns * h;
	uint16_t *rgb = picture ? malloc(PNG_IMAGE_SIZE(out)) : NULL;
	if (!rgb)
		die("no memory", argv[2]);
	memset(rgb, 0xff, PNG_IMAGE_SIZE(out));
	for (uint32_t i = 0; i < n; i++) {
		paste_half(&picture[i], rgb + 3 * ((size_t)(i / columns) * h * out.width + (size_t)(i % columns) * w),
		           out.width);
		free(picture[i].rgb);
	}
	if (!png_image_write_to_file(&out, argv[2], 1, rgb, 0, NULL))
		die(out.message, argv[2]);
	free(rgb);
	free(picture);
	return 0;
}
