#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include "import/import.h"

/* A bounded source: libpng trusts the file's lengths. */
struct source {
	const uint8_t *bytes;
	size_t n_left;
};

static void on_error(png_structp png, png_const_charp message)
{
	(void)message;
	longjmp(png_jmpbuf(png), 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
	(void)png;
	(void)message;
}

static void on_read(png_structp png, png_bytep data, size_t n)
{
	struct source *source = png_get_io_ptr(png);

	if (n > source->n_left)
		png_error(png, "cut");
	memcpy(data, source->bytes, n);
	source->bytes += n;
	source->n_left -= n;
}

static int is_plain(png_structp png, png_infop info, uint64_t max_pixels)
{
	const uint32_t width = png_get_image_width(png, info), height = png_get_image_height(png, info);
	const int kind = png_get_color_type(png, info);

	return png_get_bit_depth(png, info) == 8 && (kind == PNG_COLOR_TYPE_RGB || kind == PNG_COLOR_TYPE_RGB_ALPHA) &&
	       png_get_interlace_type(png, info) == PNG_INTERLACE_NONE && !png_get_valid(png, info, PNG_INFO_tRNS) &&
	       width <= IMPORT_MAX_IMAGE_SIDE && height <= IMPORT_MAX_IMAGE_SIDE && (uint64_t)width * height <= max_pixels;
}

/* *out survives a longjmp. */
static int read_plain(struct psr_image *out, png_structp png, png_infop info, struct source *source,
                      uint64_t max_pixels)
{
	if (setjmp(png_jmpbuf(png)) != 0)
		return 0;
	png_set_read_fn(png, source, on_read);
	png_read_info(png, info);
	if (!is_plain(png, info, max_pixels))
		return 0;
	out->width = png_get_image_width(png, info);
	out->height = png_get_image_height(png, info);
	out->rgba = malloc((size_t)out->width * out->height * 4);
	if (out->rgba == NULL)
		return 0;
	if (png_get_color_type(png, info) == PNG_COLOR_TYPE_RGB)
		png_set_filler(png, 255, PNG_FILLER_AFTER);
	for (uint32_t y = 0; y < out->height; y++)
		png_read_row(png, out->rgba + (size_t)y * out->width * 4, NULL);
	png_read_end(png, NULL);
	return 1;
}

int import_image_plain_png(struct psr_image *out, const uint8_t *bytes, size_t n_bytes, uint64_t max_pixels)
{
	struct source source = { bytes, n_bytes };
	struct psr_image image = { 0 };
	png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, on_error, on_warning);
	png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
	int is_read = info != NULL && read_plain(&image, png, info, &source, max_pixels);

	png_destroy_read_struct(&png, &info, NULL);
	if (is_read)
		*out = image;
	else
		free(image.rgba);
	return is_read;
}
