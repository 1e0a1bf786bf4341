#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>
#include "internal.h"

struct client_decoder {
	tjhandle jpeg;
	ZSTD_DCtx *zstd;
	uint8_t *coded;  /* rows after the filter */
	uint8_t *pixels; /* rows before it */
	uint8_t *depth;  /* as float, decoded from u16 */
	size_t coded_capacity, pixels_capacity, depth_capacity;
};

/* Describes a rectangle's data. */
struct pixel_shape {
	uint32_t width, height;
	unsigned pixel, component; /* bytes */
};

int client_decoder_create(struct client_decoder **out)
{
	struct client_decoder *decoder = calloc(1, sizeof *decoder);

	if (decoder == NULL)
		return PSR_ERR_MEMORY;
	decoder->jpeg = tjInitDecompress();
	decoder->zstd = ZSTD_createDCtx();
	if (decoder->jpeg == NULL || decoder->zstd == NULL) {
		client_decoder_destroy(decoder);
		return PSR_ERR_MEMORY;
	}
	*out = decoder;
	return PSR_OK;
}

void client_decoder_destroy(struct client_decoder *decoder)
{
	if (decoder == NULL)
		return;
	if (decoder->jpeg != NULL)
		tjDestroy(decoder->jpeg);
	ZSTD_freeDCtx(decoder->zstd);
	free(decoder->coded);
	free(decoder->pixels);
	free(decoder->depth);
	free(decoder);
}

static int reserve(uint8_t **buffer, size_t *capacity, size_t n, struct psr_error *err)
{
	if (*capacity >= n)
		return PSR_OK;
	free(*buffer);
	*buffer = malloc(n);
	*capacity = *buffer == NULL ? 0 : n;
	return *buffer == NULL ? psr_fail(err, PSR_ERR_MEMORY, "no memory for a rectangle of %zu bytes", n) : PSR_OK;
}

/* Returns how many data pixels a side has before it is enlarged `scale` times. */
static uint32_t coded_side(uint32_t side, uint32_t scale)
{
	return (side + scale - 1u) / scale;
}

static int decode_jpeg(struct client_decoder *decoder, uint8_t *pixels, size_t pitch, const struct psr_msg_rect *rect,
                       const uint8_t *data, struct psr_error *err)
{
	const uint32_t width = coded_side(rect->w, rect->scale), height = coded_side(rect->h, rect->scale);
	int w, h, sampling, space;

	if (tjDecompressHeader3(decoder->jpeg, data, rect->total, &w, &h, &sampling, &space) != 0)
		return psr_fail(err, PSR_ERR_PROTOCOL, "a JPEG rectangle cannot be read: %.200s",
		                tjGetErrorStr2(decoder->jpeg));
	if (w != (int)width || h != (int)height)
		return psr_fail(err, PSR_ERR_PROTOCOL, "a rectangle of %ux%u pixels holds a JPEG of %dx%d", width, height, w,
		                h);
	if (tjDecompress2(decoder->jpeg, data, rect->total, pixels, w, (int)pitch, h, TJPF_RGB,
	                  TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS)
	    != 0)
		return psr_fail(err, PSR_ERR_PROTOCOL, "a JPEG rectangle is damaged: %.200s", tjGetErrorStr2(decoder->jpeg));
	return PSR_OK;
}

static int decode_zstd(struct client_decoder *decoder, uint8_t *out, size_t n_out, const uint8_t *data, size_t n,
                       struct psr_error *err)
{
	size_t used;

	if (ZSTD_getFrameContentSize(data, n) != n_out || ZSTD_findFrameCompressedSize(data, n) != n)
		return psr_fail(err, PSR_ERR_PROTOCOL, "a zstd rectangle is not one frame of %zu bytes", n_out);
	used = ZSTD_decompressDCtx(decoder->zstd, out, n_out, data, n);
	if (ZSTD_isError(used) || used != n_out)
		return psr_fail(err, PSR_ERR_PROTOCOL, "a zstd rectangle is damaged: %s",
		                ZSTD_isError(used) ? ZSTD_getErrorName(used) : "too short");
	return PSR_OK;
}

/* Inlined once for each size of a pixel, which leaves plain moves. */
static inline void enlarge_row(uint8_t *to, const uint8_t *from, uint32_t width, uint32_t scale, size_t pixel)
{
	uint32_t x = 0;

	for (; x + scale <= width; x += scale, from += pixel)
		for (uint32_t k = 0; k < scale; k++)
			memcpy(to + (x + k) * pixel, from, pixel);
	for (; x < width; x++)
		memcpy(to + x * pixel, from, pixel);
}

