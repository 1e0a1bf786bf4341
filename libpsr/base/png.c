#include "png.h"
#include <setjmp.h>

static void on_error(png_structp png, png_const_charp message)
{
	psr_fail(png_get_error_ptr(png), PSR_ERR_IO, "libpng: %s", message);
	longjmp(png_jmpbuf(png), 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
	(void)png;
	(void)message;
}

static void on_flush(png_structp png)
{
	(void)png;
}

png_structp png_writer_create(png_infop *info, struct psr_error *why)
{
	png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, why, on_error, on_warning);

	*info = png != NULL ? png_create_info_struct(png) : NULL;
	if (*info == NULL)
		png_destroy_write_struct(&png, NULL);
	return png;
}

void png_writer_begin(png_structp png, png_infop info, void *sink, png_rw_ptr write, const struct psr_frame *frame)
{
	png_set_write_fn(png, sink, write, on_flush);
	png_set_IHDR(png, info, frame->width, frame->height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
	             PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
	png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
	png_write_info(png, info);
}

void png_write_outfile(png_structp png, png_bytep data, size_t n)
{
	outfile_write(png_get_io_ptr(png), data, n);
}

int png_encode(void *sink, png_rw_ptr write, const struct psr_frame *frame, struct psr_error *err)
{
	struct psr_error why = { .code = PSR_OK };
	png_infop info;
	png_structp png = png_writer_create(&info, &why);

	if (png == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to write a PNG");
	if (setjmp(png_jmpbuf(png)) != 0) {
		png_destroy_write_struct(&png, &info);
		return psr_fail(err, why.code, "%s", why.text);
	}
	png_writer_begin(png, info, sink, write, frame);
	for (uint32_t y = 0; y < frame->height; y++)
		png_write_row(png, frame->rgb + (size_t)y * frame->width * 3);
	png_write_end(png, info);
	png_destroy_write_struct(&png, &info);
	return PSR_OK;
}

int png_write_frame(struct outfile *file, const struct psr_frame *frame, struct psr_error *err)
{
	return png_encode(file, png_write_outfile, frame, err);
}

int psr_image_write(const struct psr_frame *frame, const char *path, struct psr_error *err)
{
	struct outfile file;
	int code;

	if (frame->rgb == NULL)
		return psr_fail(err, PSR_ERR_ARG, "the frame has no colour to write to %.300s; draw PSR_PLANE_COLOR", path);
	code = outfile_open(&file, path, OUTFILE_PLAIN, err);
	if (code != PSR_OK)
		return code;
	return outfile_close(&file, png_write_frame(&file, frame, err), err);
}
