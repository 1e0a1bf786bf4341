#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include "picture.h"

static void on_png_error(png_structp png, png_const_charp message)
{
	psr_fail(png_get_error_ptr(png), PSR_ERR_IO, "libpng: %s", message);
	longjmp(png_jmpbuf(png), 1);
}

static void on_png_warning(png_structp png, png_const_charp message)
{
	(void)png;
	(void)message;
}

static void on_png_write(png_structp png, png_bytep data, size_t n)
{
	outfile_write(png_get_io_ptr(png), data, n);
}

static void on_png_flush(png_structp png)
{
	(void)png;
}

int picture_write_png(struct outfile *file, const struct psr_picture *picture, struct psr_error *err)
{
	struct psr_error why = { .code = PSR_OK };
	png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &why, on_png_error, on_png_warning);
	png_infop info = png != NULL ? png_create_info_struct(png) : NULL;

	if (info == NULL) {
		png_destroy_write_struct(&png, NULL);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to write a PNG");
	}
	if (setjmp(png_jmpbuf(png)) != 0) {
		png_destroy_write_struct(&png, &info);
		return psr_fail(err, why.code, "%s", why.text);
	}
	png_set_write_fn(png, file, on_png_write, on_png_flush);
	png_set_IHDR(png, info, picture->width, picture->height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
	             PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
	png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
	png_write_info(png, info);
	for (uint32_t y = 0; y < picture->height; y++)
		png_write_row(png, picture->rgb + (size_t)y * picture->width * 3);
	png_write_end(png, info);
	png_destroy_write_struct(&png, &info);
	return PSR_OK;
}