static void copy_row(uint8_t *to, const uint8_t *from, uint32_t width, uint32_t scale, size_t pixel)
{
	if (scale == 1) {
		memcpy(to, from, width * pixel);
		return;
	}
	switch (pixel) {
	case 1: enlarge_row(to, from, width, scale, 1); break;
	case 2: enlarge_row(to, from, width, scale, 2); break;
	case 3: enlarge_row(to, from, width, scale, 3); break;
	case 4: enlarge_row(to, from, width, scale, 4); break;
	case 6: enlarge_row(to, from, width, scale, 6); break;
	default: enlarge_row(to, from, width, scale, pixel);
	}
}

static void copy_pixels(uint8_t *to, size_t pitch, const uint8_t *from, const struct psr_msg_rect *rect,
                        uint32_t data_width, size_t pixel)
{
	for (uint32_t y = 0; y < rect->h; y++)
		if (y % rect->scale == 0)
			copy_row(to + y * pitch, from + (size_t)(y / rect->scale) * data_width * pixel, rect->w, rect->scale, pixel);
		else
			memcpy(to + y * pitch, to + (y - 1) * pitch, rect->w * pixel);
}

/* Returns the rectangle's data pixels after their codec, in rows without gaps. */
static int decode_pixels(const uint8_t **out, struct client_decoder *decoder, const struct psr_msg_rect *rect,
                         const uint8_t *data, const struct pixel_shape *shape, struct psr_error *err)
{
	const size_t raw = (size_t)shape->width * shape->height * shape->pixel;
	int code;

	*out = data;
	if (rect->codec == PSR_CODEC_RAW)
		return PSR_OK;
	code = reserve(&decoder->pixels, &decoder->pixels_capacity, raw, err);
	if (code != PSR_OK)
		return code;
	*out = decoder->pixels;
	if (rect->codec == PSR_CODEC_JPEG)
		return decode_jpeg(decoder, decoder->pixels, shape->width * shape->pixel, rect, data, err);
	code = reserve(&decoder->coded, &decoder->coded_capacity, raw, err);
	if (code == PSR_OK)
		code = decode_zstd(decoder, decoder->coded, raw, data, rect->total, err);
	if (code == PSR_OK)
		psr_unfilter_rows(decoder->pixels, decoder->coded, shape->width, shape->height, shape->pixel / shape->component,
		                  shape->component);
	return code;
}

static int restore_depth(const uint8_t **pixels, struct client_decoder *decoder, const struct psr_msg_frame *asked,
                         size_t n, struct psr_error *err)
{
	const struct psr_depth_range range = psr_depth_range_of(asked);
	uint8_t *z;
	int code = reserve(&decoder->depth, &decoder->depth_capacity, n * (sizeof(float) + sizeof(uint16_t)), err);

	if (code != PSR_OK)
		return code;
	z = decoder->depth;
	memcpy(z + n * sizeof(float), *pixels, n * sizeof(uint16_t)); /* in a message they are not aligned */
	psr_depth_restore((float *)z, (const uint16_t *)(z + n * sizeof(float)), n, &range);
	*pixels = z;
	return PSR_OK;
}

int client_decode(struct client_decoder *decoder, struct psr_frame *picture, const struct psr_msg_frame *asked,
                  const struct psr_msg_rect *rect, const uint8_t *data, struct psr_error *err)
{
	const size_t pixel = psr_plane_bytes(rect->plane), pitch = (size_t)picture->width * pixel;
	const struct pixel_shape shape = {
		.width = coded_side(rect->w, rect->scale), .height = coded_side(rect->h, rect->scale),
		.pixel = psr_plane_pixel_bytes(rect->plane, asked->depth_format),
		.component = psr_plane_component_bytes(rect->plane, asked->depth_format),
	};
	uint8_t *plane = psr_frame_plane(picture, rect->plane), *to = plane + rect->y * pitch + rect->x * pixel;
	const uint8_t *pixels;
	int code;

	assert(plane != NULL);
	if (rect->codec == PSR_CODEC_JPEG && rect->scale == 1)
		return decode_jpeg(decoder, to, pitch, rect, data, err);
	code = decode_pixels(&pixels, decoder, rect, data, &shape, err);
	if (code == PSR_OK && rect->plane == PSR_PLANE_DEPTH && asked->depth_format != PSR_WIRE_DEPTH_F32)
		code = restore_depth(&pixels, decoder, asked, (size_t)shape.width * shape.height, err);
	if (code == PSR_OK)
		copy_pixels(to, pitch, pixels, rect, shape.width, pixel);
	return code;
}
