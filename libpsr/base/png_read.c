#include <stdlib.h>
#include <string.h>
#include "infile.h"
#include "png.h"

#define MAX_BYTES (UINT64_C(1) << 30)

static int read_pixels(struct psr_frame *frame, png_image *image, const char *path, struct psr_error *err)
{
	int code;

	if (image->format & PNG_FORMAT_FLAG_ALPHA)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%.300s is partly transparent; a picture without alpha is needed", path);
	if (image->width > PSR_MAX_SIDE || image->height > PSR_MAX_SIDE
	    || (uint64_t)image->width * image->height > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "%.300s has %ux%u pixels; a side has at most %d, a picture %u", path,
		                image->width, image->height, PSR_MAX_SIDE, PSR_MAX_PIXELS);
	image->format = PNG_FORMAT_RGB;
	code = psr_frame_alloc(frame, image->width, image->height, 1 << PSR_PLANE_COLOR, err);
	if (code != PSR_OK || png_image_finish_read(image, NULL, frame->rgb, 0, NULL))
		return code;
	psr_frame_free(frame);
	return psr_fail(err, PSR_ERR_FORMAT, "%.300s: %s", path, image->message);
}

int png_read_frame(struct psr_frame *frame, const char *path, struct psr_error *err)
{
	png_image image = { .version = PNG_IMAGE_VERSION };
	uint8_t *bytes;
	size_t n;
	int code = infile_read(&bytes, &n, path, MAX_BYTES, err);

	if (code != PSR_OK)
		return code;
	if (png_image_begin_read_from_memory(&image, bytes, n))
		code = read_pixels(frame, &image, path, err);
	else
		code = psr_fail(err, PSR_ERR_FORMAT, "%.300s is no PNG: %s", path, image.message);
	png_image_free(&image);
	free(bytes);
	return code;
}
