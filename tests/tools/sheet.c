/* sheet COLUMNS OUT.png IN.png...: a contact sheet of pictures, pixel for pixel, white where there is none. */
#include <png.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct picture {
	png_image image;
	uint8_t *rgb;
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
	p.image.format = PNG_FORMAT_RGB;
	p.rgb = malloc(PNG_IMAGE_SIZE(p.image));
	if (!p.rgb || !png_image_finish_read(&p.image, NULL, p.rgb, 0, NULL))
		die(p.rgb ? p.image.message : "no memory", path);
	return p;
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
		w = picture[i].image.width > w ? picture[i].image.width : w;
		h = picture[i].image.height > h ? picture[i].image.height : h;
	}
	png_image out;
	memset(&out, 0, sizeof out);
	out.version = PNG_IMAGE_VERSION;
	out.format = PNG_FORMAT_RGB;
	out.width = columns * w;
	out.height = (n + columns - 1) / columns * h;
	uint8_t *rgb = picture ? malloc(PNG_IMAGE_SIZE(out)) : NULL;
	if (!rgb)
		die("no memory", argv[2]);
	memset(rgb, 0xff, PNG_IMAGE_SIZE(out));
	for (uint32_t i = 0; i < n; i++) {
		const png_image *image = &picture[i].image;
		uint8_t *cell = rgb + 3 * ((size_t)(i / columns) * h * out.width + (size_t)(i % columns) * w);
		for (uint32_t y = 0; y < image->height; y++)
			memcpy(cell + (size_t)3 * y * out.width, picture[i].rgb + (size_t)3 * y * image->width,
			       (size_t)3 * image->width);
		free(picture[i].rgb);
	}
	if (!png_image_write_to_file(&out, argv[2], 0, rgb, 0, NULL))
		die(out.message, argv[2]);
	free(rgb);
	free(picture);
	return 0;
}
