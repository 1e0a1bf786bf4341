#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>
#include "base/mem.h"
#include "codec.h"
#include "codec_rect.h"

#define ZSTD_LEVEL 1
#define RECT_HEAD (PSR_HEADER_SIZE + 24) /* bytes of a RECT message before its data */

struct room {
	uint8_t *bytes;
	size_t capacity;
};

struct encoder {
	struct encoder *next;
	tjhandle jpeg;
	ZSTD_CCtx *zstd;
	struct room coding, scratch;
};

struct codec {
	pthread_mutex_t mutex;
	struct encoder *idle;
};

int codec_create(struct codec **out)
{
	struct codec *codec = calloc(1, sizeof *codec);

	if (codec == NULL)
		return PSR_ERR_MEMORY;
	pthread_mutex_init(&codec->mutex, NULL);
	*out = codec;
	return PSR_OK;
}

static void destroy_encoder(struct encoder *e)
{
	if (e->jpeg != NULL)
		tjDestroy(e->jpeg);
	ZSTD_freeCCtx(e->zstd);
	psr_free(e->coding.bytes);
	psr_free(e->scratch.bytes);
	free(e);
}

void codec_destroy(struct codec *codec)
{
	if (codec == NULL)
		return;
	while (codec->idle != NULL) {
		struct encoder *e = codec->idle;

		codec->idle = e->next;
		destroy_encoder(e);
	}
	pthread_mutex_destroy(&codec->mutex);
	free(codec);
}

struct encoder *codec_take_encoder(struct codec *codec)
{
	struct encoder *e;

	pthread_mutex_lock(&codec->mutex);
	e = codec->idle;
	if (e != NULL)
		codec->idle = e->next;
	pthread_mutex_unlock(&codec->mutex);
	if (e != NULL)
		return e;
	e = calloc(1, sizeof *e);
	if (e == NULL)
		return NULL;
	e->jpeg = tjInitCompress();
	e->zstd = ZSTD_createCCtx();
	if (e->jpeg == NULL || e->zstd == NULL) {
		destroy_encoder(e);
		return NULL;
	}
	return e;
}

void codec_put_encoder(struct codec *codec, struct encoder *e)
{
	pthread_mutex_lock(&codec->mutex);
	e->next = codec->idle;
	codec->idle = e;
	pthread_mutex_unlock(&codec->mutex);
}

static uint8_t *reserve(struct room *room, size_t n)
{
	if (room->capacity >= n)
		return room->bytes;
	psr_free(room->bytes);
	room->capacity = 0;
	room->bytes = psr_alloc_array(n, 1);
	if (room->bytes != NULL)
		room->capacity = n;
	return room->bytes;
}

uint8_t *encoder_scratch(struct encoder *e, size_t n)
{
	return reserve(&e->scratch, n);
}

/* Makes the RECTs of a coded rectangle, in one chunk. */
static int put_rects(struct outq_chunk **out, const struct coded_rect *coded, const uint8_t *data)
{
	const size_t total = coded->bytes;
	const size_t n_pieces = (total + PSR_WIRE_MAX_RECT_DATA - 1) / PSR_WIRE_MAX_RECT_DATA;
	struct outq_chunk *chunk = outq_chunk_create(total + n_pieces * RECT_HEAD);
	struct psr_buf buf;

	if (chunk == NULL)
		return PSR_ERR_MEMORY;
	buf = (struct psr_buf){ .data = chunk->data, .capacity = chunk->capacity };
	for (size_t offset = 0; offset < total; offset += PSR_WIRE_MAX_RECT_DATA) {
		const size_t bytes = total - offset < PSR_WIRE_MAX_RECT_DATA ? total - offset : PSR_WIRE_MAX_RECT_DATA;
		const struct psr_msg_rect rect = {
			.plane = (uint8_t)coded->plane, .codec = (uint8_t)coded->codec, .scale = (uint8_t)coded->scale,
			.x = (uint16_t)coded->x, .y = (uint16_t)coded->y, .w = (uint16_t)coded->w, .h = (uint16_t)coded->h,
			.total = (uint32_t)total, .offset = (uint32_t)offset, .bytes = (uint32_t)bytes, .data = data + offset,
		};

		if (psr_msg_rect_encode(&buf, coded->id, coded->view, &rect, NULL) != PSR_OK) {
			outq_chunks_destroy(chunk);
			return PSR_ERR_INTERNAL;
		}
	}
	chunk->size = buf.size;
	*out = chunk;
	return PSR_OK;
}

