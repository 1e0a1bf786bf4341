/* Frames from the codec to the client's assembly, without sockets. */
#ifndef TESTS_UNIT_SERVER_TRIP_H
#define TESTS_UNIT_SERVER_TRIP_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "client/lib/internal.h"
#include "server/frames/codec.h"

#define TRIP_ALL ((1u << PSR_N_PLANES) - 1)
#define TRIP_RECTS 4096

static const uint8_t trip_background[3] = { 10, 20, 30 };
static uint64_t trip_random = 11;

struct trip {
	struct codec *codec;
	struct client_decoder *decoder;
	struct psr_pool *pool;
	struct psr_msg_frame request;
	uint32_t scale;
	struct psr_frame drawn;      /* 1 / scale of the request's size */
	struct codec_parts *base, *parts; /* of the frame before; of this one */
	struct client_held held;     /* the client's picture, once there is one; lossy as of the last frame */
	struct client_assembly assembly;
	struct codec_result result;
	unsigned checked;
	struct psr_msg_rect rect[TRIP_RECTS]; /* that came, without data; the first of pieces */
	size_t n_rects;
};

static inline void trip_init(struct trip *trip)
{
	memset(trip, 0, sizeof *trip);
	assert_int_equal(codec_create(&trip->codec), PSR_OK);
	assert_int_equal(client_decoder_create(&trip->decoder), PSR_OK);
	trip->scale = 1;
}

static inline void trip_fini(struct trip *trip)
{
	codec_destroy(trip->codec);
	client_decoder_destroy(trip->decoder);
	psr_frame_free(&trip->drawn);
	psr_frame_free(&trip->held.picture);
	free(trip->base);
	free(trip->parts);
}

/* All codecs lose nothing; depth is float. */
static inline void trip_ask(struct trip *trip, uint32_t width, uint32_t height, uint32_t planes)
{
	trip->request = (struct psr_msg_frame){ .width = width, .height = height, .planes = planes,
		                                    .camera.kind = PSR_CAMERA_PERSPECTIVE };
	if (planes & 1u << PSR_PLANE_COLOR)
		trip->request.color_codec = PSR_CODEC_ZSTD;
	if (planes & 1u << PSR_PLANE_DEPTH) {
		trip->request.depth_format = PSR_WIRE_DEPTH_F32;
		trip->request.depth_codec = PSR_CODEC_ZSTD;
	}
	if (planes & ~3u)
		trip->request.data_codec = PSR_CODEC_ZSTD;
}

static inline const uint8_t *trip_empty(unsigned plane)
{
	return plane == PSR_PLANE_COLOR ? trip_background : psr_plane_background(plane);
}

/* A rectangle of background, of one value, or of noise. Depth stays between 1 and 2. */
static inline void trip_paint(const struct psr_frame *frame, unsigned plane, uint32_t x, uint32_t y, uint32_t w,
                              uint32_t h)
{
	const size_t pixel = psr_plane_bytes(plane);
	const uint32_t kind = random_below(&trip_random, 3);
	uint64_t value = random_next(&trip_random);

	for (uint32_t i = 0; i < w * h; i++) {
		uint8_t *at = (uint8_t *)psr_frame_plane(frame, plane) + ((size_t)(y + i / w) * frame->width + x + i % w) * pixel;
		float z;

		if (kind == 2)
			value = random_next(&trip_random);
		z = 1 + (float)(value >> 48) / 65536;
		memcpy(at, kind == 0 ? (const void *)trip_empty(plane) : plane == PSR_PLANE_DEPTH ? (void *)&z : (void *)&value,
		       pixel);
	}
}

/* A whole picture of patches, as large as the request says. */
static inline void trip_draw(struct trip *trip)
{
	const uint32_t width = trip->request.width / trip->scale, height = trip->request.height / trip->scale;

	psr_frame_free(&trip->drawn);
	assert_int_equal(psr_frame_alloc(&trip->drawn, width, height, trip->request.planes, NULL), PSR_OK);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		for (uint32_t y = 0; y < height && trip->request.planes >> plane & 1; y += 50)
			for (uint32_t x = 0; x < width; x += 90)
				trip_paint(&trip->drawn, plane, x, y, width - x < 90 ? width - x : 90, height - y < 50 ? height - y : 50);
}

