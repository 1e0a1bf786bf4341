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
	size_t coded_capacity, pixels_capacity;
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

/* Pixels on a side before they are drawn `scale` times as large. */
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

static void copy_pixels(uint8_t *to, size_t pitch, const uint8_t *from, const struct psr_msg_rect *rect,
                        uint32_t data_width, size_t pixel)
{
	for (uint32_t y = 0; y < rect->h; y++) {
		const uint8_t *row = from + (size_t)(y / rect->scale) * data_width * pixel;

		if (rect->scale == 1)
			memcpy(to + y * pitch, row, rect->w * pixel);
		else
			for (uint32_t x = 0; x < rect->w; x++)
				memcpy(to + y * pitch + x * pixel, row + x / rect->scale * pixel, pixel);
	}
}

int client_decode(struct client_decoder *decoder, struct psr_frame *picture, const struct psr_msg_rect *rect,
                  const uint8_t *data, struct psr_error *err)
{
	unsigned component = psr_plane_component_bytes(rect->plane, PSR_WIRE_DEPTH_F32);
	int code;
	uint32_t width = coded_side(rect->w, rect->scale), height = coded_side(rect->h, rect->scale);
	const size_t pixel = psr_plane_pixel_bytes(rect->plane, PSR_WIRE_DEPTH_F32);
	const size_t raw = (size_t)width * height * pixel, pitch = (size_t)picture->width * pixel;
	uint8_t *plane = psr_frame_plane(picture, rect->plane), *to = plane + rect->y * pitch + rect->x * pixel;

	assert(plane != NULL);
	if (rect->codec == PSR_CODEC_RAW) {
		copy_pixels(to, pitch, data, rect, width, pixel);
		return PSR_OK;
	}
	if (rect->codec == PSR_CODEC_JPEG && rect->scale == 1)
		return decode_jpeg(decoder, to, pitch, rect, data, err);
	code = reserve(&decoder->pixels, &decoder->pixels_capacity, raw, err);
	if (code != PSR_OK)
		return code;
	if (rect->codec == PSR_CODEC_JPEG) {
		code = decode_jpeg(decoder, decoder->pixels, width * pixel, rect, data, err);
	} else {
		code = reserve(&decoder->coded, &decoder->coded_capacity, raw, err);
		if (code == PSR_OK)
			code = decode_zstd(decoder, decoder->coded, raw, data, rect->total, err);
		if (code == PSR_OK)
			psr_unfilter_rows(decoder->pixels, decoder->coded, width, height, (unsigned)pixel / component, component);
	}
	if (code == PSR_OK)
		copy_pixels(to, pitch, decoder->pixels, rect, width, pixel);
	return code;
}
