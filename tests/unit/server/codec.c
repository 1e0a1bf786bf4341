/* The codec: lossless planes come back bit for bit, strips are whole JPEGs, hashes are those of the planes. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>
#include "base/hash.h"
#include "server/frames/codec.h"

#define WIDTH 333
#define HEIGHT 300 /* strips of 128, 128, 44 rows */
#define PIXELS (WIDTH * HEIGHT)
#define ALL ((1u << PSR_N_PLANES) - 1)

/* By plane, as bytes. */
static uint8_t in[PSR_N_PLANES][8 * PIXELS], out[PSR_N_PLANES][8 * PIXELS];
static uint8_t *const rgb = in[PSR_PLANE_COLOR];
static const struct psr_frame drawn = {
	.width = WIDTH, .height = HEIGHT, .rgb = in[PSR_PLANE_COLOR], .depth = (float *)in[PSR_PLANE_DEPTH],
	.normal = (int16_t *)in[PSR_PLANE_NORMAL], .id = (uint32_t *)in[PSR_PLANE_ID], .weight = in[PSR_PLANE_WEIGHT],
	.words = (uint64_t *)in[PSR_PLANE_WORDS], .block = in[PSR_PLANE_BLOCK],
	.bound = (uint16_t *)in[PSR_PLANE_BOUND],
};
static const uint8_t background[3] = { 10, 20, 30 };

static size_t plane_bytes(unsigned plane)
{
	return (size_t)PIXELS * psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
}

static const uint8_t *empty_pixel(unsigned plane)
{
	return plane == PSR_PLANE_COLOR ? background : psr_plane_background(plane);
}

static void set_depth(int i, float z)
{
	memcpy(in[PSR_PLANE_DEPTH] + 4 * i, &z, 4);
}

enum picture { NOISE, SMOOTH, EMPTY, TOP_EMPTY };

static void paint(enum picture kind)
{
	uint64_t random = 0x2545f4914f6cdd1d;

	for (int i = 0; i < PIXELS; i++) {
		int x = i % WIDTH, y = i / WIDTH, is_empty = kind == EMPTY || (kind == TOP_EMPTY && y < 200);

		random ^= random << 13;
		random ^= random >> 7;
		random ^= random << 17;
		for (int c = 0; c < 3; c++) {
			uint8_t smooth = (uint8_t)(c == 0 ? 255 * x / WIDTH : c == 1 ? 255 * y / HEIGHT : 128);

			rgb[3 * i + c] = is_empty ? background[c] : kind == NOISE ? (uint8_t)(random >> (8 * c)) : smooth;
		}
		set_depth(i, is_empty ? INFINITY : 2 + (float)x / 64 + (float)(kind == NOISE ? random >> 48 : 0));
		for (unsigned plane = PSR_PLANE_NORMAL; plane < PSR_N_PLANES; plane++) {
			unsigned pixel = psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
			uint64_t smooth = (uint64_t)(x / 7 * 3 + y) * 0x0001000100010001, value = kind == NOISE ? random : smooth;

			memcpy(in[plane] + pixel * (unsigned)i, is_empty ? empty_pixel(plane) : (const uint8_t *)&value, pixel);
		}
	}
}

/* What was emitted. */
struct coded {
	struct codec_result result;
	struct outq_chunk *first, **last;
};

static void emit(struct outq_chunk *first, void *userdata)
{
	struct coded *coded = userdata;

	*coded->last = first;
	while (*coded->last != NULL)
		coded->last = &(*coded->last)->next;
}

/* Normal, id and so on have the codec of depth. */
static struct coded encode(unsigned color_codec, unsigned quality, unsigned depth_codec, unsigned planes,
                                  struct psr_pool *pool)
{
	struct psr_msg_frame request = {
		.width = WIDTH, .height = HEIGHT, .planes = planes, .color_codec = (uint8_t)color_codec,
		.color_quality = (uint8_t)quality, .depth_format = PSR_WIRE_DEPTH_F32, .depth_codec = (uint8_t)depth_codec,
		.data_codec = (uint8_t)depth_codec,
	};
	struct coded coded = { .last = &coded.first };
	const struct codec_answer answer = {
		.id = 9, .request = &request, .scale = 1, .background = background, .emit = emit, .userdata = &coded
	};
	struct psr_error error = { 0 };
	struct codec *codec;

	assert_int_equal(codec_create(&codec), PSR_OK);
	assert_int_equal(codec_encode(&coded.result, codec, pool, &answer, &drawn, &error), PSR_OK);
	codec_destroy(codec);
	return coded;
}