static int code_jpeg(const uint8_t **data, struct encoder *e, struct coded_rect *rect)
{
	const int quality = (int)rect->quality, chroma = quality >= CODEC_CHROMA_QUALITY ? TJSAMP_444 : TJSAMP_420;
	unsigned long size = tjBufSize((int)rect->width, (int)rect->height, chroma);
	unsigned char *at = reserve(&e->coding, size);

	if (at == NULL)
		return PSR_ERR_MEMORY;
	if (tjCompress2(e->jpeg, rect->pixels, (int)rect->width, (int)rect->pitch, (int)rect->height, TJPF_RGB, &at, &size,
	                chroma, quality, TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT)
	    != 0)
		return PSR_ERR_INTERNAL;
	*data = at;
	rect->bytes = size;
	return PSR_OK;
}

/* Returns rows without gaps: the pixels themselves, if they have no gaps. */
static const uint8_t *pack(uint8_t *room, const struct coded_rect *rect)
{
	const size_t row = (size_t)rect->width * rect->pixel_bytes;

	if (rect->pitch == row)
		return rect->pixels;
	for (uint32_t y = 0; y < rect->height; y++)
		memcpy(room + y * row, rect->pixels + y * rect->pitch, row);
	return room;
}

static int code_zstd(const uint8_t **data, struct encoder *e, struct coded_rect *rect)
{
	const size_t raw = (size_t)rect->width * rect->height * rect->pixel_bytes, bound = ZSTD_compressBound(raw);
	uint8_t *filtered = reserve(&e->coding, raw + (bound > raw ? bound : raw)), *coded = filtered + raw;

	if (filtered == NULL)
		return PSR_ERR_MEMORY;
	psr_filter_rows(filtered, pack(coded, rect), rect->width, rect->height, rect->pixel_bytes / rect->component_bytes,
	                rect->component_bytes);
	rect->bytes = ZSTD_compressCCtx(e->zstd, coded, bound, filtered, raw, ZSTD_LEVEL);
	*data = coded;
	return ZSTD_isError(rect->bytes) ? PSR_ERR_INTERNAL : PSR_OK;
}

static int code_raw(const uint8_t **data, struct encoder *e, struct coded_rect *rect)
{
	const size_t raw = (size_t)rect->width * rect->height * rect->pixel_bytes;
	uint8_t *room = reserve(&e->coding, raw);

	if (room == NULL)
		return PSR_ERR_MEMORY;
	*data = pack(room, rect);
	rect->codec = PSR_CODEC_RAW;
	rect->bytes = raw;
	return PSR_OK;
}

int encoder_code(struct outq_chunk **out, struct encoder *e, struct coded_rect *rect)
{
	const size_t raw = (size_t)rect->width * rect->height * rect->pixel_bytes;
	const uint8_t *data = NULL;
	int code = PSR_OK;

	rect->bytes = raw;
	if (rect->codec == PSR_CODEC_JPEG)
		code = code_jpeg(&data, e, rect);
	else if (rect->codec == PSR_CODEC_ZSTD)
		code = code_zstd(&data, e, rect);
	if (code == PSR_OK && rect->bytes >= raw)
		code = code_raw(&data, e, rect);
	return code == PSR_OK ? put_rects(out, rect, data) : code;
}