static inline void trip_emit(struct outq_chunk *first, void *userdata)
{
	struct trip *trip = userdata;

	for (struct outq_chunk *chunk = first; chunk != NULL; chunk = chunk->next) {
		for (size_t at = 0; at < chunk->size;) {
			const uint8_t *message = chunk->data + at;
			const uint32_t length = message[0] | (uint32_t)message[1] << 8 | (uint32_t)message[2] << 16;
			struct psr_error err = { 0 };
			struct psr_msg_rect rect;

			assert_int_equal(
				psr_msg_rect_decode(&rect, message + PSR_HEADER_SIZE, length - PSR_HEADER_SIZE, NULL), PSR_OK);
			if (client_assembly_rect(&trip->assembly, trip->decoder, &rect, &err) != PSR_OK)
				fail_msg("%s", err.text);
			if (rect.offset == 0 && trip->n_rects < TRIP_RECTS)
				trip->rect[trip->n_rects++] = rect;
			at += length;
		}
	}
	outq_chunks_destroy(first);
}

/* Codes what is drawn and assembles it; on the frame before, if that is asked for and fits. Returns whether it was. */
static inline int trip_go(struct trip *trip, int on_base)
{
	const struct psr_msg_frame *request = &trip->request;
	struct psr_msg_frame_begin begin = {
		.width = request->width, .height = request->height, .planes = request->planes,
		.color_codec = request->color_codec, .color_quality = request->color_quality,
		.depth_format = request->depth_format, .depth_codec = request->depth_codec, .data_codec = request->data_codec,
		.background = { trip_background[0], trip_background[1], trip_background[2] },
		.settings = { .scale = (uint8_t)trip->scale }, .depth_min = request->depth_min, .depth_max = request->depth_max,
	};
	struct codec_answer answer = {
		.id = 9, .view = 1, .request = request, .scale = trip->scale, .background = trip_background, .emit = trip_emit,
		.userdata = trip,
	};
	struct psr_msg_frame_end end = { .is_final = 1, .planes = request->planes,
		                             .has_hashes = !(request->flags & PSR_WIRE_FRAME_NO_HASHES) };
	struct psr_error err = { 0 };

	free(trip->base);
	trip->base = trip->parts;
	trip->parts = codec_parts_create(request->width, request->height, request->planes);
	on_base = on_base && trip->base != NULL && codec_parts_fit(trip->base, request, trip->scale);
	answer.base = on_base ? trip->base : NULL;
	answer.parts = trip->parts;
	begin.base = on_base ? 8 : 0;
	trip->n_rects = 0;
	client_assembly_init(&trip->assembly, request, 0);
	assert_int_equal(client_assembly_begin(&trip->assembly, &begin, on_base ? &trip->held : NULL, &err), PSR_OK);
	assert_int_equal(codec_encode(&trip->result, trip->codec, trip->pool, &answer, &trip->drawn, &err), PSR_OK);
	memcpy(end.hash, trip->result.hash, sizeof end.hash);
	if (client_assembly_end(&trip->assembly, &end, &trip->checked, &err) != PSR_OK)
		fail_msg("%s", err.text);
	psr_frame_free(&trip->held.picture);
	trip->held = (struct client_held){ .is_acked = 1, .begin = begin, .lossy = trip->assembly.lossy,
		                               .picture = trip->assembly.picture };
	memset(&trip->assembly.picture, 0, sizeof trip->assembly.picture);
	client_assembly_fini(&trip->assembly);
	return on_base;
}

/* The client's pixel. */
static inline const uint8_t *trip_got(const struct trip *trip, unsigned plane, uint32_t x, uint32_t y)
{
	const struct psr_frame *picture = &trip->held.picture;

	return (const uint8_t *)psr_frame_plane(picture, plane) + ((size_t)y * picture->width + x) * psr_plane_bytes(plane);
}

/* The drawn pixel that it shows. */
static inline const uint8_t *trip_drawn(const struct trip *trip, unsigned plane, uint32_t x, uint32_t y)
{
	return (const uint8_t *)psr_frame_plane(&trip->drawn, plane)
	       + ((size_t)(y / trip->scale) * trip->drawn.width + x / trip->scale) * psr_plane_bytes(plane);
}

/* Whether the client has exactly what was drawn. */
static inline int trip_is_exact(const struct trip *trip, unsigned plane)
{
	for (uint32_t y = 0; y < trip->request.height; y++)
		for (uint32_t x = 0; x < trip->request.width; x++)
			if (memcmp(trip_got(trip, plane, x, y), trip_drawn(trip, plane, x, y), psr_plane_bytes(plane)) != 0)
				return 0;
	return 1;
}

static inline void trip_expect_exact(const struct trip *trip)
{
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (trip->request.planes >> plane & 1 && !trip_is_exact(trip, plane))
			fail_msg("plane %u of a picture of %ux%u differs", plane, trip->request.width, trip->request.height);
}

#endif