static void decode_rect(const struct psr_msg_rect *rect, const uint8_t *coded)
{
	static uint8_t filtered[8 * WIDTH * HASH_STRIP_ROWS], plain[8 * WIDTH * HASH_STRIP_ROWS];
	unsigned pixel = psr_plane_pixel_bytes(rect->plane, PSR_WIRE_DEPTH_F32);
	unsigned component = psr_plane_component_bytes(rect->plane, PSR_WIRE_DEPTH_F32);
	size_t n = (size_t)rect->w * rect->h * pixel;
	uint8_t *to = out[rect->plane];
	int w, h, chroma, space;

	assert_true(rect->x == 0 && rect->w == WIDTH && rect->y % HASH_STRIP_ROWS == 0);
	to += (size_t)rect->y * WIDTH * pixel;
	if (rect->codec == PSR_CODEC_RAW) {
		assert_int_equal(rect->total, n);
		memcpy(to, coded, n);
	} else if (rect->codec == PSR_CODEC_ZSTD) {
		assert_int_equal(ZSTD_getFrameContentSize(coded, rect->total), n);
		assert_int_equal(ZSTD_decompress(filtered, sizeof filtered, coded, rect->total), n);
		psr_unfilter_rows(plain, filtered, rect->w, rect->h, pixel / component, component);
		memcpy(to, plain, n);
	} else {
		tjhandle jpeg = tjInitDecompress();

		assert_int_equal(tjDecompressHeader3(jpeg, coded, rect->total, &w, &h, &chroma, &space), 0);
		assert_true(w == rect->w && h == rect->h);
		assert_int_equal(tjDecompress2(jpeg, coded, rect->total, to, w, 0, h, TJPF_RGB, 0), 0);
		tjDestroy(jpeg);
	}
}

/* Takes the messages apart, pieces of 64 KiB put together; returns the number of rectangles. */
static int decode(struct coded *coded_frame, unsigned *codecs)
{
	static uint8_t coded[16 * WIDTH * HASH_STRIP_ROWS];
	int n = 0;
	uint64_t bytes = 0;

	*codecs = 0;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		unsigned pixel = psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);

		for (unsigned i = 0; i < PIXELS; i++)
			memcpy(out[plane] + pixel * i, empty_pixel(plane), pixel);
	}
	for (struct outq_chunk *chunk = coded_frame->first; chunk != NULL; chunk = chunk->next) {
		for (size_t at = 0; at < chunk->size;) {
			uint32_t length = chunk->data[at] | (uint32_t)chunk->data[at + 1] << 8 | (uint32_t)chunk->data[at + 2] << 16;
			struct psr_msg_rect rect;

			assert_true(length <= PSR_WIRE_MAX_MESSAGE && at + length <= chunk->size);
			assert_int_equal(chunk->data[at + 8], 9);
			assert_int_equal(psr_msg_rect_decode(&rect, chunk->data + at + PSR_HEADER_SIZE, length - PSR_HEADER_SIZE, NULL),
			                 PSR_OK);
			assert_true(rect.total <= sizeof coded);
			memcpy(coded + rect.offset, rect.data, rect.bytes);
			bytes += rect.bytes;
			if (rect.offset + rect.bytes == rect.total) {
				decode_rect(&rect, coded);
				*codecs |= 1u << rect.codec;
				n++;
			}
			at += length;
		}
	}
	assert_true(bytes == coded_frame->result.rect_bytes);
	outq_chunks_destroy(coded_frame->first);
	return n;
}

static void lossless_planes_come_back_bit_for_bit(void **state)
{
	static const enum picture kinds[] = { NOISE, SMOOTH, EMPTY, TOP_EMPTY };
	static const unsigned codecs[] = { PSR_CODEC_RAW, PSR_CODEC_ZSTD };
	unsigned used;

	(void)state;
	for (size_t k = 0; k < 4; k++) {
		for (size_t c = 0; c < 2; c++) {
			struct coded coded;

			paint(kinds[k]);
			coded = encode(codecs[c], 0, codecs[c], ALL, NULL);
			decode(&coded, &used);
			for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
				assert_memory_equal(out[plane], in[plane], plane_bytes(plane));
		}
	}
}

static void hashes_are_those_of_the_planes(void **state)
{
	struct coded coded;
	unsigned used;

	(void)state;
	paint(TOP_EMPTY);
	coded = encode(PSR_CODEC_JPEG, 50, PSR_CODEC_ZSTD, ALL, NULL);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		assert_true(coded.result.hash[plane] == psr_frame_hash(&drawn, plane));
	decode(&coded, &used);
}

static void background_strips_are_left_out(void **state)
{
	struct coded coded;
	unsigned used;

	(void)state;
	paint(EMPTY);
	coded = encode(PSR_CODEC_ZSTD, 0, PSR_CODEC_ZSTD, ALL, NULL);
	assert_true(coded.result.depth_min == 0 && coded.result.depth_max == 0);
	assert_int_equal(decode(&coded, &used), 0);
	paint(TOP_EMPTY); /* 200 of 300 rows: one strip of three, of each plane */
	coded = encode(PSR_CODEC_ZSTD, 0, PSR_CODEC_ZSTD, ALL, NULL);
	assert_int_equal(decode(&coded, &used), 2 * PSR_N_PLANES);
	paint(EMPTY);
	rgb[3 * (128 * WIDTH - 1) + 2] ^= 1; /* the last byte of the first strip */
	coded = encode(PSR_CODEC_RAW, 0, 0, 1, NULL);
	assert_int_equal(decode(&coded, &used), 1);
	assert_memory_equal(out[PSR_PLANE_COLOR], rgb, 3 * PIXELS);
}

static void what_does_not_shrink_travels_raw(void **state)
{
	struct coded coded;
	unsigned used;

	(void)state;
	paint(NOISE);
	coded = encode(PSR_CODEC_ZSTD, 0, 0, 1, NULL);
	decode(&coded, &used);
	assert_int_equal(used, 1u << PSR_CODEC_RAW);
	paint(SMOOTH);
	coded = encode(PSR_CODEC_ZSTD, 0, 0, 1, NULL);
	assert_true(coded.result.rect_bytes < 3 * PIXELS / 4);
	decode(&coded, &used);
	assert_int_equal(used, 1u << PSR_CODEC_ZSTD);
}

static void each_strip_is_a_whole_jpeg(void **state)
{
	struct coded coded;
	unsigned used;
	double sum = 0;

	(void)state;
	paint(SMOOTH);
	coded = encode(PSR_CODEC_JPEG, 95, 0, 1, NULL);
	assert_int_equal(decode(&coded, &used), 3);
	assert_int_equal(used, 1u << PSR_CODEC_JPEG);
	for (size_t i = 0; i < 3 * PIXELS; i++)
		sum += (rgb[i] - out[0][i]) * (rgb[i] - out[0][i]);
	/* Quality 95 has quantisers of up to 12: an error of 6 in each of 64 coefficients is one of 6 a pixel, YCbCr to RGB
	 * makes it 1.8 times as much at worst. */
	assert_true(sqrt(sum / (3 * PIXELS)) < 6 * 1.8);
}

static void threads_do_not_change_a_byte(void **state)
{
	struct psr_pool *pool;
	struct coded one, many;
	struct outq_chunk *a, *b;
	unsigned used;

	(void)state;
	paint(SMOOTH);
	assert_int_equal(psr_pool_create(&pool, 4, NULL), PSR_OK);
	one = encode(PSR_CODEC_JPEG, 80, PSR_CODEC_ZSTD, ALL, NULL);
	many = encode(PSR_CODEC_JPEG, 80, PSR_CODEC_ZSTD, ALL, pool);
	for (a = one.first, b = many.first; a != NULL && b != NULL; a = a->next, b = b->next) {
		assert_int_equal(a->size, b->size);
		assert_memory_equal(a->data, b->data, a->size);
	}
	assert_true(a == NULL && b == NULL);
	decode(&one, &used);
	decode(&many, &used);
	psr_pool_destroy(pool);
}

static void the_depth_range_is_of_finite_depths(void **state)
{
	struct coded coded;
	unsigned used;

	(void)state;
	paint(EMPTY);
	set_depth(5, 7.5f);
	set_depth(PIXELS - 1, 0.25f);
	coded = encode(0, 0, PSR_CODEC_RAW, 2, NULL);
	assert_true(coded.result.depth_min == 0.25 && coded.result.depth_max == 7.5);
	decode(&coded, &used);
	assert_memory_equal(out[PSR_PLANE_DEPTH], in[PSR_PLANE_DEPTH], 4 * PIXELS);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lossless_planes_come_back_bit_for_bit),
		cmocka_unit_test(hashes_are_those_of_the_planes),
		cmocka_unit_test(background_strips_are_left_out),
		cmocka_unit_test(what_does_not_shrink_travels_raw),
		cmocka_unit_test(each_strip_is_a_whole_jpeg),
		cmocka_unit_test(threads_do_not_change_a_byte),
		cmocka_unit_test(the_depth_range_is_of_finite_depths),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
